"""Automatic rate fallback, and its adaptive form: rules one by one, and the radio that follows.

Also how near it comes to the best rate. Its goodput against the Markov chain is a group of ``desim
validate``.
"""

from collections import Counter

import numpy as np
import pytest
from configured import configured
from hypothesis import given
from hypothesis import strategies as st
from stations import LINKS
from test_netmodels_radio import fates

from desim.errors import InputError
from desim.netcases.case import play
from desim.ports.cases import Flow, Setup
from desim.testing import Bench, check_network
from netmodels.multihop import Multihop
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import TRIED, Reception, Stations
from netmodels.radio.errors import error_table
from netmodels.radio.radio import Radio
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import ACK_BYTES, CTS_BYTES, RTS_BYTES, A, B, G
from netmodels.validation import rate_control

RATES = [4, 5, 6, 7]
MS = 1_000_000


def played(outcomes, first=5, **params):
    """The rate after each of so many acknowledgements (+) or failures (-)."""
    arf = configured(RateControl, **params).fallback(RATES, first)
    return [(arf.acknowledged if outcome == "+" else arf.failed)(0, 1) for outcome in outcomes]


# ------------------------------------------------------------------------------------------- rules


def test_ten_acknowledgements_in_a_row_raise_the_rate():
    assert played(9 * "+" + "++") == 9 * [5] + [6, 6]
    assert played(9 * "+" + "++", up_after=9) == 8 * [5] + [6, 6, 6]
    assert played(40 * "+")[-1] == 7


def test_two_failures_in_a_row_lower_it_and_one_does_not():
    assert played("-+-+--") == [5, 5, 5, 5, 5, 4]
    assert played("----") == [5, 4, 4, 4]
    assert played("---", down_after=3) == [5, 5, 4]


def test_a_probe_that_fails_lowers_it_at_once():
    assert played(10 * "+" + "-" + "-") == 9 * [5] + [6, 5, 5]
    assert played(10 * "+" + "+" + "-" + "-") == 9 * [5] + [6, 6, 6, 5]


def test_after_fifteen_attempts_the_faster_rate_is_tried_in_any_case():
    """With a failure now and then there are never ten in a row."""
    assert played(4 * "+++-") == 14 * [5] + [6, 5]
    assert played(3 * "+++-" + "+++", timer=16) == 15 * [5]


# What became of the attempts of one of five saturated senders in ns-3 3.44 (802.11a, every pair at
# -50 dBm), and at which rate each was, from the slowest on.
TRACED = ("-++-+-+++++-++++++-+++++--++++++++-+-++++-++++++--+++---++-++-++-+-++++++++"
          "++++++++++++-+++++++++-+++-+++-+-+--++++++---+++++--+-++++++--++---+--+++++",
          "000000000000000111111111110000000000000001000000000000000000000000000001111"
          "111111222222222222222333333333333333222222221111111100000000000000000000000")


# The same with its AARF, of one of three.
TRACED_AARF = ("+++++-+-++++++++++++++++-++++-+-+++++++++++++++++--++++-++-+++++++++++++-+-"
               "++++++++++++++++-++++-++-++++++++++++++++++++++-+++++-+++++++-+++-++++-+-++",
               "000000000000000111111111111111111111111111222222222111111111111111222222222"
               "222222333333333343333333333333333333333333333444444444444444444444444444444")


@pytest.mark.parametrize(("model", "same", "traced"), [
    ("arf_ns3", True, TRACED), ("arf", False, TRACED), ("aarf_ns3", True, TRACED_AARF),
    ("aarf", False, TRACED_AARF), ("arf_ns3", False, TRACED_AARF)])
def test_rates_of_one_among_several_are_those_of_ns3(model, same, traced):
    outcomes, rates = traced
    arf = RateControl(model=model).fallback(range(8), 0)
    found = [0] + [(arf.acknowledged if outcome == "+" else arf.failed)(0, 1)
                   for outcome in outcomes]
    assert (found[:-1] == [int(rate) for rate in rates]) == same


