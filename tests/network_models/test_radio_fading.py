"""Fading against its laws: exponential (Rayleigh) and Rice's.

In Clarke's fades and in blocks that have nothing in common. Distributions by Kolmogorov and Smirnov
at 0.1 %, shares within 3.3 standard errors.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import i0
from scipy.stats import expon, kstest, ncx2, norm
from stations import LINKS

from desim.engine.streams import Streams
from desim.testing import Bench, check_network
from netmodels.radio.budget import RadioLinks
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.delivery import mean_delivery
from netmodels.radio.fading import Fading
from netmodels.radio.radio import Radio
from netmodels.radio.standards import G

MS = 1_000_000
FRAMES = 10_000
ERRORS = 3.3  # standard errors: one chance in a thousand
LONG = pytest.mark.validation  # another point of the same law is played with the others


def rice(k):
    """The law of the gain, k not in dB: 2 (k + 1) gain is chi-squared of two degrees of freedom,
    off the centre by 2 k."""
    return ncx2(2, 2 * k, scale=1 / (2 * k + 2))


def fades(hosts, seed=0, **params):
    return Fading(**{"coherence": "1 ms"} | params).of(
        tuple(f"robot_{i}" for i in range(hosts)), Streams(seed), 2.412e9, -82.0)


def everybody(hosts):
    """Links of 1 mW between all."""
    source, hearer = map(np.ascontiguousarray, np.nonzero(~np.eye(hosts, dtype=bool)))
    return RadioLinks.of(source, hearer, np.ones(len(source)), np.ones(len(source), bool), hosts)


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


# ------------------------------------------------------------------------------------------ fades

DOPPLER_HZ = 1.2 * 2.412e9 / 299_792_458  # 9.655
PAIRS, STEPS = 400, 4000  # 40 periods of the Doppler frequency for each of 400 pairs


def course(factor=1.0, **params):
    """[steps, pairs] gains, one step after the other. ``factor``: of the speed."""
    hosts = 29
    of_all = fades(hosts, coherence=None, speed=f"{1.2 * factor} m/s", **params)
    links = everybody(hosts)
    first = np.flatnonzero(links.source() < links.hearer)[:PAIRS]
    step_ns = fades(2, coherence=None).step_ns
    return np.array([of_all.links(links, step * step_ns).mw[first] for step in range(STEPS)])


def fades_of(found, rho):
    """Fades a second, and their mean length in s: amplitudes below ``rho`` times their root mean
    square, with the standard errors of many pairs."""
    below = found < rho ** 2
    seconds = STEPS * fades(2, coherence=None).step_ns / 1e9
    begun = (below[1:] & ~below[:-1]).sum(axis=0) / seconds
    share = below.mean(axis=0)
    duration = share.mean() / begun.mean()
    scatter = (share - duration * begun).std() / begun.mean() / math.sqrt(PAIRS)
    return begun.mean(), begun.std() / math.sqrt(PAIRS), duration, scatter


def rices(rho, k):
    """A second, and s: sqrt(2 pi (K + 1)) f rho exp(-K - (K + 1) rho^2) I0(2 rho sqrt(K (K + 1)))
    (Rice 1944; without a steady wave sqrt(2 pi) f rho exp(-rho^2), Rappaport 2002, 5.80), and the
    share below over it."""
    rate = (math.sqrt(2 * math.pi * (k + 1)) * DOPPLER_HZ * rho
            * math.exp(-k - (k + 1) * rho ** 2) * i0(2 * rho * math.sqrt(k * (k + 1))))
    return rate, rice(k).cdf(rho ** 2) / rate if k else (1 - math.exp(-rho ** 2)) / rate


@pytest.mark.parametrize("k_db", [None, 3.0])
def test_fades_are_as_frequent_and_as_long_as_rice_says(k_db):
    """Within 3.3 standard errors and 2.5 %: the waves of a pair are 32, and not infinitely many,
    and what is shorter than a step of 1 ms can be missed. With a speed that is 10 % off, not."""
    params = {} if k_db is None else {"rician_k": f"{k_db} dB"}
    k = 0.0 if k_db is None else 10 ** (k_db / 10)
    levels = 10 ** (np.array([-20.0, -10.0, 0.0, 3.0]) / 20)

    def agree(found):
        close = []
        for rho in levels:
            rate, rate_error, duration, duration_error = fades_of(found, rho)
            wanted_rate, wanted = rices(rho, k)
            close += [abs(rate - wanted_rate) < ERRORS * rate_error + 0.025 * wanted_rate,
                      abs(duration - wanted) < ERRORS * duration_error + 0.025 * wanted]
        return all(close)

    assert agree(course(**params)) and not agree(course(1.1, **params))


def test_deep_fades_were_too_long_in_blocks():
    """20 dB: 4.2 ms on average by Rice's formula, and in blocks of 9 / (16 pi f), 18.5 ms, at least
    one of these."""
    _, _, duration, _ = fades_of(course(), 0.1)
    assert duration == pytest.approx(4.16e-3, rel=0.1)
    assert 9 / (16 * math.pi * DOPPLER_HZ) / duration > 4


def test_the_gain_at_any_moment_is_rayleighs_or_rices():
    """Of all pairs of 200 hosts."""
    for k_db in None, 7.0:
        params = {} if k_db is None else {"rician_k": f"{k_db} dB"}
        found = fades(200, coherence=None, **params).links(everybody(200), 123_456 * MS).mw
        found = found.reshape(200, 199)[np.triu_indices(200, 1)[0], np.triu_indices(200, 1)[1] - 1]
        law = expon if k_db is None else rice(10 ** (k_db / 10))
        assert kstest(found, law.cdf).pvalue > 0.001
        assert kstest(1.05 * found, law.cdf).pvalue < 0.001


@given(st.integers(2, 12), st.integers(0, 10**14), st.integers(0, 5),
       st.sampled_from([{}, {"rician_k": "3 dB"}]))
def test_clarkes_fades_are_alike_in_both_directions_and_whoever_asks(hosts, now_ns, more, params):
    def square(count, *before):
        of_all, out = fades(count, coherence=None, **params), np.zeros((count, count))
        for earlier_ns in before:
            of_all.links(everybody(count), earlier_ns)
        out[~np.eye(count, dtype=bool)] = of_all.links(everybody(count), now_ns).mw
        assert now_ns < of_all.until_ns <= now_ns + of_all.step_ns
        return out

    found = square(hosts + more)
    assert np.array_equal(found, found.T)
    assert np.array_equal(found[:hosts, :hosts], square(hosts, now_ns // 2, 3 * now_ns))


def test_frames_are_lost_in_fades_on_the_radio():
    """At a mean 10 dB above the threshold, 500 frames a second: there are as many bursts of losses
    as fades, and they are as long."""
    air = bench(-72.0, {"speed": "1.2 m/s"})
    every_ns, frames = 2 * MS, 12_000
    for k in range(frames):
        air.send(k * every_ns, "host_1", ["host_2"], 100, label=k, broadcast=True)
    lost = np.zeros(frames, bool)
    for _, label, *_, fate in air.run():
        lost[label] = fate != "arrived"
    bursts = (lost[1:] & ~lost[:-1]).sum()
    rate, duration = rices(10 ** -0.5, 0.0)
    seconds = frames * every_ns / 1e9
    assert bursts == pytest.approx(rate * seconds, rel=4 / math.sqrt(rate * seconds))
    assert lost.sum() * every_ns / 1e9 / bursts == pytest.approx(duration, rel=0.2)


# ----------------------------------------------------------------------------------- on the radio


def bench(mean_dbm, fading, **params):
    """Two hosts: at 6 Mb/s there are no errors from -82 dBm on, 12 dB above the noise, and below
    that nothing is found."""
    path_loss = {"model": "fixed", "total": f"{16.0206 - mean_dbm} dB"}
    return Bench(DcfRadio(DcfRadio.Params(path_loss=path_loss, fading=fading, **{
        "rate": "6 Mb/s", "reception": LINKS["reception"], **params})), 2)


def delivered(mean_dbm, fading, *, broadcast=True, every_ns=20 * MS, frames=FRAMES, **params):
    air = bench(mean_dbm, fading, **params)
    for k in range(frames):
        air.send(k * every_ns, "host_1", ["host_2"], 200, broadcast=broadcast)
    return sum(fate == "arrived" for *_, fate in air.run()) / frames


@pytest.mark.parametrize(("mean_dbm", "k_db"), [
    (-82.0, None), pytest.param(-77.0, None, marks=LONG), (-84.0, 7.0),
    pytest.param(-81.0, 7.0, marks=LONG)])
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


def test_retries_in_a_block_are_wasted_and_later_ones_are_not():
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
                      rate="1 Mb/s", reception={
                          "preamble": "-100 dBm", "noise_figure": "0 dB",
                          "constants": {"preamble_above": "0 dB"}})
    share = math.exp(-10 ** 0.3)
    assert abs(found - share) < ERRORS * math.sqrt(share * (1 - share) / 4000)


# ------------------------------------------------------------------------- coverage, and the ladder


@pytest.mark.parametrize("params", [{}, pytest.param({"rician_k": "7 dB"}, marks=LONG)])
def test_coverage_is_the_mean_over_blocks(params):
    """At 54 Mb/s, where errors have a curve of their own."""
    air = bench(-68.0, params, broadcast_rate="54 Mb/s")
    for k in range(FRAMES):
        air.send(k * 20 * MS, "host_1", ["host_2"], 1518, broadcast=True)
    found = sum(fate == "arrived" for *_, fate in air.run()) / FRAMES
    tolerance = ERRORS * math.sqrt(found * (1 - found) / FRAMES)

    def share(mean_dbm):
        return float(mean_delivery(mean_dbm, G, G.rate(54), 1536,
                                   DcfRadio.Params().reception.for_stations(), Fading(**params)))

    assert abs(share(-68.0) - found) < tolerance
    assert abs(share(-67.6) - found) > tolerance


def test_the_radio_tells_the_mean_of_its_links():
    radio = DcfRadio(DcfRadio.Params(fading={}, rate="6 Mb/s", **LINKS))
    Bench(radio, {"a": (0.0, 0.0), "b": (51.46, 0.0)})
    signal = radio.signal(np.zeros(2), np.array([[51.46, 0.0], [np.nan, 0.0], [1.0, 0.0]]))
    assert signal.delivery == pytest.approx([math.exp(-1), 0.0, 1.0], abs=0.005)
    _, _, share = radio.links()
    assert share == pytest.approx([math.exp(-1)] * 2, abs=0.005)


@pytest.mark.parametrize("params", [{}, pytest.param({"rician_k": "7 dB"}, marks=LONG)])
def test_the_disk_ends_where_nine_of_ten_frames_arrive(params):
    """In blocks that are longer than all attempts take."""
    params = {"fading": {"coherence": "200 ms", **params}}

    def share(factor):
        range_m = factor * Radio.build(Radio.Params(fidelity="disk", **params)).range_m[False]
        air = Bench(Radio.build(Radio.Params(**params)), {"a": (0, 0), "b": (range_m, 0)})
        for k in range(4000):
            air.send(k * 200 * MS, "a", "b", 1518)
        return sum(fate == "arrived" for *_, fate in air.run()) / 4000

    tolerance = ERRORS * math.sqrt(0.9 * 0.1 / 4000)
    assert share(1) == pytest.approx(0.9, abs=tolerance)
    assert abs(share(1.1) - 0.9) > tolerance


@pytest.mark.parametrize("params", [{"speed": "0.02 m/s"},
                                    {"rician_k": "7 dB", "coherence": "100 ms"}])
def test_it_keeps_the_contract(params):
    """With few steps: there are some from the first packet of a train to its last one."""
    check_network(Radio, fading=params)
    check_network(Radio, fading=params, shadowing={}, fidelity="walls")
