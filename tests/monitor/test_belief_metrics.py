"""The metrics of a middleware, on small cases that are worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from graphs import Net, S, Words
from toy_middlewares import Late, Naive

from desim.engine.kernel import Phase
from desim.middleware.direct import Direct
from desim.monitor.meters.belief_metrics import BeliefMetrics
from desim.monitor.meters.meter import Second
from desim.monitor.meters.overlap import Overlap
from desim.monitor.periods import all_due
from desim.ports import GridSpec
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import FREE, OCCUPIED, TilePool
from netmodels.rules.timing import Latency


class Scripted(Direct):
    """Everybody knows at once who subscribes; what is believed a test says."""

    informed = "publisher"

    def start(self, context):
        super().start(context)
        self.context = context


class Watched:
    """Three robots, of which every one hears what the others say; links as a test sets them."""

    def __init__(self, middleware=None, robots=3, **options):
        def begin(node):
            node.advertise("/news")
            node.subscribe("/news", lambda message: None)
            self.nodes[node.host.name] = node

        self.nodes = {}
        names = [f"robot_{i}" for i in range(robots)]
        self.net = Net(dict.fromkeys(names, begin), middleware=middleware or Scripted(), **options)
        self.graph = self.net.graph
        self.links = np.ones((robots, robots), bool)
        self.samples = []
        self.belief_metrics = BeliefMetrics(self.graph, self.graph.hosts, self.linked,
                                            self.samples)
        self.net.kernel.ticker(1, Phase.OBSERVE, 0, self.second)

    def linked(self):
        up = [host.index for host in self.graph.hosts if host.up]
        return self.links[np.ix_(up, up)]

    def second(self, k):
        now_ns = self.net.kernel.now_ns
        self.belief_metrics.each_second(Second(now_ns, np.empty(0), np.empty(0), self.linked()))
        self.graph.catch_up()
        self.samples.append(self.belief_metrics.sample(now_ns, all_due))

    def at(self, time_s, fn, *args):
        self.net.at(round(time_s * S), lambda: fn(*args))

    def sees(self, time_s, believer, other, state):
        self.at(time_s, self.graph.context.sees, believer, other, state)

    def says(self, time_s, robot):
        self.at(time_s, lambda: self.nodes[f"robot_{robot}"].publish("/news", Words("news")))

    def link(self, time_s, one, other, there):
        def change():
            self.links[one, other] = self.links[other, one] = there
        self.at(time_s, change)

    def run(self, until_s):
        self.net.run(round(until_s * S))
        return self.belief_metrics.summary(self.net.kernel.now_ns)


# ---------------------------------------------------------------------------------- detection


def test_a_stop_is_noticed_from_its_exact_instant_on():
    fleet = Watched()
    fleet.at(2.25, fleet.graph.hosts[2].stop)
    fleet.sees(4.5, 0, 2, "offline")  # after 2.25 s
    fleet.sees(9.0, 0, 2, "removed")  # it knew that already
    fleet.sees(6.0, 1, 2, "removed")  # after 3.75 s
    summary = fleet.run(10)
    assert summary["detection_delay_s"] == {"mean": 3.0, "max": 3.75, "noticed": 2, "pairs": 2}
    assert summary["false_alarms"] == 0


def test_a_lost_link_is_seen_at_the_next_second_and_counts_in_both_directions():
    fleet = Watched()
    fleet.link(2.5, 0, 1, False)  # seen at 3 s
    fleet.sees(7.0, 0, 1, "offline")
    assert fleet.run(10)["detection_delay_s"] == {"mean": 4.0, "max": 4.0, "noticed": 1,
                                                  "pairs": 2}


def test_who_is_there_again_before_anybody_noticed_was_not_noticed():
    fleet = Watched()
    fleet.link(2.0, 0, 1, False)
    fleet.link(5.0, 0, 1, True)
    fleet.sees(7.0, 0, 1, "offline")  # too late: wrong by now
    summary = fleet.run(10)
    assert summary["detection_delay_s"] == {"mean": None, "max": None, "noticed": 0, "pairs": 2}
    assert summary["false_alarms"] == 1


def test_who_stops_itself_does_not_have_to_notice():
    fleet = Watched()
    fleet.link(2.0, 0, 1, False)
    fleet.at(3.0, fleet.graph.hosts[0].stop)  # 1 and 2 have to notice that, 1 since 2 s
    fleet.sees(6.0, 1, 0, "offline")
    fleet.sees(6.5, 2, 0, "offline")
    assert fleet.run(10)["detection_delay_s"] == {"mean": 3.75, "max": 4.0, "noticed": 2,
                                                  "pairs": 2}


def test_a_peer_in_reach_that_is_taken_for_gone_is_one_false_alarm():
    fleet = Watched()
    fleet.sees(1.0, 0, 1, "online")
    fleet.sees(2.5, 0, 1, "offline")
    fleet.sees(3.5, 0, 1, "removed")  # the same one
    fleet.sees(4.5, 0, 1, "online")
    fleet.sees(5.5, 0, 1, "offline")  # another
    fleet.link(6.5, 0, 1, False)  # only robot_1 has to notice
    summary = fleet.run(10)
    assert summary["false_alarms"] == 2
    assert summary["detection_delay_s"]["pairs"] == 1


def test_a_link_that_went_since_the_last_sample_is_no_false_alarm():
    fleet = Watched()
    fleet.link(2.25, 0, 1, False)
    fleet.sees(2.75, 0, 1, "offline")  # looked at then
    summary = fleet.run(5)
    assert summary["false_alarms"] == 0
    assert summary["detection_delay_s"] == {"mean": 0.0, "max": 0.0, "noticed": 1, "pairs": 2}


# ------------------------------------------------------------------------------------- resync


def test_resync_lasts_until_the_first_message_is_there():
    fleet = Watched()
    fleet.link(1.0, 0, 1, False)
    fleet.link(2.5, 0, 1, True)  # seen at 3 s
    for time_s in (2.75, 4.5, 4.75):  # the first is heard before it counts
        fleet.says(time_s, 0)
    assert fleet.run(6)["resync_delay_s"] == {"mean": 1.5, "max": 1.5, "resynced": 1, "pairs": 2}


def test_a_host_that_starts_is_there_again_in_that_instant():
    fleet = Watched()
    fleet.at(1.0, fleet.graph.hosts[2].stop)
    fleet.at(2.25, fleet.graph.hosts[2].start)
    fleet.says(3.0, 2)
    fleet.says(3.5, 0)
    # To 0 and 1 after 0.75 s, from 0 after 1.25 s, from 1 never.
    assert fleet.run(6)["resync_delay_s"] == {"mean": 2.75 / 3, "max": 1.25, "resynced": 3,
                                              "pairs": 4}


def test_who_is_lost_once_more_before_a_message_came_is_not_resynced():
    fleet = Watched()
    for time_s, there in ((1.0, False), (2.0, True), (3.0, False), (5.0, True)):
        fleet.link(time_s, 0, 1, there)
    fleet.says(4.0, 0)
    fleet.says(5.5, 0)
    assert fleet.run(7)["resync_delay_s"] == {"mean": 0.5, "max": 0.5, "resynced": 1, "pairs": 4}


def test_the_first_start_is_no_return():
    assert Watched().run(3)["resync_delay_s"]["pairs"] == 0


# ---------------------------------------------------------------------- ages, beliefs, traffic


def test_stale_age_is_the_mean_over_pairs_that_are_up():
    fleet = Watched(robots=2)
    fleet.says(1.0, 0)
    fleet.net.run(4 * S)
    assert fleet.belief_metrics.stale_age_s() == (3.0 + 4.0) / 2  # robot_0 never heard anything
    fleet.graph.hosts[1].stop()
    assert fleet.belief_metrics.stale_age_s() is None
    fleet.graph.hosts[1].start()
    assert fleet.belief_metrics.stale_age_s() == 4.0  # it has forgotten what it heard
    assert [row["stale_age_s"] for row in fleet.samples] == [0.0, 0.5, 1.5, 2.5, 3.5]
    assert fleet.belief_metrics.summary(0)["stale_age_s"] == 1.6


def test_divergence_by_the_second():
    fleet = Watched(Late())  # knows after 2 s
    fleet.at(5.5, fleet.graph.hosts[2].stop)
    # Six matches. 0 to 2 s: all are missing (those of 2 s are learnt in that instant).
    # 6 s and 7 s: two matches are left, and two ghosts.
    summary = fleet.run(9)
    shares = [row["registry_divergence"] for row in fleet.samples]
    assert shares == [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]
    assert summary["registry_divergence"] == {"mean": 0.3, "max": 1.0, "end": 0.0}
    assert summary["ghosts"] == {"mean": 0.4, "max": 2, "end": 0}
    assert summary["detection_delay_s"] == {"mean": 2.0, "max": 2.0, "noticed": 2, "pairs": 2}


def test_ghosts_stay_where_nobody_notices():
    fleet = Watched(Naive())
    fleet.at(5.5, fleet.graph.hosts[2].stop)
    summary = fleet.run(9)
    assert summary["ghosts"]["end"] == 2
    assert summary["detection_delay_s"]["noticed"] == 0


def test_without_beliefs_there_is_nothing_to_say_about_them():
    fleet = Watched(Direct())
    fleet.says(1.0, 0)
    summary = fleet.run(3)
    assert fleet.samples[-1].keys() == {"stale_age_s"}
    assert summary["registry_divergence"] == summary["ghosts"] == {"mean": None, "max": None,
                                                                   "end": None}
    assert summary["detection_delay_s"] == {"mean": None, "max": None, "noticed": None,
                                            "pairs": None}
    assert (summary["false_alarms"], summary["discovery_bytes"]) == (None, 0)


def test_discovery_is_counted_by_kind():
    fleet = Watched()
    for time_s, kind, size_bytes in ((1.0, "heartbeat", 60), (2.0, "heartbeat", 60),
                                     (3.0, "sync", 500)):
        fleet.at(time_s, fleet.graph.context.send, kind, 0, (1, 2), size_bytes,
                 lambda token, receiver: None)
    summary = fleet.run(4)
    assert (summary["discovery_bytes"], summary["discovery_frames"]) == (1240, 6)
    assert summary["discovery_by_kind"] == {"heartbeat": {"bytes": 240, "frames": 4},
                                            "sync": {"bytes": 1000, "frames": 2}}


@pytest.mark.parametrize("delay_ms, late", [(999, 0), (1000, 2), (2500, 2)])
def test_messages_of_a_second_and_more_are_late(delay_ms, late):
    fleet = Watched(rules=[Latency(Latency.Params(delay=f"{delay_ms} ms"))])
    fleet.says(1.0, 0)
    assert fleet.run(8)["messages_late"] == late
    assert fleet.net.counts("/news").delivered == 2


# ------------------------------------------------------------------------ duplicated exploration

GRID = GridSpec(1.0, 32, 32, 0.0, 0.0)  # one tile


def robot_map(free=(), solid=()) -> RobotMap:
    """One whose robot has itself seen these cells, by number."""
    out = RobotMap(GRID, TilePool())
    out.own.changing()
    out.own.indices[0] = 1
    out.pool.arrays.refs[1] += 1
    out.pool.arrays.data[1, list(free)] = FREE
    out.pool.arrays.data[1, list(solid)] = OCCUPIED
    return out


def watched(overlap, **maps):
    """The overlap of these maps, after those that it had."""
    for robot, its_map in maps.items():
        overlap.watch(robot, its_map, 0)
    return overlap.summary(0)


def test_cells_that_two_have_seen_are_a_share_of_all_that_are_seen():
    overlap = Overlap(GRID, np.ones((32, 32), bool))
    # Cells 4 and 5 of 0 to 7; 5 has been seen by three.
    assert watched(overlap, robot_0=robot_map(range(6)), robot_1=robot_map(range(4, 7), [7]),
                   robot_2=robot_map([5]), robot_3=None) == {
        "duplicated_exploration": 2 / 8, "robots_per_cell": 11 / 8}


def test_only_cells_count_that_can_be_reached():
    reachable = np.zeros((32, 32), bool)
    reachable[0, :5] = True
    overlap = Overlap(GRID, reachable)
    assert watched(overlap, a=robot_map(range(6)), b=robot_map(range(4, 8)))[
        "duplicated_exploration"] == 1 / 5
    assert set(watched(Overlap(GRID, reachable), a=robot_map(), b=None).values()) == {None}


def test_what_a_robot_forgot_it_has_seen_all_the_same():
    overlap = Overlap(GRID, np.ones((32, 32), bool))
    watched(overlap, robot_0=robot_map(range(4)))
    watched(overlap, robot_0=None)
    watched(overlap, robot_0=robot_map(range(2, 6)))
    assert watched(overlap, robot_0=None, robot_1=robot_map(range(5, 10)))[
        "duplicated_exploration"] == 1 / 10
    assert watched(overlap, robot_0=robot_map([9]))["duplicated_exploration"] == 2 / 10
