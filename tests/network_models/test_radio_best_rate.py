"""The best rate by the signal: what each needs, when it changes, and the radio that follows it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.netcases.case import play
from desim.ports.cases import Flow, Setup
from desim.testing import check_network
from netmodels.radio import best_rate
from netmodels.radio.best_rate import BestRate, least_ratio
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.errors import bit_error
from netmodels.radio.high_throughput import high_throughput, with_fewer_streams
from netmodels.radio.radio import Radio
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import STANDARDS, A

BIT_ERRORS, TRIES = 1e-6, 7
IDEAL = {"model": "ideal"}


def ratio(db):
    return 10 ** (db / 10)


def of_11a(heard):
    """For a receiver that hears ``heard[0]`` dB."""
    return BestRate(A, range(8), TRIES, BIT_ERRORS, lambda *_: ratio(heard[0]))


@pytest.mark.parametrize("rate", [*A.rates, *STANDARDS["11b"].rates,
                                  *high_throughput("11ax", 20, 1, None, 36).rates[8:]])
def test_at_the_least_ratio_so_many_bits_are_wrong(rate):
    least = least_ratio(rate.scheme, BIT_ERRORS)
    assert bit_error(rate.scheme, 1.001 * least) < BIT_ERRORS < bit_error(rate.scheme, least / 1.01)


def test_bpsk_with_half_the_bits_needs_what_the_bound_says():
    """Of 36 D^10 / 2 with D = sqrt(4 p (1 - p)), the first term of the bound, 1e-6 is left at p =
    erfc(sqrt(r)) / 2 = 0.0089: r = 2.81, 4.49 dB. The terms behind it add a little."""
    assert 4.49 < 10 * np.log10(least_ratio(A.rates[0].scheme, BIT_ERRORS)) < 4.6


def test_it_begins_slowly_and_goes_at_once_to_the_fastest_that_the_signal_allows():
    """From 24 to 54 Mb/s they need 14.1, 17.3, 22.0 and 23.3 dB."""
    needs_db = [10 * np.log10(least_ratio(rate.scheme, BIT_ERRORS)) for rate in A.rates]
    assert needs_db[4:] == pytest.approx([14.14, 17.26, 22.01, 23.30], abs=0.01)
    heard = [needs_db[6] + 0.1]
    control = of_11a(heard)
    assert control.first == 0
    assert control.sent(0, 1, 1, 1, 0).rate == 6
    heard[0] = needs_db[4] + 0.1
    assert control.sent(0, 1, 1, 0, 0).rate == 6  # nobody has told the sender
    assert control.sent(0, 1, 1, 1, 0).rate == 4
    heard[0] = needs_db[7] + 0.1
    assert control.sent(0, 1, 1, 1, 0).rate == 7


def test_after_seven_failures_in_a_row_it_begins_anew():
    control = of_11a([30.0])
    control.sent(0, 1, 1, 1, 0)
    assert [control.sent(0, 1, 1, 0, 0).rate for _ in range(8)] == 6 * [7] + [0, 0]
    assert control.sent(0, 1, 1, 1, 0).rate == 7
    assert control.sent(0, 2, 1, 0, 0).rate == 0  # another receiver


@given(st.floats(-30, 60), st.floats(0, 10))
def test_a_better_signal_is_never_slower(db, more_db):
    control = of_11a([0.0])
    assert A.rates[control.best(ratio(db))].mbps <= A.rates[control.best(ratio(db + more_db))].mbps


def test_it_chooses_among_streams_by_the_rate_alone():
    """Each stream has the signal of the link, so that two are always better than one."""
    shape = "11n", 20, 2, None
    standard = with_fewer_streams(high_throughput(*shape, 36), *shape)
    control = RateControl(**IDEAL).of(standard, 8, TRIES, np.random.default_rng,
                                      lambda *_: ratio(15.0))
    best = standard.rates[control.sent(0, 1, 64, 64, 0).rate]
    assert best.streams == 2 and best.mcs == 3
    assert standard.rates[control.first].mbps == 6.5


def goodput_mbps(distance_m, seconds=1, **params):
    radio = DcfRadio(DcfRadio.Params(**{"walls": None, **params}))
    return play(Setup(radio, {"a": (0, 0), "b": (distance_m, 0)},
                      [Flow("a", ("b",), 1518, 1472, backlog=128)],
                      (1 + seconds) * 10**9, 10**9))["goodput_mbps"]


@pytest.mark.parametrize(("params", "best_of"), [
    ({"standard": "11a"}, [{"rate": f"{rate.mbps} Mb/s"} for rate in A.rates]),
    ({"standard": "11ac", "channel": 36, "streams": 2}, [{"mcs": mcs} for mcs in range(9)])])
def test_it_is_at_most_one_rate_below_the_best(params, best_of):
    """A packet of 1536 B with 1e-6 of wrong bits arrives at 0.988; the next rate, up to half as
    much again, may carry more though it loses some."""
    for distance_m in 30, 60:
        every = sorted(goodput_mbps(distance_m, **params, **one) for one in best_of)
        found = goodput_mbps(distance_m, **params, rate_control=IDEAL)
        assert every[-1] / 1.5 < found < 1.01 * every[-1]


def test_collisions_do_not_slow_it_down():
    """Of ten saturated stations; ARF falls to a fifth."""
    def of_ten(**params):
        hosts = [f"h{k}" for k in range(10)]
        radio = DcfRadio(DcfRadio.Params(standard="11a", path_loss={
            "model": "fixed", "total": "66 dB"}, **params))
        return play(Setup(radio, dict.fromkeys([*hosts, "sink"], (0, 0)), [
            Flow(host, ("sink",), 1046, 1000) for host in hosts], 2 * 10**9))["goodput_mbps"]

    fixed = of_ten(rate="54 Mb/s")
    assert of_ten(rate_control=IDEAL) == pytest.approx(fixed, rel=0.05)
    assert of_ten(rate_control={"model": "aarf"}) < 0.4 * fixed


@pytest.mark.parametrize("params", [{}, {"standard": "11ax", "streams": 2},
                                    {"fading": {"speed": "0.02 m/s"}, "standard": "11g"}])
def test_it_keeps_the_contract(params):
    check_network(Radio, rate_control=IDEAL, **params)


def test_a_signal_out_of_reach_has_no_ratio():
    assert best_rate.BestRate(A, range(8), TRIES, BIT_ERRORS, lambda *_: 0.0).best(0.0) == 0