def test_ns3_goes_on_at_the_rate_that_it_fell_back_to_until_something_gets_through():
    assert played(10 * "+" + 5 * "-", model="arf_ns3") == 9 * [5] + [6] + 5 * [5]
    assert played(10 * "+" + 5 * "-") == 9 * [5] + [6, 5, 5, 4, 4, 4]
    assert played(10 * "+" + 5 * "-" + "+--", model="arf_ns3")[-1] == 4


@pytest.mark.parametrize(("model", "tried"), [("arf", 6), ("arf_ns3", 5)])
def test_the_timer_of_ns3_is_of_no_use_if_its_last_attempt_fails(model, tried):
    assert played(5 * "++-" + "+", model=model) == 15 * [5] + [tried]
    assert played(5 * "++-" + "+", model=model, timer=16)[-1] == 6


@pytest.mark.parametrize(("model", "last"), [("arf", [4, 5, 5]), ("arf_ns3", [4, 4, 5])])
def test_each_failure_but_the_first_in_a_row_sets_the_timer_of_ns3_anew(model, last):
    assert played("---" + 3 * "+++-" + "+++", model=model)[-3:] == last


FAILED_PROBE = "+-"  # behind the acknowledgements that let it be tried


@pytest.mark.parametrize(("model", "most"), [("aarf", 50), ("aarf_ns3", 60)])
def test_a_failed_probe_doubles_what_the_next_one_takes_up_to_a_most(model, most):
    """10, 20, 40 acknowledgements in a row, then 50 (Lacage et al.) or 60 (ns-3), each time."""
    outcomes, rates = "", []
    for up_after in 10, 20, 40, most, most:
        outcomes += (up_after - 1) * "+" + FAILED_PROBE
        rates += (up_after - 1) * [5] + [6, 5]
    assert played(outcomes, model=model) == rates
    assert played(outcomes, model=model.replace("aarf", "arf")) != rates  # the twin


@pytest.mark.parametrize("model", ["aarf", "aarf_ns3"])
def test_two_failures_in_a_row_let_the_threshold_start_anew(model):
    threshold_20 = 9 * "+" + FAILED_PROBE
    assert played(threshold_20 + "+--" + 10 * "+", model=model)[-2:] == [4, 5]
    assert played(threshold_20 + "-+" + 11 * "+", model=model)[-1] == 5


@pytest.mark.parametrize("model", ["aarf", "aarf_ns3"])
def test_a_failed_probe_doubles_the_timer_too(model):
    """With a failure now and then it is the timer that tries."""
    probe = 7 * "+-" + "+"
    assert played(probe + "-" + probe, model=model)[-1] == 5
    assert played(probe + "-" + probe, model=model.replace("aarf", "arf"))[-1] == 6  # the twin
    assert played(probe + "-" + 15 * "+-", model=model).count(6) == 1
    assert played(probe + "-" + 14 * "+-" + "++", model=model)[-1] == 6


def test_the_most_can_be_another():
    outcomes = 9 * "+" + FAILED_PROBE + 12 * "+"
    assert played(outcomes, model="aarf", most_up_after=12)[-1] == 6
    assert played(outcomes, model="aarf")[-1] == 5


@pytest.mark.parametrize(("model", "key", "value", "models"), [
    ("arf", "most_up_after", 50, "aarf, aarf_ns3"), ("aarf", "bit_errors", 1e-3, "ideal"),
    ("ideal", "up_after", 9, "arf, arf_ns3, aarf, aarf_ns3")])
def test_constants_of_another_rate_control_are_refused(model, key, value, models):
    with pytest.raises(InputError, match=rf"\.constants\.{key}: {model} has none; "
                                         rf"allowed with {models}$"):
        configured(RateControl, model=model, **{key: value})


