"""Kinds of map sharing, what each sends and what becomes of it: logs, sizes, partitions, chains."""

import numpy as np
import pytest
from sharing_fleet import SPEC, Fleet, S, scan_of, see

from desim import ports
from desim.robot.mapping.tiles import raster
from desim.robot.sharing.context import MapContext
from desim.robot.sharing.kinds.frontiers import Frontiers, frontier_cells
from desim.robot.sharing.kinds.mrs_testbed import MrsTestbed
from desim.robot.sharing.kinds.own_maps import OwnMaps
from desim.robot.sharing.kinds.registered_maps import RegisteredMaps
from desim.robot.sharing.kinds.relayed import Relayed
from desim.robot.sharing.kinds.scans import Scans
from desim.robot.sharing.kinds.submaps import Submap, Submaps, cells_at
from netmodels.rules.loss import Loss
from netmodels.rules.partition import Partition

CELLS = 70 * 50
ALWAYS = [set(range(0, 400, 3)), set(range(1, 400, 4)), set(range(2, 400, 5))]
KINDS = {"own_maps": OwnMaps, "mrs_testbed": MrsTestbed, "frontiers": Frontiers, "scans": Scans,
         "relayed": Relayed, "submaps": Submaps}


def of(cls, **params):
    return lambda: cls(cls.Params(**params))


def own_cells(fleet, robot):
    return fleet.maps[robot].own.snapshot().cells()


# ---- sizes, and when -------------------------------------------------------------------------


def test_mrs_testbed_sends_grids_of_five_seconds_and_poses_ten_times_a_second():
    fleet = Fleet(of(MrsTestbed), [set(range(30)), set(), set()]).run(30)
    grids, grid_bytes = fleet.sizes()
    poses, pose_bytes = fleet.sizes("/pose")
    assert grids == 2 * 6 and grid_bytes == grids * (96 + 13 + CELLS)  # nav_msgs/OccupancyGrid
    assert 2 * 298 <= poses <= 2 * 300
    assert pose_bytes == poses * (72 + 13)  # geometry_msgs/PoseStamped


def test_mrs_testbed_hands_over_after_a_whole_round_only():
    fleet = Fleet(of(MrsTestbed), [set(range(60))] * 3).run(60)
    merged = [second for second, host, kind, _ in fleet.log if (host, kind) == ("robot_2", "map")]
    assert len(merged) >= 5
    assert min(np.diff(merged)) >= 2 * 5 - 1  # one of two partners for each own map


def test_mrs_testbed_looks_for_each_teammate_ten_times_a_second(monkeypatch):
    """The published node's answer from the master grows with the team, and so does its work."""
    declared = []
    monkeypatch.setattr(MapContext, "worked", lambda _, **work: declared.append(work))
    Fleet(of(MrsTestbed), [set()] * 3).run(2)
    assert declared == [{"candidates": 2}] * len(declared)
    assert 3 * 19 <= len(declared) <= 3 * 21


def test_one_silent_robot_keeps_all_from_merging():
    fleet = Fleet(of(MrsTestbed), [set(range(60)), set(range(60)), set()]).run(60)
    assert [kind for _, _, kind, _ in fleet.log if kind == "map"] == []
    assert all(not robot_map.received for robot_map in fleet.maps.values())
    twin = Fleet(of(OwnMaps), [set(range(60)), set(range(60)), set()]).run(60)
    assert "robot_1" in twin.maps["robot_2"].received


def test_mrs_testbed_merges_with_near_robots_only():
    """Robots stand 1 m apart in a row: the middle one is near both others."""
    fleet = Fleet(of(MrsTestbed, max_distance="1.5 m"), [set(range(60))] * 3).run(60)
    assert [sorted(fleet.maps[name].received) for name in fleet.maps] == [
        [], ["robot_1", "robot_3"], []]


@pytest.mark.parametrize("mechanism, seconds", [({}, 2 * 5), ({"partners": "all"}, 5),
                                                ({"hand_over": "merged"}, 5)])
def test_each_mechanism_of_mrs_testbed_delays_maps(mechanism, seconds):
    fleet = Fleet(of(MrsTestbed, **mechanism), [set(range(90))] * 3).run(90)
    merged = [second for second, host, kind, _ in fleet.log if (host, kind) == ("robot_2", "map")]
    assert np.median(np.diff(merged)) == pytest.approx(seconds, abs=1)


def test_with_a_range_of_its_own_a_robot_waits_for_whole_rounds_for_its_own_map_too():
    everywhere = [set(range(60))] * 3
    fleet = Fleet(of(MrsTestbed, raytrace_range="1 m"), everywhere, fusion="greedy").run(60)
    for name, robot_map in fleet.maps.items():
        drawn, near = fleet.own_maps[name].own.snapshot(), robot_map.own.snapshot()
        known = [np.count_nonzero(layer.cells()) for layer in (near, robot_map.received[name],
                                                               drawn)]
        assert known[0] < known[1] <= known[2]
        assert sorted(robot_map.received) == ["robot_1", "robot_2", "robot_3"]
    silent = Fleet(of(MrsTestbed, raytrace_range="1 m"), [*everywhere[:2], set()]).run(60)
    assert not silent.maps["robot_1"].received
    assert np.count_nonzero(silent.maps["robot_1"].fused) > 0  # what it sees near by


