"""Fading against its laws: exponential (Rayleigh) and Rice's, in blocks that have nothing in
common. Distributions by Kolmogorov and Smirnov at 0.1 %, shares within 3.3 standard errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from radio import LINKS
from scipy.stats import expon, kstest, ncx2, norm

from desim.streams import Streams
from desim.testing import Bench, check_network
from netmodels.radio import Radio
from netmodels.radio.budget import Links
from netmodels.radio.delivery import mean_delivery
from netmodels.radio.fading import Fades, Fading
from netmodels.radio.ladder import Ladder
from netmodels.radio.standards import A, B, G

MS = 1_000_000
FRAMES = 10_000
ERRORS = 3.3  # standard errors: one chance in a thousand


def rice(k):
    """The law of the gain, k not in dB: 2 (k + 1) gain is chi-squared of two degrees of freedom,
    off the centre by 2 k."""
    return ncx2(2, 2 * k, scale=1 / (2 * k + 2))


def fades(hosts, seed=0, **params):
    return Fades(Fading(coherence="1 ms", **params), tuple(f"robot_{i}" for i in range(hosts)),
                 Streams(seed), 2.412e9, -82.0)


def everybody(hosts):
    """Links of 1 mW between all."""
    source, hearer = map(np.ascontiguousarray, np.nonzero(~np.eye(hosts, dtype=bool)))
    return Links.of(source, hearer, np.ones(len(source)), np.ones(len(source), bool), hosts)


def gains(hosts, block, **params):
    """[hosts, hosts] in a block, 0 on the diagonal."""
    out = np.zeros((hosts, hosts))
    out[~np.eye(hosts, dtype=bool)] = fades(hosts, **params).links(
        everybody(hosts), block * MS).mw
    return out


def one_pair(blocks, **params):
    pair, links = fades(2, **params), everybody(2)
    return np.array([pair.links(links, block * MS).mw[0] for block in range(blocks)])


def all_pairs(hosts, **params):
    return gains(hosts, 7, **params)[np.triu_indices(hosts, 1)]


# ------------------------------------------------------------------------------------ distribution


@pytest.mark.parametrize("draws", [lambda: one_pair(20_000), lambda: all_pairs(300)],
                         ids=["blocks", "pairs"])
def test_without_a_steady_wave_the_gain_is_exponential(draws):
    found = draws()
    assert kstest(found, expon.cdf).pvalue > 0.001
    assert kstest(found, expon(scale=1.05).cdf).pvalue < 0.001


@pytest.mark.parametrize("k_db", [0.0, 7.0, 12.0])
def test_with_one_it_is_rices(k_db):
    k = 10 ** (k_db / 10)
    found = all_pairs(600, rician_k=f"{k_db} dB")
    assert kstest(found, rice(k).cdf).pvalue > 0.001
    assert kstest(found, rice(1.1 * k).cdf).pvalue < 0.001


def test_the_mean_is_what_it_was():
    for params in {}, {"rician_k": "7 dB"}:
        found = all_pairs(600, **params)
        assert abs(found.mean() - 1) < ERRORS * found.std() / math.sqrt(found.size)
        assert (10 ** (Fading(**params).gains_db() / 10)).mean() == pytest.approx(1, abs=0.002)


def test_no_gain_is_above_the_best():
    for params in {}, {"rician_k": "7 dB"}:
        best = 10 ** (Fading(**params).best_db / 10)
        assert 5 < all_pairs(600, **params).max() < best
        law = rice(Fading(**params).steady)
        assert law.sf(best) < 1e-11  # it takes nothing from the law


# ---------------------------------------------------------------------------------- pairs and time


@given(st.integers(2, 12), st.integers(0, 10**9), st.integers(0, 5),
       st.sampled_from([{}, {"rician_k": "3 dB"}]))
def test_both_directions_are_alike_and_the_others_do_not_matter(hosts, block, more, params):
    found = gains(hosts + more, block, **params)
    assert np.array_equal(found, found.T)
    assert np.array_equal(found[:hosts, :hosts], gains(hosts, block, **params))


@given(st.integers(0, 10**15), st.integers(0, MS - 1), st.integers(0, MS - 1))
def test_it_is_constant_in_a_block(block, early_ns, late_ns):
    pair = fades(2)
    before = pair.links(everybody(2), block * MS + early_ns).mw
    assert pair.until_ns == (block + 1) * MS
    assert np.array_equal(before, fades(2).links(everybody(2), block * MS + late_ns).mw)
    assert not np.array_equal(before, pair.links(everybody(2), pair.until_ns).mw)


def uncorrelated(one, other):
    """Of ranks, so that a few large gains do not decide: within 3.3 / sqrt(n)."""
    ranks = [np.argsort(np.argsort(values)) for values in (one, other)]
    return abs(np.corrcoef(*ranks)[0, 1]) < ERRORS / math.sqrt(one.size)


@pytest.mark.parametrize("params", [{}, {"rician_k": "7 dB"}])
def test_blocks_pairs_and_seeds_have_nothing_in_common(params):
    along = one_pair(10_000, **params)
    for lag in 1, 2, 7:
        assert uncorrelated(along[:-lag], along[lag:])
    one = all_pairs(150, **params)
    assert uncorrelated(one, gains(150, 8, **params)[np.triu_indices(150, 1)])
    assert uncorrelated(one, all_pairs(150, seed=1, **params))
    square = gains(150, 7, **params)
    assert uncorrelated(square[0, 2:], square[1, 2:])  # two links of each host
    assert not uncorrelated(one, one + norm.rvs(size=one.size, random_state=1))


@pytest.mark.parametrize(("standard", "channel", "block_ms"), [(G, 1, 18.545), (B, 6, 18.356),
                                                               (A, 36, 8.635)])
def test_a_block_is_as_long_as_rappaport_says(standard, channel, block_ms):
    """9 / (16 pi f), f being 9.655 Hz for 1.2 m/s on 2412 MHz."""
    def block_ns(speed):
        return Fading(speed=speed).block_ns(standard.carrier_hz(channel))

    assert block_ns("1.2 m/s") == pytest.approx(block_ms * MS, rel=1e-4)
    assert block_ns("1.26 m/s") == pytest.approx(block_ms * MS / 1.05, rel=1e-4)


# ----------------------------------------------------------------------------------- on the radio


def bench(mean_dbm, fading, **params):
    """Two hosts: at 6 Mb/s there are no errors from -82 dBm on, 12 dB above the noise, and below
    that nothing is found."""
    path_loss = {"model": "fixed", "total": f"{16.0206 - mean_dbm} dB"}
    return Bench(Radio(Radio.Params(path_loss=path_loss, fading=fading, **{
        "rate": "6 Mb/s", "reception": LINKS["reception"], **params})), 2)


def delivered(mean_dbm, fading, *, broadcast=True, every_ns=20 * MS, frames=FRAMES, **params):
    air = bench(mean_dbm, fading, **params)
    for k in range(frames):
        air.send(k * every_ns, "host_1", ["host_2"], 200, broadcast=broadcast)
    return sum(fate == "arrived" for *_, fate in air.run()) / frames


@pytest.mark.parametrize(("mean_dbm", "k_db"), [(-82.0, None), (-77.0, None), (-84.0, 7.0),
                                                (-81.0, 7.0)])
def test_outage_is_that_of_a_threshold(mean_dbm, k_db):
    """Rayleigh: P(gain mean < threshold) = 1 - exp(-threshold / mean)."""
    fading = {} if k_db is None else {"rician_k": f"{k_db} dB"}
    threshold = 10 ** ((-82.0 - mean_dbm) / 10)

    def agrees(threshold):
        share = (math.exp(-threshold) if k_db is None
                 else rice(10 ** (k_db / 10)).sf(threshold))
        error = math.sqrt(share * (1 - share) / FRAMES)
        return abs(found - share) < ERRORS * error

    found = delivered(mean_dbm, fading)
    assert agrees(threshold) and not agrees(1.1 * threshold)


def test_retries_in_a_block_are_in_vain_and_later_ones_are_not():
    """The same link for all seven attempts, against one that is another one by the next."""
    long, short = ({"coherence": period} for period in ("1 s", "1 ms"))
    share, error = math.exp(-1), math.sqrt(math.exp(-1) * (1 - math.exp(-1)) / 1000)
    options = {"broadcast": False, "frames": 1000}
    assert abs(delivered(-82.0, long, every_ns=1000 * MS, **options) - share) < ERRORS * error
    assert delivered(-82.0, short, every_ns=1000 * MS, **options) > 0.85
    assert delivered(-82.0, short, every_ns=1000 * MS, retries=100, **options) == 1.0


def test_what_waits_is_sent_over_the_link_of_its_time():
    """400 broadcasts are sent at once: those of one block share their fate, those of others do
    not."""
    air = bench(-82.0, {"coherence": "5 ms"})
    for k in range(400):
        air.send(0, "host_1", ["host_2"], 1000, label=k, broadcast=True)
    by_block = {}
    for time_ns, *_, fate in air.run():
        begun_ns = time_ns - G.airtime_ns(1018, G.rate(6))  # found in the first 4 us
        if begun_ns // (5 * MS) == time_ns // (5 * MS):
            by_block.setdefault(time_ns // (5 * MS), set()).add(fate == "arrived")
    assert len(by_block) > 80 and all(len(fates) == 1 for fates in by_block.values())
    arrived = sum(True in fates for fates in by_block.values()) / len(by_block)
    assert abs(arrived - math.exp(-1)) < ERRORS * math.sqrt(0.2325 / len(by_block))


def test_what_is_heard_only_when_it_fades_up_is_not_forgotten():
    """A receiver that finds what comes above its noise, from -100 dBm on, and gets 3 dB less on the
    average, which alone would not even count as interference."""
    found = delivered(-103.0, {}, frames=4000, standard="11b", broadcast_rate="1 Mb/s",
                      rate="1 Mb/s", reception={"preamble": "-100 dBm", "preamble_above": "0 dB",
                                                "noise_figure": "0 dB"})
    share = math.exp(-10 ** 0.3)
    assert abs(found - share) < ERRORS * math.sqrt(share * (1 - share) / 4000)


# ------------------------------------------------------------------------- coverage, and the ladder


@pytest.mark.parametrize("params", [{}, {"rician_k": "7 dB"}])
def test_coverage_is_the_mean_over_blocks(params):
    """At 54 Mb/s, where errors have a curve of their own."""
    air = bench(-68.0, params, broadcast_rate="54 Mb/s")
    for k in range(FRAMES):
        air.send(k * 20 * MS, "host_1", ["host_2"], 1518, broadcast=True)
    found = sum(fate == "arrived" for *_, fate in air.run()) / FRAMES
    tolerance = ERRORS * math.sqrt(found * (1 - found) / FRAMES)

    def share(mean_dbm):
        return float(mean_delivery(mean_dbm, G, G.rate(54), 1536,
                                   Radio.Params().reception.for_stations(), Fading(**params)))

    assert abs(share(-68.0) - found) < tolerance
    assert abs(share(-67.6) - found) > tolerance


def test_the_radio_tells_the_mean_of_its_links():
    radio = Radio(Radio.Params(fading={}, rate="6 Mb/s", **LINKS))
    Bench(radio, {"a": (0.0, 0.0), "b": (51.46, 0.0)})
    signal = radio.signal(np.zeros(2), np.array([[51.46, 0.0], [np.nan, 0.0], [1.0, 0.0]]))
    assert signal.delivery == pytest.approx([math.exp(-1), 0.0, 1.0], abs=0.005)
    _, _, share = radio.links()
    assert share == pytest.approx([math.exp(-1)] * 2, abs=0.005)


@pytest.mark.parametrize("params", [{}, {"rician_k": "7 dB"}])
def test_the_disk_ends_where_nine_of_ten_frames_arrive(params):
    """In blocks that are longer than all attempts take."""
    params = {"fading": {"coherence": "200 ms", **params}}

    def share(factor):
        range_m = factor * Ladder(Ladder.Params(fidelity="disk", **params)).range_m[False]
        air = Bench(Ladder(Ladder.Params(**params)), {"a": (0, 0), "b": (range_m, 0)})
        for k in range(4000):
            air.send(k * 200 * MS, "a", "b", 1518)
        return sum(fate == "arrived" for *_, fate in air.run()) / 4000

    tolerance = ERRORS * math.sqrt(0.9 * 0.1 / 4000)
    assert share(1) == pytest.approx(0.9, abs=tolerance)
    assert abs(share(1.1) - 0.9) > tolerance


@pytest.mark.parametrize("params", [{}, {"rician_k": "7 dB", "coherence": "1 ms"}])
def test_it_keeps_the_contract(params):
    check_network(Ladder, fading=params)
    check_network(Ladder, fading=params, shadowing={}, fidelity="walls")