def test_the_preset_counts_as_ns3():
    def model(**params):
        return DcfRadio.Params(**params).rate_control.model

    assert model(rate_control={}) == "arf"
    assert model(rate_control={}, preset="ns3_3_44") == "arf_ns3"
    assert model(rate_control={"model": "arf"}, preset="ns3_3_44") == "arf"


@given(st.text("+-", max_size=300), st.sampled_from(["arf", "arf_ns3", "aarf", "aarf_ns3"]))
def test_it_goes_step_by_step_and_knows_its_ends(outcomes, model):
    rates = [5, *played(outcomes, model=model)]
    assert set(rates) <= set(RATES) and abs(np.diff(rates)).max(initial=0) <= 1
    for before, after, outcome in zip(rates, rates[1:], outcomes, strict=False):
        assert after == before or (after > before) == (outcome == "+")


@given(st.lists(st.tuples(st.sampled_from("+-"), st.integers(0, 2)), max_size=200))
def test_receivers_have_nothing_to_do_with_each_other(outcomes):
    arf, last = RateControl().fallback(RATES, 5), {}
    for outcome, receiver in outcomes:
        last[receiver] = (arf.acknowledged if outcome == "+" else arf.failed)(9, receiver)
    for receiver, rate in last.items():
        assert rate == played("".join(what for what, who in outcomes if who == receiver))[-1]


# ----------------------------------------------------------------------------------- on the radio


@pytest.mark.parametrize("standard", [A, B, G], ids=["a", "b", "g"])
def test_the_kernels_know_the_times_of_the_standard(standard):
    stations = Stations(standard, np.zeros(2, np.uint64), error_table((6,)), Reception())
    times = ("air_ns", "last_ns", "rate", "ack_ns", "ack_rate", "rts_ns", "rts_rate")
    for rate in range(len(standard.rates)):
        reply, lowest = standard.reply_rate(rate), standard.lowest(rate)
        for size_bytes in (*range(14, 80), 1063, 1064, 1536, 2304):
            position = stations.enqueue(0, 0, 1, size_bytes, rate, last_bytes=29, rts=True)
            found = stations._arrays.states[0].frames[0, position]
            assert [int(found[name]) for name in times] == [
                standard.airtime_ns(size_bytes, rate), standard.airtime_ns(29, rate), rate,
                standard.airtime_ns(ACK_BYTES, reply), reply,
                standard.airtime_ns(RTS_BYTES, lowest), lowest]
            how = stations._arrays.states[0].rates[rate]
            assert how["cts_ns"] == standard.airtime_ns(CTS_BYTES, lowest)
        stations = Stations(standard, np.zeros(2, np.uint64), error_table((6,)), Reception())


def radio(**params):
    return DcfRadio(DcfRadio.Params(**{"standard": "11a", "rate_control": {}, **params}))


def attempts(distance_m, **params):
    """Of each attempt to send 400 packets whether it was acknowledged, and its rate in Mb/s."""
    model, seen = radio(**params), []
    air = Bench(model, {"a": (0, 0), "b": (distance_m, 0)})
    outcomes = model._air.stations.outcomes

    def watched():
        found = outcomes()
        seen.extend((packet > 0, A.rates[model._air.stations._arrays.states[0].choices[0, 1]].mbps)
                    for _, what, _, _, _, packet in found if what == TRIED)
        return found

    model._air.stations.outcomes = watched
    for _ in range(400):
        air.send(0, "a", "b", 1518)
    air.run()
    return seen


def test_the_kernels_report_attempts_only_where_rates_adapt():
    adapting = [what for what, _ in attempts(30)]
    assert adapting.count(True) == 400 and adapting.count(False) > 30
    assert attempts(30, rate_control=None, rate="36 Mb/s") == []


