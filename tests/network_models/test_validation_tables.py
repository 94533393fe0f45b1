"""The tables that the product carries are those of the reference data, to their last digit."""

import csv
from collections import defaultdict
from statistics import mean

import numpy as np
import pytest
from scipy.special import factorial

from netmodels.validation import (
    one_link,
    places,
    propagation,
    queues,
    shared_channels,
)
from netmodels.validation.stations import DISC, PERIODIC, POISSON, SATURATION


@pytest.fixture
def means(reference):
    """means(file, keys, values, **wanted): key values to the means of these columns over runs."""
    def read(name, keys, values, **wanted):
        found = defaultdict(list)
        with (reference / "ns3" / name).open(newline="") as file:
            for row in csv.DictReader(file):
                if all(row[key] == value for key, value in wanted.items()):
                    found[tuple(row[key] for key in keys)].append(
                        [float(row[value]) for value in values])
        return {key: [mean(column) for column in zip(*runs, strict=True)]
                for key, runs in found.items()}

    return read


MODES = {("11a", 6, None): ("OfdmRate6Mbps", "sink-fixed"),
         ("11a", 24, None): ("OfdmRate24Mbps", "sink-fixed"),
         ("11g", 54, None): ("ErpOfdmRate54Mbps", "sink-fixed"),
         ("11g", 54, "9 us"): ("ErpOfdmRate54Mbps", "sink-fixed-slot9")}


def test_saturation(means):
    runs = means("s3_saturation_raw_runs.csv", ("mode", "topo", "n"),
                 ("agg_goodput_mbps", "p_fail_per_attempt"))
    for setting, rows in SATURATION.items():
        for stations, (goodput_mbps, failure_rate) in rows.items():
            expected = runs[*MODES[setting], str(stations)]
            assert (goodput_mbps, failure_rate) == (
                pytest.approx(expected[0], abs=6e-4), pytest.approx(expected[1], abs=6e-5))


def test_two_pairs(means):
    runs = means("s5_spatial_reuse_two_pairs.csv", ("mode", "d_m"), ("agg_goodput_mbps",))
    for mbps, rows in places.TWO_PAIRS.items():
        for apart_m, goodput_mbps in rows.items():
            assert runs[f"OfdmRate{mbps}Mbps", str(apart_m)] == [
                pytest.approx(goodput_mbps, abs=6e-4)]


def test_one_pair(means):
    runs = means("s5_single_pair_vs_distance.csv", ("mode", "x_m"), ("p_fail_per_attempt",))
    for mbps, rows in one_link.FAILURES.items():
        for apart_m, share in rows.items():
            assert runs[f"OfdmRate{mbps}Mbps", str(apart_m)] == [share]


def test_hidden_terminals(means):
    runs = means("s5_hidden_terminal.csv", ("mode", "x_m", "rts"), ("agg_goodput_mbps",))
    for (mbps, spacing_m), goodputs_mbps in places.HIDDEN.items():
        for rts, goodput_mbps in enumerate(goodputs_mbps):
            assert runs[f"OfdmRate{mbps}Mbps", str(spacing_m), str(rts)] == [
                pytest.approx(goodput_mbps, abs=6e-4)]
    runs = means("s5_hidden_terminal_vs_load.csv", ("x_m", "offered_per_sender_mbps"),
                 ("agg_goodput_mbps",))
    for spacing_m, rows in places.HIDDEN_BY_LOAD.items():
        for load_mbps, goodput_mbps in rows.items():
            assert runs[str(spacing_m), str(load_mbps)] == [pytest.approx(goodput_mbps, abs=6e-4)]


def test_heartbeats(means):
    runs = means("s4_broadcast_heartbeats.csv",
                 ("bcast_mode", "R_m", "n", "hz", "arrivals"), ("delivery_ratio",), std="a")
    for (stations, hz, mbps), share in POISSON.items():
        assert runs[f"OfdmRate{mbps}Mbps", "0", str(stations), str(hz), "poisson"] == [
            pytest.approx(share, abs=6e-5)]
    for arrivals, radius_m, table in (("phase", "0", PERIODIC),
                                      ("poisson", "20", DISC)):
        for (stations, hz), share in table.items():
            assert runs["OfdmRate6Mbps", radius_m, str(stations), str(hz), arrivals] == [
                pytest.approx(share, abs=6e-5)]


def test_the_cable(means):
    runs = means("s1_shared_bus_csma.csv", ("n_senders", "offered_load"),
                 ("delivered_mbps_wire", "loss_ratio"), arrivals="periodic")
    for (senders, load), row in shared_channels.CSMA.items():
        mbps, lost = runs[str(senders), f"{load:.4f}"]
        assert row == (pytest.approx(mbps, abs=6e-4), pytest.approx(lost, abs=6e-5))


def test_the_bottleneck(means):
    runs = means("s1_bottleneck_periodic.csv", ("n_senders", "offered_load"),
                 ("loss_ratio", "mean_owd_ms"), bottleneck_mbps="10")
    for (senders, load), row in queues.PERIODIC.items():
        lost, delay_ms = runs[str(senders), f"{load:.4f}"]
        assert row == (pytest.approx(lost, abs=6e-5), pytest.approx(delay_ms, abs=6e-3))


def test_formulas(means):
    runs = means("s6_per_vs_snr.csv", ("mode", "snr_db"), ("per_nist",), psdu_bytes="1064")
    for (mbps, db), chance in propagation.PACKET_ERRORS.items():
        assert runs[f"OfdmRate{mbps}Mbps", str(db)] == [chance]
    runs = means("s6_rx_power_logdistance.csv", ("distance_m",), (
        "rx_dbm_logdist", "rx_dbm_friis_5180MHz", "rx_dbm_friis_2412MHz"))
    for distance_m, dbm in propagation.RECEIVED_DBM.items():
        assert tuple(runs[str(distance_m),]) == dbm


@pytest.mark.parametrize(("queue", "load"), queues.FINITE)
def test_the_finite_queue(queue, load):
    """M/D/1/K by the Markov chain of what departures leave behind (Gross and Harris, 5.1.8): of all
    arrivals 1 - 1 / (pi_0 + load) are lost."""
    states = queue + 1
    come = load ** np.arange(states) * np.exp(-load) / factorial(np.arange(states))
    chain = np.zeros((states, states))
    for before in range(states):
        left = max(before - 1, 0)
        chain[before, left:] = come[:states - left]
        chain[before, -1] += 1 - chain[before].sum()  # what finds no place
    values, vectors = np.linalg.eig(chain.T)
    stays = vectors[:, np.argmax(values.real)].real
    lost = 1 - 1 / (stays[0] / stays.sum() + load)
    assert queues.FINITE[queue, load][0] == pytest.approx(lost, abs=6e-6)
