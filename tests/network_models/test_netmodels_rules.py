"""Rules against what they promise: exact delays, exact laws, whole logs."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim import plugins
from desim.ports import PASS, Drop, Frame
from desim.testing import Bench, ImmediateNetwork
from netmodels.access_link import AccessLink

MS = 10**6
S = 10**9


def make(name, **params):
    cls = plugins.load("rule", name)
    return cls(cls.Params(**params))


def fates(bench):
    return [(label, fate) for _, label, _, _, fate in bench.run()]


def test_range_counts_its_edge_in_and_hosts_without_a_place_too():
    places = {"a": (0, 0), "edge": (30, 40), "beyond": (30, 40.001), "none": (math.nan, 0)}
    bench = Bench(ImmediateNetwork(), places, rules=[make("range", distance="50 m")])
    for receiver in ("edge", "beyond", "none"):
        bench.send(0, "a", receiver, 100, label=receiver)
    bench.send(0, "none", "beyond", 100, label="from none")
    assert sorted(fates(bench)) == [("beyond", "out_of_range"), ("edge", "arrived"),
                                    ("from none", "arrived"), ("none", "arrived")]


def test_range_notices_moves():
    """Nobody moves within an instant; positions are the same object until somebody does."""
    class Moving:
        now_ns, places = 0, np.array([(0.0, 0.0), (30.0, 40.0), (math.nan, math.nan)])

        def positions(self, time_ns):
            return self.places

    moving, rule = Moving(), make("range", distance="50 m")
    rule.start(moving, ("a", "b", "none"))
    frame = Frame(1, 0, (1, 2), 100, 1, True)

    def verdicts(places):
        moving.now_ns, moving.places = moving.now_ns + 1, places
        return rule.judge(frame, (1, 2))

    assert verdicts(moving.places) is None
    assert verdicts(moving.places) is None
    assert verdicts(moving.places + [[0, 0], [0, 0.001], [0, 0]]) == [Drop("out_of_range"), PASS]
    assert verdicts(np.array([(0.0, 0.0), (3.0, 4.0), (900.0, 0.0)])) == [PASS,
                                                                          Drop("out_of_range")]
    assert verdicts(np.full((3, 2), math.nan)) is None


def test_latency_of_half_a_second_gives_a_round_trip_of_exactly_one():
    """ROS-NetSim's README measures 1005.133 to 1012.983 ms for this set-up; the clock of a
    simulation owes exactly 1000 ms."""
    class Ping:
        def arrived(self, token, receiver):
            if token == "ping":
                medium.transmit(1, (0,), 100, 1, False, self, "pong")
            else:
                trips_ns.append(bench.kernel.now_ns)

    bench, trips_ns = Bench(ImmediateNetwork(), 2, rules=[make("latency", delay="500 ms")]), []
    medium = bench.medium
    medium.transmit(0, (1,), 100, 1, False, Ping(), "ping")
    bench.run()
    assert trips_ns == [1_000_000_000]


def test_jitter_of_nothing_is_the_delay():
    bench = Bench(ImmediateNetwork(), 2, rules=[
        make("latency", delay="5 ms", distribution="pareto")])
    bench.send(0, "host_1", "host_2", 100)
    assert bench.run()[0][0] == 5 * MS


@pytest.mark.parametrize(("segments", "p"), [(1, 0.1), (5, 0.1), (20, 0.05)])
def test_a_train_survives_with_the_power_of_its_length(segments, p):
    """(1 - p)^segments, binomial over 4000 frames, 4 standard errors."""
    bench, frames = Bench(ImmediateNetwork(), 2, rules=[make("loss", probability=p)]), 4000
    for k in range(frames):
        bench.send(k, "host_1", "host_2", 100 * segments, segments)
    got = sum(fate == "arrived" for _, fate in fates(bench)) / frames
    law = (1 - p) ** segments
    assert abs(got - law) < 4 * math.sqrt(law * (1 - law) / frames)


def test_loss_of_nothing_and_of_everything():
    for probability, fate in [(0.0, "arrived"), ("100 %", "random_loss")]:
        bench = Bench(ImmediateNetwork(), 2, rules=[make("loss", probability=probability)])
        for k in range(50):
            bench.send(k, "host_1", "host_2", 100, 1 + k)
        assert {got for _, got in fates(bench)} == {fate}


def test_two_losses_draw_from_streams_of_their_own():
    """Two rules of one half each let a quarter through, not a half."""
    bench = Bench(ImmediateNetwork(), 2, rules=[make("loss", probability=0.5) for _ in range(2)])
    for k in range(4000):
        bench.send(k, "host_1", "host_2", 100)
    got = sum(fate == "arrived" for _, fate in fates(bench)) / 4000
    assert abs(got - 0.25) < 4 * math.sqrt(0.25 * 0.75 / 4000)


def test_bandwidth_lets_the_burst_through_and_then_keeps_the_rate():
    """1000 B burst at 8 kB/s (1 ms per 8 B): the first frame at once, each next 500 B 62.5 ms
    later; after a pause of a second the burst is there again, and not two of them."""
    bench = Bench(ImmediateNetwork(), 2, rules=[make("bandwidth", rate="64 kb/s", burst="1000 B",
                                   backlog="1500 B")])
    for label in range(7):
        bench.send(0, "host_1", "host_2", 500, label=label)
    bench.send(10 * S, "host_1", "host_2", 2000, label="burst again")
    assert [(time_ns / MS, label, fate) for time_ns, label, _, _, fate in bench.run()] == [
        (0, 5, "rate_limited"), (0, 6, "rate_limited"), (0, 0, "arrived"), (0, 1, "arrived"),
        (62.5, 2, "arrived"), (125, 3, "arrived"), (187.5, 4, "arrived"),
        (10_125, "burst again", "arrived")]


def test_bandwidth_is_per_sender():
    bench = Bench(ImmediateNetwork(), 3, rules=[make("bandwidth", rate="8 kb/s", burst="100 B")])
    for source in ("host_1", "host_2"):
        bench.send(0, source, "host_3", 1100, label=source)
    assert [time_ns for time_ns, *_ in bench.run()] == [S, S]


def passed(sizes_bytes, gaps_us, rate="8 Mb/s"):
    """(size, when its last byte left in ns) of packets, sent so long after each other, that a
    bucket of 3 kB at ``rate`` lets through."""
    now_ns = 0
    bench = Bench(ImmediateNetwork(), 2, rules=[make("bandwidth", rate=rate, burst="3 kB")])
    for size_bytes, gap_us in zip(sizes_bytes, gaps_us, strict=True):
        now_ns += gap_us * 1000
        bench.send(now_ns, "host_1", "host_2", size_bytes, label=size_bytes)
    return [(label, time_ns) for time_ns, label, *_ in bench.run()]


def above_the_curve(left):
    """By how many bytes packets exceed burst + rate * t, 3 kB and 8 Mb/s, where that is worst;
    t runs from any packet to any later one, both included."""
    times_us = np.array([time_ns for _, time_ns in left]) / 1000  # 8 Mb/s are 1 B/us
    sizes = np.array([size for size, _ in left])
    total = np.cumsum(sizes)
    return ((total[None, :] - total[:, None] + sizes[:, None])
            - 3000 - np.maximum(times_us[None, :] - times_us[:, None], 0)).max()


@given(st.lists(st.tuples(st.integers(1, 3000), st.integers(0, 5000)), min_size=1, max_size=60))
def test_what_leaves_a_bucket_stays_below_its_curve(load):
    sizes_bytes, gaps_us = zip(*load, strict=True)
    assert above_the_curve(passed(sizes_bytes, gaps_us)) <= 1e-3  # times are rounded up to 1 ns


def test_a_bucket_that_is_never_empty_keeps_to_its_curve_and_the_twin_does_not():
    """1500 B every 0.5 ms, three times the rate: on the curve to the byte, and with 5 % more rate
    above it."""
    load = [1500] * 200, [500] * 200
    assert above_the_curve(passed(*load)) == pytest.approx(0, abs=1e-3)
    assert above_the_curve(passed(*load, rate="8.4 Mb/s")) > 1000


def test_partition_cuts_groups_apart_for_its_time():
    cut = make("partition", groups=[["a*"], ["b?"]], **{"from": "1 s", "until": "2 s"})
    bench = Bench(ImmediateNetwork(), dict.fromkeys(["a1", "a2", "b1", "c1", "c2"], (0.0, 0.0)),
                  rules=[cut])
    pairs = [("a1", "a2"), ("a1", "b1"), ("b1", "c1"), ("c1", "c2")]
    for time_ns in (S - 1, S, 2 * S - 1, 2 * S):
        for source, receiver in pairs:
            bench.send(time_ns, source, receiver, 100, label=source + receiver)
    log = bench.run()
    cut = [(time_ns, label) for time_ns, label, _, _, fate in log if fate == "partitioned"]
    assert sorted(cut) == [(S, "a1b1"), (S, "b1c1"), (2 * S - 1, "a1b1"), (2 * S - 1, "b1c1")]
    assert len(log) == 16


def test_a_window_opens_again_and_again():
    cut = make("partition", groups=[["host_1"]], **{"from": "1 s", "until": "1.5 s"}, every="2 s")
    bench = Bench(ImmediateNetwork(), 2, rules=[cut])
    for k in range(14):
        bench.send(k * S // 2, "host_1", "host_2", 100, label=k / 2)
    assert [label for label, fate in fates(bench) if fate == "partitioned"] == [1, 3, 5]


def test_an_outage_takes_hosts_off_the_network_and_cuts_links():
    """Of a host everything, of a link both directions; what else these hosts say gets through."""
    down = make("outage", hosts=["base"], links=[["robot_1", "robot_[23]"]],
                **{"from": "1 s", "until": "2 s"})
    hosts = ["base", "robot_1", "robot_2", "robot_3"]
    bench = Bench(ImmediateNetwork(), dict.fromkeys(hosts, (0.0, 0.0)), rules=[down])
    for time_ns in (S - 1, S, 2 * S - 1, 2 * S):
        for source in hosts:
            for receiver in hosts:
                if source != receiver:
                    bench.send(time_ns, source, receiver, 100, label=(source, receiver))
    log = bench.run()
    through = {label for time_ns, label, _, _, fate in log
               if S <= time_ns < 2 * S and fate == "arrived"}
    assert through == {("robot_2", "robot_3"), ("robot_3", "robot_2")}
    assert Counter(fate for *_, fate in log) == {"outage": 20, "arrived": 28}


def test_an_outage_separates_for_the_monitor():
    down = make("outage", links=[["a", "b"]], **{"from": "1 s"})
    bench = Bench(ImmediateNetwork(), dict.fromkeys("abc", (0.0, 0.0)), rules=[down])
    everybody = np.arange(3)
    assert bench.medium.linked(everybody).all()
    bench.kernel.run(S)
    assert np.argwhere(~bench.medium.linked(everybody)).tolist() == [[0, 1], [1, 0]]


def test_a_jammer_is_felt_by_who_sends_and_who_receives():
    """Its edge counts; a host without a place is not near it."""
    jam = make("jamming", at=["10 m", "0 m"], radius="5 m", **{"from": "1 s", "until": "2 s"})
    places = {"inside": (10, 0), "edge": (13, 4), "outside": (13, 4.001), "far": (90, 0),
              "nowhere": (math.nan, 0)}
    bench = Bench(ImmediateNetwork(), places, rules=[jam])
    for time_ns in (0, S, 2 * S):
        for source, receiver in [("inside", "far"), ("far", "edge"), ("far", "outside"),
                                 ("nowhere", "far"), ("edge", "inside")]:
            bench.send(time_ns, source, receiver, 100, label=(source, receiver))
    jammed = [(time_ns, label) for time_ns, label, _, _, fate in bench.run() if fate == "jammed"]
    assert sorted(jammed) == [(S, ("edge", "inside")), (S, ("far", "edge")), (S, ("inside", "far"))]
    assert jam.separates(0, 1) is False  # it is over


def test_a_jammer_that_spares_some_separates_nobody():
    for probability, separates in [(1.0, True), (0.9, False)]:
        jam = make("jamming", at=["0 m", "0 m"], radius="5 m", probability=probability)
        Bench(ImmediateNetwork(), {"a": (0, 0), "b": (50, 0), "c": (60, 0)}, rules=[jam])
        assert jam.separates(0, 1) is jam.separates(1, 0) is separates
        assert not jam.separates(1, 2)


def test_copies_arrive_behind_the_original_and_those_of_two_rules_add_up():
    bench = Bench(ImmediateNetwork(), 2, rules=[
        make("duplication", probability="100 %", after="3 ms"), make("latency", delay="1 ms"),
        make("duplication", probability="100 %", after="0 s")])
    bench.send(0, "host_1", "host_2", 100)
    assert [(time_ns, fate) for time_ns, *_, fate in bench.run()] == [
        (MS, "arrived"), (MS, "repeated"), (4 * MS, "repeated")]
    medium = bench.medium
    assert (medium.intended, medium.delivered, medium.copies) == (1, 1, 2)
    assert list(medium.rx_bytes) == [0, 300] and medium.tx_bytes == [100, 0]
    assert medium.bytes_on_air == 100 and medium.in_flight() == 0


def test_a_broadcast_is_copied_at_each_receiver():
    bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (1, 0), "c": (90, 0)}, rules=[
        make("range", distance="50 m"), make("duplication", probability=1.0, after="1 ms")])
    bench.send(0, "a", ["b", "c"], 100, broadcast=True)
    bench.send(S, "b", ["a"], 100, broadcast=True)
    assert [(time_ns, *row) for time_ns, _, *row in bench.run()] == [
        (0, "a", "c", "out_of_range"), (0, "a", "b", "arrived"), (MS, "a", "b", "repeated"),
        (S, "b", "a", "arrived"), (S + MS, "b", "a", "repeated")]
    assert bench.medium.in_flight() == 0


def test_what_is_lost_has_no_copies():
    bench = Bench(ImmediateNetwork(), 2, rules=[make("duplication", probability=1.0),
                                                make("loss", probability=1.0)])
    bench.send(0, "host_1", "host_2", 100)
    assert [fate for *_, fate in bench.run()] == ["random_loss"] and bench.medium.copies == 0


def test_rules_work_in_front_of_any_model():
    bench = Bench(AccessLink(AccessLink.Params(rate="1 Mb/s")), 2,
                  rules=[make("latency", delay="7 ms")])
    bench.send(0, "host_1", "host_2", 125)
    assert bench.run()[0][0] == 8 * MS
