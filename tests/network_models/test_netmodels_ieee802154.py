"""``ieee802154``: the standard's times, a published throughput, and exact chances of CSMA-CA."""

import math
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError
from desim.scenario.load import load
from desim.testing import Bench, check_network
from netmodels.ieee802154 import Ieee802154
from netmodels.ieee802154_frames import (
    ACK_NS,
    CCA_NS,
    HEADERS_BYTES,
    MAC_BYTES,
    MOST_BYTES,
    MOST_PSDU_BYTES,
    TURNAROUND_NS,
    UNIT_NS,
    frame_ns,
    psdus,
    space_ns,
)

MS, S = 10**6, 10**9
FULL = HEADERS_BYTES + 107  # the longest packet in one frame: 127 B with 9 B and 11 B of headers
FULL_NS = frame_ns(127)
ACCESS_NS = CCA_NS + TURNAROUND_NS
REPLY_NS = TURNAROUND_NS + ACK_NS


def bench_of(places=4, **params):
    if isinstance(places, int):
        places = {f"host_{number}": (0.0, 0.0) for number in range(1, places + 1)}
    return Bench(Ieee802154(Ieee802154.Params(**params)), places)


class Hidden:
    """Two senders 40 m apart and their receiver between them."""

    places = {"a": (0, 0), "b": (20, 0), "c": (40, 0)}
    params = {"range": "25 m", "interference": "30 m", "retries": 0}


@pytest.mark.parametrize("params", [{}, {"range": "10 m", "retries": 0, "queue": 1000},
                                    {"min_be": 0, "backoffs": 0}])
def test_it_keeps_the_contract(params):
    check_network(Ieee802154, **params)


# ------------------------------------------------------------------------------------- frames


def test_times_are_those_of_the_standard():
    """62.5 ksymbol/s and two symbols a byte: an acknowledgement of 11 B has 22 symbols, the longest
    frame 266; backoff units have 20, assessments 8, turnarounds 12, LIFS 40, SIFS 12."""
    symbol_ns = 16_000
    assert (ACK_NS, FULL_NS) == (22 * symbol_ns, 266 * symbol_ns) == (352_000, 4_256_000)
    assert [one / symbol_ns for one in (UNIT_NS, CCA_NS, TURNAROUND_NS)] == [20, 8, 12]
    assert (space_ns(19), space_ns(18)) == (40 * symbol_ns, 12 * symbol_ns)


@given(st.integers(0, MOST_BYTES))
def test_fragments_carry_the_packet(size_bytes):
    """RFC 4944: 4 B before the first fragment, 5 B before the others; all but the last one carry a
    multiple of 8 B (48 B of IPv6 and UDP, which are 9 B in the first frame, are one)."""
    sizes = psdus(size_bytes)
    assert max(sizes) <= MOST_PSDU_BYTES
    data_bytes, each = max(size_bytes - HEADERS_BYTES, 0), MAC_BYTES + 9
    if len(sizes) == 1:
        assert sizes == [each + data_bytes]
    else:
        carried = [sizes[0] - each - 4, *(size - MAC_BYTES - 5 for size in sizes[1:])]
        assert sum(carried) == data_bytes and min(carried) > 0
        assert all(one % 8 == 0 for one in carried[:-1])
        assert each + data_bytes > MOST_PSDU_BYTES


def test_the_longest_packet_of_ethernet_has_fifteen_fragments():
    """1472 B of data: 96 B in the first one, 104 B in each other one."""
    assert psdus(1518) == [120] * 14 + [11 + 5 + 1472 - 96 - 13 * 104]
    assert psdus(FULL) == [127] and len(psdus(FULL + 1)) == 2


# ------------------------------------------------------------------------------ one sender


def arrivals_of_one_sender(frames, **params):
    bench = bench_of(2, queue=10_000, **params)
    for label in range(frames):
        bench.send(0, "host_1", "host_2", FULL, label=label)
    log = bench.run()
    assert [row[1:] for row in log] == [(k, "host_1", "host_2", "arrived") for k in range(frames)]
    return [row[0] for row in log]


def test_a_saturated_sender_needs_what_the_formula_says():
    """From frame to frame it takes the acknowledgement, the space, the backoff, the assessment, the
    turnaround and the frame: all exact but the backoff, 0 to 7 whole units, 3.5 in the mean within
    3 standard errors."""
    at_ns = arrivals_of_one_sender(5000)
    rest_ns = REPLY_NS + space_ns(127) + ACCESS_NS + FULL_NS
    units = [(later_ns - ns - rest_ns) / UNIT_NS for ns, later_ns in pairwise(at_ns)]
    assert set(units) == set(range(8))
    assert abs(np.mean(units) - 3.5) <= 3 * math.sqrt(63 / 12 / len(units))


