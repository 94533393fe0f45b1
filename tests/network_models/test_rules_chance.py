"""Rules that draw: the laws of their luck, and whose luck it is.

Where a tolerance is so many standard errors, 3.3 of them leave one chance in a thousand.
"""

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats
from test_netmodels_rules import MS, S, fates, make

from desim.engine.streams import Streams
from desim.ports import Deliver, Drop, Duplicate, Frame
from desim.testing import Bench, ImmediateNetwork
from netmodels.rules.outage import OnOffProcess

# ---------------------------------------------------------------------------------------- latency

LAWS = {  # of delays in ms with the mean 50 and the jitter 10, cut off at 0
    "uniform": stats.uniform(40, 20),
    "normal": stats.norm(50, 10),
    "exponential": stats.expon(40, 10),
    "gamma": stats.gamma(25, scale=2),
    "pareto": stats.pareto(3, loc=50 - 1.5 * 10 / math.sqrt(0.75), scale=10 / math.sqrt(0.75)),
}


def verdicts(rule, frames, segments=1):
    """The rule's verdicts about so many frames of one link."""
    Bench(ImmediateNetwork(), 2, rules=[rule])
    frame = Frame(1, 0, (1,), 100 * segments, segments, False)
    return [verdict for _ in range(frames) for verdict in rule.judge(frame, (1,)) or [None]]


def delays_ms(**params):
    return [verdict.delay_ns / MS for verdict in verdicts(make("latency", **params), 20_000)]


def misfit(law, **params):
    """The chance that 20,000 draws from ``law`` differ as much from it as these (Kolmogorov and
    Smirnov)."""
    return stats.kstest(delays_ms(distribution=law, **params), LAWS[law].cdf).pvalue


@pytest.mark.parametrize("law", LAWS)
def test_delays_follow_their_law(law):
    assert (LAWS[law].mean(), LAWS[law].std()) == pytest.approx(
        (50, 10 / math.sqrt(3) if law == "uniform" else 10))
    assert misfit(law, delay="50 ms", jitter="10 ms") > 0.001


@pytest.mark.parametrize("law", LAWS)
def test_the_twin_a_tenth_more_jitter_shows(law):
    assert misfit(law, delay="50 ms", jitter="11 ms") < 0.001


def test_what_would_be_early_is_at_once():
    """N(10, 10) ms is below 0 for 15.9 % of all frames."""
    delays = delays_ms(delay="10 ms", jitter="10 ms", distribution="normal")
    at_once = stats.norm.cdf(-1)
    assert min(delays) == 0
    assert delays.count(0) / 20_000 == pytest.approx(
        at_once, abs=3.3 * math.sqrt(at_once * (1 - at_once) / 20_000))


def test_a_late_frame_is_late_under_every_law():
    """They take the same luck, so that two of them can be compared frame by frame."""
    of = {law: np.array(delays_ms(delay="50 ms", jitter="10 ms", distribution=law))
          for law in LAWS}
    order = np.argsort(of["uniform"])
    for law in LAWS:
        assert np.diff(of[law][order]).min() > -100e-6  # two that are rounded to the same ns


# ------------------------------------------------------------------------------------ burst losses

PACKETS = 200_000


def bursts(**params):
    """Share of lost packets, and mean length of a burst of them."""
    lost = np.array([type(verdict) is Drop
                     for verdict in verdicts(make("gilbert_elliott", **params), PACKETS)])
    begins = np.count_nonzero(np.diff(lost.astype(int), prepend=0) == 1)
    return lost.mean(), lost.sum() / begins


def share_error(p, r, bad=1.0, good=0.0):
    """Standard error of the share: what two packets k apart have in common falls with
    (1 - p - r)^k."""
    share = p / (p + r)
    memory = (2 - p - r) / (p + r)
    mean = share * bad + (1 - share) * good
    state, chance = share * (1 - share) * (bad - good) ** 2, mean * (1 - mean)
    return math.sqrt((chance + state * (memory - 1)) / PACKETS)


def test_bursts_have_the_stationary_share_and_length():
    """p / (p + r) = 9.09 % are lost, 1 / r = 5 in a row (standard deviation sqrt(1 - r) / r)."""
    share, length = bursts(p="2 %", r="20 %")
    assert share == pytest.approx(1 / 11, abs=3.3 * share_error(0.02, 0.2))
    assert length == pytest.approx(5, abs=3.3 * math.sqrt(0.8) * 5
                                   / math.sqrt(PACKETS / 11 * 0.2))


@pytest.mark.parametrize("p, r", [("2.2 %", "20 %"), ("2 %", "22 %")])
def test_the_twin_a_tenth_other_chances_show(p, r):
    share, length = bursts(p=p, r=r)
    assert (abs(share - 1 / 11) > 3.3 * share_error(0.02, 0.2)
            or abs(length - 5) > 3.3 * math.sqrt(0.8) * 5 / math.sqrt(PACKETS / 11 * 0.2))


