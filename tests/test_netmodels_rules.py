"""Rules against what they promise: exact delays, exact laws, whole logs."""

import math

import numpy as np
import pytest

from desim import plugins
from desim.ports import PASS, Drop, Frame
from desim.testing import Bench, Instant
from netmodels.link import Link

MS = 10**6
S = 10**9


def make(name, **params):
    cls = plugins.load("rule", name)
    return cls(cls.Params(**params))


def fates(bench):
    return [(label, fate) for _, label, _, _, fate in bench.run()]


def test_range_counts_its_edge_in_and_hosts_without_a_place_too():
    places = {"a": (0, 0), "edge": (30, 40), "beyond": (30, 40.001), "none": (math.nan, 0)}
    bench = Bench(Instant(), places, rules=[make("range", distance="50 m")])
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

    bench, trips_ns = Bench(Instant(), 2, rules=[make("latency", delay="500 ms")]), []
    medium = bench.medium
    medium.transmit(0, (1,), 100, 1, False, Ping(), "ping")
    bench.run()
    assert trips_ns == [1_000_000_000]


def test_jitter_is_uniform_between_its_ends():
    """2000 draws of U(0, 2 ms): mean 1 ms with standard error 2 / sqrt(12 * 2000) = 0.0129 ms."""
    bench = Bench(Instant(), 2, rules=[make("latency", delay="5 ms", jitter="2 ms")])
    for k in range(2000):
        bench.send(k * S, "host_1", "host_2", 100)
    delays_ns = [time_ns % S for time_ns, *_ in bench.run()]
    assert 5 * MS <= min(delays_ns) < 5.02 * MS
    assert 6.98 * MS < max(delays_ns) <= 7 * MS
    assert abs(sum(delays_ns) / 2000 - 6 * MS) < 4 * 0.0129 * MS


@pytest.mark.parametrize(("segments", "p"), [(1, 0.1), (5, 0.1), (20, 0.05)])
def test_a_train_survives_with_the_power_of_its_length(segments, p):
    """(1 - p)^segments, binomial over 4000 frames, 4 standard errors."""
    bench, frames = Bench(Instant(), 2, rules=[make("loss", probability=p)]), 4000
    for k in range(frames):
        bench.send(k, "host_1", "host_2", 100 * segments, segments)
    got = sum(fate == "arrived" for _, fate in fates(bench)) / frames
    law = (1 - p) ** segments
    assert abs(got - law) < 4 * math.sqrt(law * (1 - law) / frames)


def test_loss_of_nothing_and_of_everything():
    for probability, fate in [(0.0, "arrived"), ("100 %", "random_loss")]:
        bench = Bench(Instant(), 2, rules=[make("loss", probability=probability)])
        for k in range(50):
            bench.send(k, "host_1", "host_2", 100, 1 + k)
        assert {got for _, got in fates(bench)} == {fate}


def test_two_losses_draw_their_own_luck():
    """Two rules of one half each let a quarter through, not a half."""
    bench = Bench(Instant(), 2, rules=[make("loss", probability=0.5) for _ in range(2)])
    for k in range(4000):
        bench.send(k, "host_1", "host_2", 100)
    got = sum(fate == "arrived" for _, fate in fates(bench)) / 4000
    assert abs(got - 0.25) < 4 * math.sqrt(0.25 * 0.75 / 4000)


def test_bandwidth_lets_the_burst_through_and_then_keeps_the_rate():
    """1000 B burst at 8 kB/s (1 ms per 8 B): the first frame at once, each next 500 B 62.5 ms
    later; after a pause of a second the burst is there again, and not two of them."""
    bench = Bench(Instant(), 2, rules=[make("bandwidth", rate="64 kb/s", burst="1000 B",
                                   backlog="1500 B")])
    for label in range(7):
        bench.send(0, "host_1", "host_2", 500, label=label)
    bench.send(10 * S, "host_1", "host_2", 2000, label="burst again")
    assert [(time_ns / MS, label, fate) for time_ns, label, _, _, fate in bench.run()] == [
        (0, 5, "rate_limited"), (0, 6, "rate_limited"), (0, 0, "arrived"), (0, 1, "arrived"),
        (62.5, 2, "arrived"), (125, 3, "arrived"), (187.5, 4, "arrived"),
        (10_125, "burst again", "arrived")]


def test_bandwidth_is_per_sender():
    bench = Bench(Instant(), 3, rules=[make("bandwidth", rate="8 kb/s", burst="100 B")])
    for source in ("host_1", "host_2"):
        bench.send(0, source, "host_3", 1100, label=source)
    assert [time_ns for time_ns, *_ in bench.run()] == [S, S]


def test_partition_cuts_groups_apart_for_its_time():
    cut = make("partition", groups=[["a*"], ["b?"]], **{"from": "1 s", "until": "2 s"})
    bench = Bench(Instant(), dict.fromkeys(["a1", "a2", "b1", "c1", "c2"], (0.0, 0.0)),
                  rules=[cut])
    pairs = [("a1", "a2"), ("a1", "b1"), ("b1", "c1"), ("c1", "c2")]
    for time_ns in (S - 1, S, 2 * S - 1, 2 * S):
        for source, receiver in pairs:
            bench.send(time_ns, source, receiver, 100, label=source + receiver)
    log = bench.run()
    cut = [(time_ns, label) for time_ns, label, _, _, fate in log if fate == "partitioned"]
    assert sorted(cut) == [(S, "a1b1"), (S, "b1c1"), (2 * S - 1, "a1b1"), (2 * S - 1, "b1c1")]
    assert len(log) == 16


def test_rules_work_in_front_of_any_model():
    bench = Bench(Link(Link.Params(rate="1 Mb/s")), 2, rules=[make("latency", delay="7 ms")])
    bench.send(0, "host_1", "host_2", 125)
    assert bench.run()[0][0] == 8 * MS