def test_its_throughput_is_the_published_one():
    """Latre et al. 2006 (Throughput and delay analysis of unslotted IEEE 802.15.4): 64.9 % of 250
    kb/s at most, without addresses (122 B a frame) and acknowledgements. They count backoff, frame
    and space alone, no assessment and turnaround, which we have on top."""
    at_ns = arrivals_of_one_sender(5000)
    cycle_ns = (at_ns[-1] - at_ns[0]) / 4999 - ACCESS_NS - REPLY_NS
    assert 122 * 8 / cycle_ns / 250e-6 == pytest.approx(0.649, abs=0.002)


def test_a_twin_with_a_longer_backoff_would_be_seen(monkeypatch):
    monkeypatch.setattr("netmodels.ieee802154.UNIT_NS", UNIT_NS + 20_000)
    for test in (test_a_saturated_sender_needs_what_the_formula_says,
                 test_its_throughput_is_the_published_one):
        with pytest.raises(AssertionError):
            test()


def test_fragments_follow_each_other_and_are_acknowledged_one_by_one():
    bench = bench_of(2, min_be=0, max_be=3)
    bench.send(0, "host_1", "host_2", FULL + 1, label="two frames")
    (row,) = bench.run()
    first, second = psdus(FULL + 1)
    assert row[0] == (ACCESS_NS + frame_ns(first) + REPLY_NS + space_ns(first) + ACCESS_NS
                      + frame_ns(second))


# ------------------------------------------------------------------------------ many senders


TRIALS = 4000


def first_alone(senders, **params):
    """The share of trials in which the first frame of so many senders, who begin at once, arrives:
    of all that end first."""
    bench = bench_of(senders + 1, **params)
    for trial in range(TRIALS):
        for sender in range(senders):
            bench.send(trial * S, f"host_{sender + 2}", ["host_1"], FULL, label=trial,
                       broadcast=True)
    ended, fates = {}, {}
    for time_ns, trial, *_, fate in bench.run(10**16):
        if ended.setdefault(trial, time_ns) == time_ns and fate != "channel_busy":
            fates.setdefault(trial, fate)
    return sum(fate == "arrived" for fate in fates.values()) / TRIALS


def assert_first_alone(senders):
    """The least of n draws of 0 to 7 is there once with the chance sum over k of n / 8 ((7 - k) /
    8)^(n - 1); one who draws a unit more finds the channel busy already."""
    chance = sum(senders / 8 * ((7 - k) / 8) ** (senders - 1) for k in range(8))
    error = math.sqrt(chance * (1 - chance) / TRIALS)
    assert abs(first_alone(senders) - chance) <= 3 * error


@pytest.mark.parametrize("senders", [2, 3, 5, 10])
def test_the_first_frame_is_alone_as_often_as_the_least_draw(senders):
    assert_first_alone(senders)


def test_a_twin_that_does_not_listen_would_be_seen(monkeypatch):
    heard = Ieee802154._has_heard
    monkeypatch.setattr(Ieee802154, "_has_heard", lambda self, host: heard(self, host) and False)
    with pytest.raises(AssertionError):
        assert_first_alone(3)


def chance_of_two(exponents):
    """Of two senders that begin at once: the chance of a collision, and that one gives up, with
    backoffs of these exponents. Its last assessment begins d units and a few assessments behind the
    other one's; that one's frame begins 320 us behind its own and lasts 4256 us."""
    over_ns = UNIT_NS + FULL_NS
    draws = 2 ** exponents[0]
    behind = {d: 2 * (draws - d) / draws**2 for d in range(1, draws)}
    for tries, exponent in enumerate(exponents[1:], 1):
        later = {}
        for (d, chance), k in product(behind.items(), range(2 ** exponent)):
            if (d + k) * UNIT_NS + tries * CCA_NS < over_ns:  # busy again
                later[d + k] = later.get(d + k, 0.0) + chance / 2 ** exponent
        behind = later
    return 1 / draws, sum(behind.values())


@pytest.mark.parametrize(("params", "exponents"), [
    ({"backoffs": 0}, [3]), ({"backoffs": 1}, [3, 4]), ({"backoffs": 2}, [3, 4, 5]),
    ({"backoffs": 3, "max_be": 3}, [3, 3, 3, 3]), ({"min_be": 2, "max_be": 3}, [2, 3, 3, 3, 3])])
def test_two_senders_collide_and_give_up_as_often_as_enumerated(params, exponents):
    bench = bench_of(3, **params)
    for trial in range(TRIALS):
        for sender in (1, 2):
            bench.send(trial * S, f"host_{sender}", ["host_3"], FULL, label=trial, broadcast=True)
    fates = [fate for *_, fate in bench.run(10**16)]
    collided, gave_up = chance_of_two(exponents)
    for found, chance in ((fates.count("collision") / 2, collided),
                          (fates.count("channel_busy"), gave_up)):
        error = math.sqrt(chance * (1 - chance) / TRIALS)
        assert abs(found / TRIALS - chance) <= 3 * error