def test_each_receiver_gets_its_own_rate():
    """At 42 m 24 Mb/s get through and 36 Mb/s do not: they are tried and lost, and may be what is
    chosen at any moment."""
    model = radio()
    air = Bench(model, {"far": (42, 0), "near": (5, 0), "sender": (0, 0)})
    for k in range(400):
        air.send(k * 5 * MS, "sender", ("far", "near")[k % 2], 1518)
    assert all(fate == "arrived" for _, fate in fates(air.run()))
    choices = model._air.stations._arrays.states[0].choices
    far, near = (A.rates[rate].mbps for rate in choices[2, :2])
    assert far in (24, 36) and near == 54


def test_broadcasts_go_as_fast_as_they_did():
    air = Bench(radio(broadcast_rate="6 Mb/s"), {"a": (0, 0), "b": (10, 0)})
    air.send(0, "a", ["b"], 1046, broadcast=True)
    (time_ns, *_), = air.run()
    assert time_ns == A.airtime_ns(1064, A.rate(6))


def goodput_mbps(distance_m, **params):
    return play(Setup(radio(walls=None, **params), {"a": (0, 0), "b": (distance_m, 0)},
                      [Flow("a", ("b",), 1518, 1472)], 3 * 10**9))["goodput_mbps"]


@pytest.mark.parametrize(("distance_m", "best_mbps", "share"), [
    (10, 54, 0.98), (24, 48, 0.83), (50, 18, 0.88), *(
        pytest.param(*place, marks=pytest.mark.validation)  # between these
        for place in ((20, 54, 0.98), (30, 36, 0.88), (38, 24, 0.86)))])
def test_it_comes_near_to_the_best_rate_from_either_end(distance_m, best_mbps, share):
    """Of eleven attempts one is a probe of the next faster rate."""
    fixed = {rate.mbps: goodput_mbps(distance_m, rate_control=None, rate=f"{rate.mbps} Mb/s")
             for rate in A.rates}
    assert max(fixed, key=fixed.get) == best_mbps
    for first in "6 Mb/s", "54 Mb/s":
        assert share < goodput_mbps(distance_m, rate=first) / fixed[best_mbps] < 1.01
        acknowledged = Counter(mbps for got, mbps in attempts(distance_m, rate=first) if got)
        assert acknowledged.most_common(1)[0][0] == best_mbps


def test_the_chain_knows_what_happens_at_its_ends():
    """With no errors the fastest rate, with nothing right above 6 Mb/s at best a tenth less."""
    fastest = rate_control.stationary_mbps(A, np.zeros(8))
    assert fastest == pytest.approx(goodput_mbps(5), rel=0.005)
    slow = rate_control.stationary_mbps(A, np.array([0.0] + 7 * [1.0]))
    alone = 8e3 * 1472 / (A.difs_ns + 7.5 * A.slot_ns + A.airtime_ns(1536, 0) + A.sifs_ns
                          + A.airtime_ns(ACK_BYTES, 0))
    assert 0.85 * alone < slow < alone


@pytest.mark.parametrize("params", [{}, {"rts": "500 B", "constants": {"lifetime": "5 ms"},
                                         "queue": 3},
                                    {"standard": "11b", "rate": "11 Mb/s"},
                                    {"fading": {"speed": "0.02 m/s"}, "standard": "11g"}])
def test_it_keeps_the_contract(params):
    check_network(Radio, rate_control={}, **params)


def test_routes_over_radios_that_adapt_keep_it_too():
    check_network(Multihop, hop="radio", routing="static", radio={
        "rate_control": {}, "fading": {"speed": "0.02 m/s"}})


def test_coverage_is_that_of_the_slowest_rate():
    """6 Mb/s get farther than 54 Mb/s."""
    model = radio(**LINKS)
    Bench(model, {"a": (0, 0)})
    assert model.signal(np.zeros(2), np.array([[40.0, 0.0], [52.0, 0.0]])).delivery.tolist() == (
        pytest.approx([1.0, 0.0]))