def test_frontiers_are_a_pose_and_grid_cells():
    fleet = Fleet(of(Frontiers), [{1}, set(), set()]).run(12)
    edge = frontier_cells(raster(SPEC, own_cells(fleet, "robot_1")))
    heard = raster(SPEC, fleet.hears("robot_2", "robot_1"))
    assert np.array_equal(heard != 0, edge) and set(heard[edge].tolist()) == {-8}
    messages, sent = fleet.sizes()
    # header, widths, length, points | geometry_msgs/PoseStamped
    assert messages > 0 and sent == messages * ((16 + 13) + 8 + 4 + 24 * edge.sum() + 72 + 13)


def test_a_frontier_cell_is_free_and_beside_an_unknown_one():
    grid = np.array([[-8, -8, 17], [-8, 0, 17], [-8, -8, -8]], np.int8)
    assert frontier_cells(grid).astype(int).tolist() == [[0, 1, 0], [1, 0, 0], [0, 1, 0]]


def test_scans_are_sent_once_with_their_poses():
    fleet = Fleet(of(Scans), [{1, 2, 3}, set(), set()]).run(10)
    assert fleet.alike() == [True] * 3
    assert fleet.sizes() == (2, 2 * (28 + 3 * (52 + 25 + 4 * 12 + 72 + 13)))
    assert fleet.graph.topic("/map_exchange/robot_2/wanted").counts.published == 0


def test_scans_that_were_missed_are_asked_for():
    fleet = Fleet(of(Scans), [set(range(0, 60, 3)), set(), {5}]).run(30)
    fleet.graph.host("robot_3").stop()
    fleet.run(40)
    fleet.graph.host("robot_3").start()
    fleet.run(100)
    assert fleet.graph.topic("/map_exchange/robot_3/wanted").counts.published > 0
    assert np.array_equal(fleet.hears("robot_3", "robot_1"), own_cells(fleet, "robot_1"))


def test_submaps_are_sent_once_and_their_poses_again_when_slam_corrects_them():
    fleet = Fleet(of(Submaps, scans=2), [{1, 2, 3, 4}, set(), set()]).run(30)
    assert np.array_equal(fleet.hears("robot_2", "robot_1"), own_cells(fleet, "robot_1"))
    assert fleet.graph.topic("/map_exchange/robot_1").counts.published == 2 * 2  # to two others
    before, poses = fleet.sizes("/poses")
    own = fleet.maps["robot_1"]
    own.redraw_own([((2.0 + k, 3.4, 0.0), scan) for k, scan in enumerate([scan_of()] * 4)], 25.0)
    fleet.run(40)
    after, corrected = fleet.sizes("/poses")
    assert corrected - poses == (after - before) * (12 + 72 + 13 + 2 * 24) > 0
    assert fleet.graph.topic("/map_exchange/robot_1").counts.published == 2 * 2  # to two others
    heard = raster(SPEC, fleet.hears("robot_2", "robot_1")) != 0
    drawn = raster(SPEC, own_cells(fleet, "robot_1")) != 0
    # The second scans of the submaps keep their old places beside the first ones.
    assert (heard & drawn).sum() > 0.5 * drawn.sum()
    own.redraw_own([((1.0 + k, 3.0, 0.3 * k), scan_of()) for k in range(1, 5)], 25.0)
    fleet.run(50)
    assert np.array_equal(fleet.hears("robot_2", "robot_1"), own_cells(fleet, "robot_1"))


def test_what_slam_corrects_in_a_frame_of_ones_own_is_as_if_seen_there_at_once(monkeypatch):
    said = []
    monkeypatch.setattr(MapContext, "publish", lambda _, content: said.append(content))
    scans = [((2.0, 3.0, 0.0), 3.0), ((2.5, 3.0, 0.4), 2.0), ((3.0, 3.5, 0.8), 4.0)]
    for slip_m in (1.0, 0.0):  # between one scan and the next
        fleet = Fleet(of(RegisteredMaps), [set()] * 3).run(1)
        for k, ((x_m, *rest), range_m) in enumerate(scans):
            see(fleet.own_maps["robot_1"], x_m + k * slip_m, *rest, range_m)
        fleet.run(7)
        if slip_m:
            fleet.own_maps["robot_1"].redraw_own(
                [(np.array(place), scan_of(range_m)) for place, range_m in scans], 25.0)
            fleet.run(12)
    drawn, redrawn, at_once = said
    assert not np.array_equal(drawn.log_odds, at_once.log_odds)
    assert np.array_equal(redrawn.log_odds, at_once.log_odds)
    assert (redrawn.left_m, redrawn.low_m) == (at_once.left_m, at_once.low_m)


