"""Robots that do not know where the others started find out by their maps, or do not."""

import numpy as np
import pytest
from runs import MAZE_8, built

from desim.errors import InputError
from desim.monitor.summary import summarize
from desim.ports import Pose2D
from desim.robot.mapping.tiles import TilePool
from desim.robot.sharing.kinds.registered_maps import FramedMap, RegisteredMaps
from desim.testing import SharingBench

ROOMS = "environment.terrain={office: {size: [40 m, 24 m], seed: 2}}"
STARTS = "fleet.start={apart: 5 m}"
OFF = ["coordination.exchange.confidence=0", "coordination.exchange.rival=1000",
       "coordination.exchange.walls=0 m"]


def fleet(*overrides):
    return built(MAZE_8, "fleet.size=2", ROOMS, STARTS,
                 "coordination.exchange.model=registered_maps", *overrides, seed=2)


def summary_of(simulation):
    simulation.run()
    return summarize(simulation.monitor, simulation.kernel.now_ns)


def test_two_robots_find_how_their_maps_belong_together():
    simulation = fleet("stop.elapsed=90 s")
    found = summary_of(simulation)
    assert (found["merges"], found["false_merges"], found["merged_pairs"]) == (2, 0, 1.0)
    assert found["merge_error_m"] < 0.2 and found["merge_error_rad"] < 0.01
    for robot, other in (("robot_0", "robot_1"), ("robot_1", "robot_0")):
        assert other in simulation.monitor.maps[robot].received


def test_without_the_acceptance_test_merges_are_false():
    assert summary_of(fleet("stop.elapsed=20 s", *OFF))["false_merges"] > 0


def test_nothing_is_said_of_a_teammate_before_its_frame_is_accepted():
    simulation = fleet("stop.elapsed=90 s", "coordination.exchange.walls=1000 m")
    assert summary_of(simulation)["merges"] == 0
    assert all(not robot_map.received for robot_map in simulation.monitor.maps.values())


def said(start):
    """The maps that a robot sends that starts at ``start`` [m, m] and drives on along x."""
    bench = SharingBench(RegisteredMaps(RegisteredMaps.Params()), "robot_1", ("robot_2",),
                         TilePool(), 0)
    for second in range(12):
        bench.see(Pose2D(start[0] + 0.25 * second, start[1], 0.0))
        bench.run(second * 10**9)
    return [message.content for _, message in bench.published]


def test_no_message_has_the_place_where_a_robot_started():
    """The coordinates of the terrain are nowhere in them."""
    for one, two in zip(said((10.0, 10.0)), said((40.0, 25.5)), strict=True):
        assert isinstance(one, FramedMap) and one.size_bytes == two.size_bytes
        assert one[:2] == two[:2] and (one.left_m, one.low_m) == (two.left_m, two.low_m)
        assert np.allclose(one.pose, two.pose, atol=1e-12)
        assert np.array_equal(one.log_odds, two.log_odds)


@pytest.mark.parametrize(("strategy", "complaint"), [
    ("rendezvous", "coordination.strategy: 'rendezvous' wants its team's poses and goals"),
    ("connectivity", "coordination.strategy: it speaks to its team, of places")])
def test_a_strategy_that_speaks_of_places_is_refused(strategy, complaint):
    with pytest.raises(InputError, match=complaint):
        fleet(f"coordination.strategy={strategy}").run()


def found_by_graphs(*overrides):
    """Maps alone merge nothing here; the graphs may."""
    return fleet("coordination.exchange.walls=1000 m", "robot.localization.model=pose_graph",
                 "robot.odometry.model=random_walk", "fleet.size=4", *overrides)


def test_pose_graphs_find_where_strangers_are():
    found = summary_of(found_by_graphs("stop.elapsed=60 s"))
    assert found["merges"] >= 4 and found["false_merges"] == 0
    assert found["merge_error_m"] < 0.2 and found["merge_error_rad"] < 0.01


def test_where_the_network_is_cut_each_goes_on_alone():
    found = summary_of(found_by_graphs(
        "deployment=field", "stop.elapsed=30 s",
        "network.media.lan.rules=[{rule: loss, probability: 1}]"))
    assert found["merges"] == 0 and found["collisions"] == 0
    assert found["exploration_cost_m"] > 60.0  # four robots, measured: 77
