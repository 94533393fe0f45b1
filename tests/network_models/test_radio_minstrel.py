"""Minstrel-HT: its numbers as Linux has them, its choices, and the radio that follows them.

Its rates against Linux's own, step by step, are a group of ``desim validate``.
"""

import numpy as np
import pytest
from configured import configured
from hypothesis import given
from hypothesis import strategies as st
from stations import LINKS

from desim.errors import InputError
from desim.netcases.case import play
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.testing import Bench, check_network
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.high_throughput import high_throughput, with_fewer_streams
from netmodels.radio.minstrel.control import MinstrelHt, MinstrelPair
from netmodels.radio.minstrel.groups import rate_table
from netmodels.radio.minstrel.of_ns3 import MinstrelHtOfNs3
from netmodels.radio.minstrel.sampling import random_columns
from netmodels.radio.minstrel.statistics import ONE, Statistics
from netmodels.radio.radio import Radio
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import A, B, G

MS = 1_000_000


def groups(name="11n", width_mhz=20, streams=2, guard_ns=None):
    shape = name, width_mhz, streams, guard_ns
    return with_fewer_streams(high_throughput(*shape, 36), *shape)


def learner(standard=None, seed=1, tries=7):
    return MinstrelHt(standard or groups(), tries, np.random.default_rng(seed))


# ----------------------------------------------------------------------------------------- numbers


def test_groups_are_those_of_linux():
    """Long guard intervals first, then by streams; 802.11ac has no MCS 9 in 20 MHz."""
    def found(*shape):
        return [(group.streams, len(group.places)) for group in rate_table(groups(*shape)).groups]

    assert found("11n", 20, 2) == [(1, 8), (2, 8)]
    assert found("11n", 40, 2, 400) == [(1, 8), (2, 8), (1, 8), (2, 8)]
    assert found("11ac", 20, 3) == [(1, 9), (2, 9), (3, 10)]
    assert found("11ac", 80, 1, 400) == [(1, 10), (1, 10)]
    assert found("11ax", 20, 1, 1600) == [(1, 12)]
    assert len(rate_table(A).groups) == len(rate_table(B).groups) == 1
    assert [len(group.places) for group in rate_table(G).groups] == [4, 8]