def test_submaps_that_were_missed_are_asked_for():
    fleet = Fleet(of(Submaps), [set(range(0, 60, 3)), set(), {5}]).run(30)
    fleet.graph.host("robot_3").stop()
    fleet.run(40)
    fleet.graph.host("robot_3").start()
    fleet.run(100)
    assert fleet.graph.topic("/map_exchange/robot_3/wanted").counts.published > 0
    assert np.array_equal(fleet.hears("robot_3", "robot_1"), own_cells(fleet, "robot_1"))


@pytest.mark.parametrize("quarter", range(4))
def test_a_submap_turns_about_the_pose_of_its_first_scan(quarter):
    grid = ports.GridSpec(1.0, 20, 20, 0.0, 0.0)
    cells = np.arange(1, 7, dtype=np.int8).reshape(2, 3)
    submap = Submap(0, 0, ports.Pose2D(8.0, 8.0, 0.0), 8, 8, cells, 0)
    turned = ports.Pose2D(11.0, 9.0, quarter * np.pi / 2)
    row, column, found = cells_at(grid, submap, turned)
    whole = np.zeros((20, 20), np.int8)
    whole[row:row + found.shape[0], column:column + found.shape[1]] = found
    for (y, x), value in np.ndenumerate(cells):
        at = complex(11, 9) + 1j**quarter * complex(x + 0.5, y + 0.5)
        assert whole[int(np.floor(at.imag)), int(np.floor(at.real))] == value
    assert np.count_nonzero(whole) == 6


def test_relayed_tiles_carry_their_sources_name():
    fleet = Fleet(of(Relayed, period="50 s"), [{1}, set(), set()]).run(60)
    tiles = len(fleet.maps["robot_1"].own.snapshot().filled())
    update = 4 + len("robot_1") + 35 + tiles * 1026
    assert fleet.sizes()[1] % (2 * (4 + update)) == 0 < fleet.sizes()[1]


# ---- everything comes together ---------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_after_a_partition_each_knows_what_the_others_knew_at_its_end(kind):
    rule = Partition(Partition.Params(groups=[["robot_1"]], **{"from": "10 s", "until": "70 s"}))
    fleet = Fleet(of(KINDS[kind]), ALWAYS, [rule]).run(70)
    knew = {name: own_cells(fleet, name) for name in fleet.maps}
    assert not any(name in fleet.maps["robot_1"].received
                   and fleet.maps["robot_1"].received[name].newest > 12 * S for name in knew)
    fleet.run(300)
    for receiver in fleet.maps:
        for source in set(fleet.maps) - {receiver}:
            heard = fleet.hears(receiver, source)
            assert fleet.maps[receiver].received[source].newest > 70 * S
            if kind == "frontiers":  # no more than their edges
                assert set(np.unique(heard).tolist()) == {-8, 0}
            else:
                assert heard[knew[source] != 0].all()


@pytest.mark.parametrize("kind", ["own_maps", "scans", "relayed", "submaps"])
def test_when_all_has_come_all_maps_are_equal(kind):
    seconds = [set(range(0, 60, 3)), set(range(1, 60, 7)), {5, 6, 40}]
    assert Fleet(of(KINDS[kind]), seconds).run(100).alike() == [True] * 3


def test_lost_broadcasts_of_relays_are_made_good():
    seconds = [set(range(0, 60, 3)), set(range(1, 60, 7)), {5, 6, 40}]
    fleet = Fleet(of(Relayed, via="broadcast"), seconds, [Loss(Loss.Params(probability="10 %"))])
    assert fleet.run(600).alike() == [True] * 3


class Chain:
    """A rule: the first and the last of three hosts cannot hear each other."""

    reasons = ("too_far",)

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [ports.Drop("too_far") if {frame.source, receiver} == {0, 2} else ports.PASS
                for receiver in receivers]


def test_only_relayed_evidence_crosses_a_chain():
    seconds = [{1, 5, 20}, {3, 8}, {2, 30}]
    assert Fleet(of(Relayed), seconds, [Chain()]).run(100).alike() == [True] * 3
    assert Fleet(of(OwnMaps), seconds, [Chain()]).run(100).alike() == [False, True, False]


def test_across_a_chain_a_restarted_robots_old_evidence_is_forgotten():
    fleet = Fleet(of(Relayed), [{1, 2, 8, 60}, {1}, set()], [Chain()]).run(40)
    old = own_cells(fleet, "robot_1")
    assert np.array_equal(fleet.hears("robot_3", "robot_1"), old)
    fleet.graph.host("robot_1").stop()
    fleet.run(50)
    fleet.graph.host("robot_1").start()
    fleet.run(160)
    assert not np.array_equal(own_cells(fleet, "robot_1"), old)
    assert fleet.alike() == [True] * 3