@pytest.mark.parametrize("bad, fits", [(0.5, True), (0.55, False)])
def test_both_states_lose_as_elliott_has_it(bad, fits):
    """(p loss_bad + r loss_good) / (p + r); the twin loses a tenth more in the bad state."""
    share, _ = bursts(p=0.05, r=0.15, loss_bad=bad, loss_good=0.02)
    law = (0.05 * 0.5 + 0.15 * 0.02) / 0.2
    assert (abs(share - law) < 3.3 * share_error(0.05, 0.15, 0.5, 0.02)) == fits


def test_a_train_meets_the_states_packet_by_packet():
    """Ten packets get through if the good state, found with r / (p + r), does not end at the first
    nine: 10/11 * 0.98^9. Trains have (0.78)^10 = 0.083 in common: 1.09 standard errors."""
    got = verdicts(make("gilbert_elliott", p="2 %", r="20 %"), 20_000, segments=10)
    law = 10 / 11 * 0.98 ** 9
    share = sum(type(verdict) is not Drop for verdict in got) / 20_000
    assert share == pytest.approx(law, abs=3.3 * 1.09 * math.sqrt(law * (1 - law) / 20_000))


def test_it_starts_as_it_goes_on():
    """Of 1980 links as many first packets are lost as of all: 9.09 %."""
    hosts = [f"host_{i}" for i in range(1, 46)]
    bench = Bench(ImmediateNetwork(), 45, rules=[make("gilbert_elliott", p="2 %", r="20 %")])
    for source in hosts:
        bench.send(0, source, [host for host in hosts if host != source], 100, broadcast=True)
    lost = sum(fate != "arrived" for _, fate in fates(bench))
    assert lost / 1980 == pytest.approx(1 / 11, abs=3.3 * math.sqrt(10 / 11 / 11 / 1980))


@pytest.mark.parametrize("segments", [1, 5])
@pytest.mark.parametrize("name, params", [
    ("loss", {}), ("jamming", {"at": ["0 m", "0 m"], "radius": "1 m"})])
def test_what_is_lost_packet_by_packet(name, params, segments):
    """A train of so many packets gets through with 0.8^segments, binomial; the twin loses a tenth
    more."""
    law, frame = 0.8 ** segments, Frame(1, 0, (1,), 100 * segments, segments, False)
    for probability, fits in (0.2, True), (0.22, False):
        rule = make(name, probability=probability, **params)
        Bench(ImmediateNetwork(), {"a": (0, 0), "b": (50, 0)}, rules=[rule])
        passed = sum(type(rule.judge(frame, (1,))[0]) is not Drop for _ in range(20_000)) / 20_000
        assert (abs(passed - law) < 3.3 * math.sqrt(law * (1 - law) / 20_000)) is fits


# ------------------------------------------------------------------- duplication and reordering


@pytest.mark.parametrize("p, segments, fits", [(0.2, 1, True), (0.5, 3, True), (0.55, 3, False)])
def test_a_train_comes_twice_if_all_of_it_does(p, segments, fits):
    """0.2 and 0.5^3, binomial; the twin is 0.55^3."""
    law = {1: 0.2, 3: 0.125}[segments]
    got = verdicts(make("duplication", probability=p), 20_000, segments)
    share = sum(type(verdict) is Duplicate for verdict in got) / 20_000
    assert (abs(share - law) < 3.3 * math.sqrt(law * (1 - law) / 20_000)) == fits


def reordered(probability):
    """The share of frames, sent every 10 ms, that arrive behind one that was sent later (RFC 4737,
    3.3) where those held back are so for 25 ms."""
    frames = 20_000
    bench = Bench(ImmediateNetwork(), 2, rules=[make("reordering", probability=probability,
                                                     delay="25 ms")])
    for label in range(frames):
        bench.send(label * 10 * MS, "host_1", "host_2", 100, label=label)
    newest, late = -1, 0
    for label, _ in fates(bench):
        late += label < newest
        newest = max(newest, label)
    return late / frames


def test_frames_held_back_are_overtaken():
    """A frame is late if it is held back and one of the next two is not: p (1 - p^2). Frames more
    than two apart have nothing to do with each other: at most 5 times the binomial variance."""
    law = 0.3 * (1 - 0.3 ** 2)
    tolerance = 3.3 * math.sqrt(5 * law * (1 - law) / 20_000)
    assert abs(reordered(0.3) - law) < tolerance
    assert abs(reordered(0.33 * 1.05) - law) > tolerance


# ------------------------------------------------------------------------------ two-state outages


