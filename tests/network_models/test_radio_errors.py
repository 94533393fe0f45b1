"""Bit errors against the table of direct model calls, and the kernels' table against both."""

import numpy as np
import pytest
from stations import rows

from netmodels.radio.errors import bit_error, error_table, packet_error

OFDM = (6, 9, 12, 18, 24, 36, 48, 54)
DSSS = (1, 2, 5.5, 11)


def worst(reference, factor: float = 1.0) -> float:
    """The largest difference to the table, at ratios that are ``factor`` times what it says."""
    return max(abs(float(packet_error(int(row["mode"][8:-4]),
                                      factor * 10 ** (float(row["snr_db"]) / 10),
                                      int(row["psdu_bytes"]))) - float(row["per_nist"]))
               for row in rows(reference / "ns3" / "s6_per_vs_snr.csv"))


def test_ofdm_rates_are_the_nist_closed_form(reference):
    assert worst(reference) < 1e-6
    assert worst(reference, factor=1.05) > 0.1


@pytest.mark.parametrize("mbps", OFDM + DSSS)
def test_more_signal_never_means_more_errors(mbps):
    ratio = 10 ** (np.linspace(-10, 35, 2000) / 10)
    error = bit_error(mbps, ratio)
    assert np.all(np.diff(error) <= 0) and np.all((error >= 0) & (error <= 1))


def test_differential_bpsk():
    """Eb/N0 of 1 Mb/s in 22 MHz is 22 times the ratio; half of exp(-Eb/N0) (Proakis)."""
    assert bit_error(1, 0.5) == pytest.approx(0.5 * np.exp(-11))


@pytest.mark.parametrize(("ratio", "error"), [
    (0.0999, 0.5), (0.1, 0.4702), (10, 2.2415e-5), (10.001, 0.0)])
def test_the_fit_of_11_mbps_holds_from_a_tenth_to_ten(ratio, error):
    """The rational fit of Pei and Henderson, for ratios between these bounds, both included."""
    assert bit_error(11, ratio) == pytest.approx(error, rel=1e-3)


def through_table(mbps: float, db: np.ndarray, size_bytes: int) -> np.ndarray:
    table = error_table((mbps,))
    at = (db - table.first_db) / table.step_db
    steps = np.arange(table.log_log.shape[1])
    return -np.expm1(-8 * size_bytes * np.exp(np.interp(at, steps, table.log_log[0])))


@pytest.mark.parametrize("mbps", OFDM + DSSS)
def test_the_kernels_table_is_as_good_as_the_closed_form(mbps):
    db = np.linspace(-9.99, 34.9, 9001)
    if mbps == 11:  # whose fit ends with a step at 10 dB
        db = db[np.abs(db - 10) > 0.06]
    exact = packet_error(mbps, 10 ** (db / 10), 1500)
    assert np.max(np.abs(through_table(mbps, db, 1500) - exact)) < 1e-4