# ------------------------------------------------------------------------------ air


@pytest.mark.parametrize(("c_m", "least", "most"), [(40, 0, 0), (29, 150, 199)])
def test_hidden_senders_collide_always_and_others_seldom(c_m, least, most):
    """The seven units between two backoffs are shorter than a frame of 13.3."""
    bench = bench_of({**Hidden.places, "c": (c_m, 0)}, **Hidden.params)
    for trial in range(100):
        for sender in "ac":
            bench.send(trial * S, sender, "b", FULL, label=trial)
    fates = [row[-1] for row in bench.run()]
    assert len(fates) == 200 and least <= fates.count("arrived") <= most


def test_a_frame_is_sent_four_times_before_it_is_given_up():
    bench = bench_of({"a": (0, 0), "b": (30, 0), "c": (30.1, 0), "d": (math.nan, 0)})
    for label, receiver in enumerate("bcd"):
        bench.send(label * S, "a", receiver, FULL, label=receiver)
    assert [(label, fate) for _, label, *_, fate in bench.run()] == [
        ("b", "arrived"), ("c", "retry_limit"), ("d", "retry_limit")]
    assert bench.medium.model.attempts() == (1 + 4 + 4, 8)


def test_of_a_broadcast_each_receiver_has_its_own_fate():
    bench = bench_of({"a": (0, 0), "b": (20, 0), "c": (40, 0), "d": (60, 0)}, range="25 m",
                     interference="25 m", min_be=0, max_be=3)
    bench.send(0, "a", ["b", "d"], FULL, label="a", broadcast=True)
    bench.send(0, "c", ["b", "d"], FULL, label="c", broadcast=True)
    assert sorted((label, receiver, fate) for _, label, _, receiver, fate in bench.run()) == [
        ("a", "b", "collision"), ("a", "d", "out_of_reach"), ("c", "b", "collision"),
        ("c", "d", "arrived")]


def test_a_packet_is_lost_with_any_of_its_fragments():
    """The second fragment of three meets a frame of a hidden sender, and is not repeated."""
    bench = bench_of(Hidden.places, **Hidden.params, min_be=0, max_be=3)
    bench.send(0, "a", "b", HEADERS_BYTES + 290, label="three fragments")
    bench.send(8 * MS, "c", ["b"], FULL, label="hidden", broadcast=True)
    assert len(psdus(HEADERS_BYTES + 290)) == 3
    assert {(label, fate) for _, label, *_, fate in bench.run()} == {
        ("three fragments", "retry_limit"), ("hidden", "collision")}
    assert bench.medium.model.attempts() == (3, 1)


def test_a_packet_whose_acknowledgement_is_lost_has_arrived():
    """A station that hears the sender alone finds the channel idle between data and
    acknowledgement, and sends into that."""
    bench = bench_of({"a": (0, 0), "b": (20, 0), "c": (-20, 0)}, range="25 m", interference="25 m",
                     min_be=0, max_be=3, retries=0)
    bench.send(0, "a", "b", FULL, label="data")
    bench.send(ACCESS_NS + FULL_NS - CCA_NS + 190_000, "c", ["b"], FULL, label="c",
               broadcast=True)
    assert {(label, fate) for _, label, *_, fate in bench.run()} == {
        ("data", "arrived"), ("c", "out_of_reach")}
    assert bench.medium.model.attempts() == (2, 1)


def test_a_packet_of_2048_bytes_of_ipv6_is_too_long():
    bench = bench_of(2)
    for size_bytes in (MOST_BYTES, MOST_BYTES + 1):
        bench.send(0, "host_1", "host_2", size_bytes, label=size_bytes - MOST_BYTES)
    assert sorted((label, fate) for _, label, *_, fate in bench.run()) == [
        (0, "arrived"), (1, "too_long")]


@pytest.mark.parametrize(("params", "says"), [
    ("min_be: 6", "35: network.media.air: min_be (6) is more than max_be (5)"),
    ("range: 61 m", "35: network.media.air: interference (60 m) is less than range (61 m); who is "
                    "near enough to get a frame is near enough to be disturbed"),
    ("retries: 8", "64: network.media.air.retries: must be at most 7, got 8")])
def test_bad_parameters_are_named_with_their_places(params, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.yaml").write_text("name: x\ndeployment: field\nnetwork: {media: {lan: null, "
                                        f"air: {{model: ieee802154, {params}}}}}}}\n")
    with pytest.raises(InputError) as refused:
        load("case.yaml")
    assert str(refused.value) == f"case.yaml:3:{says}"