def spells(down_ns, count=4000):
    """Lengths in s of so many spells down, and up."""
    own = OnOffProcess(Streams(3)("link"), (down_ns, 40 * S))
    lengths, now_ns = {False: [], True: []}, own.until_ns
    own.up(now_ns)
    for _ in range(2 * count):
        up, end_ns = own.up(now_ns), own.until_ns
        lengths[up].append((end_ns - now_ns) / S)
        now_ns = end_ns
    return lengths[False], lengths[True]


def test_spells_are_exponential():
    """Means 10 s and 40 s within 3.3 standard errors (1.6 %), and the whole law by Kolmogorov and
    Smirnov."""
    for lengths, mean in zip(spells(10 * S), (10, 40), strict=True):
        assert np.mean(lengths) == pytest.approx(mean, rel=3.3 / math.sqrt(len(lengths)))
        assert stats.kstest(lengths, stats.expon(scale=mean).cdf).pvalue > 0.001


def test_the_twin_spells_a_tenth_longer_show():
    down, _ = spells(11 * S)
    assert abs(np.mean(down) - 10) > 3.3 * 10 / math.sqrt(len(down))
    assert stats.kstest(down, stats.expon(scale=10).cdf).pvalue < 0.001


def availability(**params):
    """The share of 40,000 frames, one every 5 s, that a link lets through."""
    bench = Bench(ImmediateNetwork(), 2, rules=[
        make("flapping", links=[["host_1", "host_2"]], **params)])
    for k in range(40_000):
        bench.send(k * 5 * S, "host_1", "host_2", 100)
    return Counter(fate for *_, fate in bench.run(200_000 * S))["arrived"] / 40_000


def test_a_link_is_available_for_its_share():
    """up / (up + down) = 0.8. The state is forgotten at 1/40 + 1/10 per s: what two frames 5 s
    apart have in common is m = exp(-5/8), which makes (1 + m) / (1 - m) of the binomial variance.
    """
    common = math.exp(-5 / 8)
    tolerance = 3.3 * math.sqrt(0.16 / 40_000 * (1 + common) / (1 - common))
    assert abs(availability(up="40 s", down="10 s") - 0.8) < tolerance
    assert abs(availability(up="40 s", down="11 s") - 0.8) > tolerance


# ------------------------------------------------------------------------------------- whose luck

CHANCE = [("latency", {"delay": "5 ms", "jitter": "2 ms"}), ("loss", {"probability": 0.3}),
          ("gilbert_elliott", {"p": 0.2, "r": 0.4}), ("duplication", {"probability": 0.3}),
          ("reordering", {"probability": 0.3, "delay": "2 ms"}),
          ("flapping", {"hosts": ["*"], "links": [["*", "*"]], "up": "1 s", "down": "100 ms"}),
          ("jamming", {"at": ["0 m", "0 m"], "radius": "9 m", "probability": 0.3})]


@pytest.mark.parametrize("name, params", CHANCE)
def test_what_others_send_moves_nothing(name, params):
    def own(others):
        places = ["b", "a", *others]
        bench = Bench(ImmediateNetwork(), dict.fromkeys(places, (0.0, 0.0)),
                      rules=[make(name, **params)])
        for k in range(300):
            for source, receiver in [("a", "b"), *pairwise(others)]:
                bench.send(k * 10 * MS, source, receiver, 100, label=k)
            if others:
                bench.send(k * 10 * MS + 1, "b", ["a", *others], 100, broadcast=True)
        return [row for row in bench.run() if row[2:4] == ("a", "b")]

    alone = own([])
    assert len({fate for *_, fate in alone} | {time_ns % MS for time_ns, *_ in alone}) > 1 \
        or name == "reordering"
    assert own(["a_0", "c", "d"]) == own(["d", "c", "a_0"]) == alone


def test_a_larger_disc_jams_what_a_small_one_does_and_more():
    def jammed(radius):
        bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (20, 0), "c": (50, 0)}, rules=[
            make("jamming", at=["-5 m", "0 m"], radius=radius, probability=0.5)])
        for k in range(300):
            bench.send(k * 20 * MS, "b", "abc"[k % 2 * 2], 100, label=k)
        return {label for label, fate in fates(bench) if fate == "jammed"}

    small, large, none = jammed("10 m"), jammed("30 m"), jammed("4.9 m")
    assert not none and small < large
    assert {label % 2 for label in small} == {0} and {label % 2 for label in large} == {0, 1}


def test_delays_are_whole_nanoseconds():
    for law in LAWS:
        for verdict in verdicts(make("latency", delay="1 ms", jitter="900 us",
                                     distribution=law), 100):
            assert type(verdict) is Deliver and type(verdict.delay_ns) is int