def test_durations_and_overheads_are_those_of_linux():
    """MCS_DURATION: 153600 bits in symbols, of 16 packets; as 16 bits keep them. The overhead is 48
    and 60 us, with an RTS 120 us more."""
    table = rate_table(groups())
    assert table.durations_ns[0] == 5908 * 4000 // 16 >> 5 << 5
    assert table.durations_ns[7] == 591 * 4000 // 16 >> 5 << 5
    assert table.durations_ns[8] == 2954 * 4000 // 16 >> 4 << 4
    short = rate_table(groups("11n", 20, 1, 400))
    assert short.durations_ns[8] == (5908 * 18_000 + 4000) // 5 // 16 >> 5 << 5
    assert (table.overhead_us, table.overhead_rts_us) == (108, 228)
    legacy = rate_table(A)
    assert (legacy.overhead_us, legacy.overhead_rts_us) == (60, 180)
    assert legacy.durations_ns[0] == 1000 * (36 + 4 * (96_342 // 240)) >> 5 << 5
    assert rate_table(B).durations_ns[3] == 1000 * (202 + 96_320 // 110) >> 8 << 8
    assert (rate_table(B).overhead_us, rate_table(B).overhead_rts_us) == (218, 654)


def test_the_first_attempts_count_as_they_are_and_later_ones_are_filtered():
    """The step response of the low pass: it overshoots."""
    known = Statistics(rate_table(groups()))
    seen = []
    for acknowledged in (0, *20 * (100,)):
        known.attempt(3, 100, acknowledged)
        known.update()
        seen.append(known.chance[3])
    assert seen[0] == 1
    assert seen[1] == (1173 * ONE + 5273 - 2350) >> 12
    assert max(seen) == ONE and seen == sorted(seen)[:len(seen)]


def test_untried_rates_are_taken_for_as_good_as_faster_ones_of_their_group():
    known = Statistics(rate_table(groups()))
    known.attempt(5, 10, 8)
    known.update()
    assert known.chance[:8] == 6 * [8 * ONE // 10] + [0, 0] and not any(known.chance[8:])


def test_chances_above_nine_tenths_count_as_that():
    known = Statistics(rate_table(groups()))
    for place, acknowledged in ((6, 100), (7, 90), (4, 9)):
        known.attempt(place, 100, acknowledged)
    known.update()
    assert known.throughput[7] > known.throughput[6] > known.throughput[5] > 0
    known = Statistics(rate_table(groups()))
    known.attempt(0, 100, 9)
    known.update()
    assert not any(known.throughput)


def test_aggregates_share_their_overhead():
    """A quarter of the new mean length counts."""
    known = Statistics(rate_table(groups()))
    known.frame(41)
    known.attempt(7, 41, 41)
    known.update()
    assert known.length == 11
    duration_ns = 108_000 // 11 + rate_table(groups()).durations_ns[7]
    assert known.throughput[7] == 100 * (ONE * 90 // 100 * 1_000_000 // duration_ns) >> 12


# ----------------------------------------------------------------------------------------- choices


def pair():
    table = rate_table(groups())
    return MinstrelPair(table, random_columns(np.random.default_rng(1), table), 7)


def played(chances, seconds=3, seed=1, attempt_ns=MS // 2, tries=7):
    """(place, acknowledged) of each attempt of a sender, by the chance of each place."""
    draws, minstrel = np.random.default_rng(seed), learner(seed=seed, tries=tries)
    places = {rate: place for place, rate in enumerate(minstrel._table.rates)}
    rate, seen = minstrel.first, []
    for now_ns in range(attempt_ns, seconds * 1000 * MS, attempt_ns):
        seen.append((places[rate], bool(draws.random() < chances[places[rate]])))
        rate = minstrel.sent(0, 1, 1, seen[-1][1], now_ns).rate
    return seen


def test_it_begins_with_the_slowest_rate_and_is_at_the_fastest_soon():
    seen = [place for place, _ in played(16 * [1.0])]
    assert seen[0] == 0
    assert {15} == set(seen[1000:])  # after half a second


def test_it_tries_other_rates_every_20_ms_and_after_an_update():
    """The latter is 10 ms after the third try at the earliest."""
    chances = [1.0] * 4 + [0.0] * 12
    seen = [place for place, _ in played(chances, 4)][2000:]
    assert 0.9 < seen.count(3) / len(seen) < 1.0
    tried = [k for k, place in enumerate(seen) if place > 3]
    assert min(np.diff(tried)) >= 20 and 35 < np.mean(np.diff(tried)) < 50


def test_a_frame_goes_on_to_surer_rates_until_it_is_answered():
    """90 % of MCS 4, 80 % of MCS 5 and 60 % of MCS 7 are worth the less in this order."""
    one = pair()
    for place, acknowledged in ((7, 6), (5, 8), (4, 10)):
        one.known.attempt(place, 10, acknowledged)
    one.status(1, 60 * MS)
    assert one.stages == [(5, 5), (4, 5), (7, 5), (5, 5)]
    for _ in range(20):  # what is tried is over
        one.sent(1, 1, 70 * MS)
    chosen = [one.sent(1, 0, 70 * MS) for _ in range(7)]
    first = groups().rates.index(next(rate for rate in groups().rates if rate.streams == 1
                                      and rate.mcs == 0))
    assert [choice.rate - first for choice in chosen] == [5, 5, 5, 5, 4, 4, 5]
    assert [choice.rts for choice in chosen] == [False] * 4 + [True] * 2 + [False]


def test_what_is_tried_goes_alone():
    one = pair()
    one.known.attempt(0, 10, 10)
    one.status(1, 60 * MS)
    found = [one.sent(1, acknowledged, 60 * MS) for acknowledged in (1, 0, 1)]
    assert [(choice.alone, choice.rts) for choice in found] == [
        (True, False), (False, True), (False, False)]


def test_of_a_slow_rate_three_tries_fit_into_six_ms():
    one = pair()
    one.known.attempt(0, 10, 10)
    one.status(1, 60 * MS)
    assert one.stages[0] == (0, 3)


def test_dead_streams_are_left_at_once():
    """More than thirty packets since the update, less than a quarter of them acknowledged."""
    one = pair()
    one.known.attempt(15, 10, 10)
    one.known.attempt(7, 10, 10)
    one.status(1, 60 * MS)
    assert one.stages[0][0] == 15
    for lost, fastest in ((30, 15), (1, 7)):
        one.known.attempt(15, lost, 0)
        one.status(1, 61 * MS)
        assert one.stages[0][0] == fastest


@given(st.lists(st.tuples(st.integers(1, 64), st.integers(0, 64), st.integers(1, 30)),
                max_size=150), st.sampled_from(["11n", "11ac", "11ax", "a", "b", "g"]))
def test_it_chooses_among_the_rates_of_the_standard(attempts, name):
    """At any outcomes, and twice the same."""
    standard = {"a": A, "b": B, "g": G}.get(name) or groups(name)
    one, other, now_ns = learner(standard), learner(standard), 0
    for packets, acknowledged, ms in attempts:
        now_ns += ms * MS
        given_ = 0, 1, packets, min(packets, acknowledged), now_ns
        rate = one.sent(*given_)
        assert rate.rate in one._table.rates and rate == other.sent(*given_)


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 2)), max_size=200))
def test_receivers_have_nothing_to_do_with_each_other(outcomes):
    together, last = learner(), {}
    for k, (acknowledged, receiver) in enumerate(outcomes):
        last[receiver] = together.sent(9, receiver, 1, acknowledged, k * 7 * MS)
    for receiver, rate in last.items():
        alone, found = learner(), None
        for k, (acknowledged, who) in enumerate(outcomes):
            if who == receiver:
                found = alone.sent(9, receiver, 1, acknowledged, k * 7 * MS)
        assert rate == found


def ns3_pair():
    table = rate_table(groups("11n", 20, 1))
    return MinstrelHtOfNs3(groups("11n", 20, 1), 7, np.random.default_rng(1)), table.rates[0]


def test_ns3_counts_a_lost_aggregate_as_one_packet_and_twice_at_the_rate_that_follows():
    """As its own table of statistics says: of MCS 7, tried with 41 packets, one attempt was lost,
    of MCS 2, which followed, 82."""
    minstrel, first = ns3_pair()
    pair = minstrel._pair(0, 1)
    pair._place, pair._fastest, pair._second, pair._surest = 7, 4, 2, 4
    pair._repeats, pair._trying = {4: 2, 2: 2}, True
    assert minstrel.sent(0, 1, 41, 0, MS).rate - first == 4  # the surest
    assert (pair._attempts[7], pair._attempts[2]) == (1, 82)


def test_ns3_tries_one_rate_in_sixteen_exchanges_and_two_for_each_packet():
    minstrel, _ = ns3_pair()
    rates = [minstrel.sent(0, 1, 1, 1, k * MS).rate for k in range(1, 2000)]
    fastest = max(set(rates), key=rates.count)
    tried = [k for k, rate in enumerate(rates) if k > 500 and rate != fastest]
    assert min(np.diff(tried), default=18) >= 18


def test_ns3_has_other_stations_without_mcs():
    with pytest.raises(InputError, match=(
            r"\.rate_control\.model: minstrel_ht_ns3 is of 11n, 11ac, 11ax; allowed for others: "
            r"arf, arf_ns3, aarf, aarf_ns3, ideal, minstrel_ht")):
        DcfRadio(DcfRadio.Params(standard="11g", rate_control={"model": "minstrel_ht_ns3"}))


def test_it_has_no_constants_of_fallback():
    with pytest.raises(InputError, match=r"\.constants\.up_after: minstrel_ht has none; allowed "
                                         r"with arf, arf_ns3, aarf, aarf_ns3"):
        configured(RateControl, model="minstrel_ht", up_after=9)


# -------------------------------------------------------------------------------------- on the air


def goodput_mbps(distance_m, seconds=3, **params):
    radio = DcfRadio(DcfRadio.Params(**{"walls": None, "standard": "11n", "channel": 36, **params}))
    return play(Setup(radio, {"a": (0, 0), "b": (distance_m, 0)},
                      [Flow("a", ("b",), 1518, 1472, backlog=128)],
                      (1 + seconds) * 10**9, 10**9))["goodput_mbps"]


MINSTREL = {"rate_control": {"model": "minstrel_ht"}}


@pytest.mark.parametrize(("distance_m", "share"), [(10, 0.99), (35, 0.9)])
def test_it_comes_near_to_the_best_rate(distance_m, share):
    best = max(goodput_mbps(distance_m, 1, mcs=mcs) for mcs in range(8))
    assert share < goodput_mbps(distance_m, **MINSTREL) / best < 1.01


def test_two_streams_carry_more_than_one():
    one, two = (goodput_mbps(10, streams=streams, **MINSTREL) for streams in (1, 2))
    assert 1.6 < two / one < 2


@pytest.mark.parametrize("standard", ["11a", "11b", "11g"])
def test_stations_without_mcs_learn_as_well(standard):
    best = {"11a": 54, "11b": 11, "11g": 54}[standard]
    where = {"standard": standard, "channel": 36 if standard == "11a" else 1}
    fixed = goodput_mbps(10, rate=f"{best} Mb/s", **where)
    rate = {"11b": "11 Mb/s"}.get(standard, "54 Mb/s")
    assert 0.97 < goodput_mbps(10, rate=rate, **where, **MINSTREL) / fixed < 1.01


@pytest.mark.parametrize("params", [
    {"standard": "11n"}, {"standard": "11ax", "channel": 36, "streams": 2}, {"standard": "11g"},
    {"standard": "11n", "rate_control": {"model": "minstrel_ht_ns3"}},
    {"standard": "11ac", "channel": 36, "width": "80 MHz", "guard_interval": "400 ns"}])
def test_it_keeps_the_contract(params):
    check_network(Radio, **{**MINSTREL, **params})


def test_ten_stations_stay_at_fast_rates():
    """Collisions are errors to it, but not for long, as they are to fallback."""
    def of_ten(**params):
        radio = DcfRadio(DcfRadio.Params(
            standard="11n", channel=36, path_loss={"model": "fixed", "total": "66 dB"}, **params))
        senders = {f"s{k}": NOWHERE for k in range(10)}
        return play(Setup(radio, senders | {"sink": NOWHERE}, [
            Flow(name, ("sink",), 1046, 1000, backlog=128) for name in senders],
            4 * 10**9, 10**9))["goodput_mbps"]

    best = of_ten(mcs=7)
    assert 0.75 < of_ten(**MINSTREL) / best < 1
    assert of_ten(rate_control={}) / best < 0.4


def test_coverage_needs_no_learner():
    radio = DcfRadio(DcfRadio.Params(standard="11n", channel=36, **LINKS, **MINSTREL))
    Bench(radio, {"a": (0, 0)})
    assert radio.signal(np.zeros(2), np.array([[5.0, 0.0]])).delivery.tolist() == [1.0]
