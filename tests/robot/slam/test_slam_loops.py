"""Loops: a particle that comes home in the right place takes over from one that has drifted."""

from functools import cache

import numpy as np
import pytest
from slam_logs import Laser, made_log, ring, way

from desim.engine.streams import Streams
from desim.imports.slam_logs.localization_trial import localization_for_logs, play_localization
from desim.robot.slam import closures, particle_filter
from desim.robot.slam.closures import ClosureFinder
from desim.robot.slam.fleet_graph import Closure, FleetGraph
from desim.robot.slam.kinds import SLAM
from desim.robot.slam.settings import SlamSettings
from desim.robot.transforms import motion_between

SHORT = Laser(beams=121, longest_m=8.0)


@cache
def once_around(seed, width=60.0, height=50.0):
    """A log of a ring and its first side again, and the true poses."""
    corners = [(1.25, 1.25), (width - 1.25, 1.25), (width - 1.25, height - 1.25),
               (1.25, height - 1.25), (1.25, 1.25), (width - 1.25, 1.25)]
    poses = way(corners, step_m=0.5, turn_rad=0.25)
    return made_log(ring(width, height, seed=seed + 4), poses, SHORT, seed=seed,
                    drift=-0.02), poses


def error_m(kind, seed):
    """The mean error over the relations of all pairs of processed scans."""
    log, poses = once_around(seed)
    slam = SLAM[kind](SlamSettings(laser=log.laser), Streams(seed).key("slam"))
    at = [k for k in range(len(poses)) if slam.update(log.odometry[k], log.ranges[k])]
    return error_of(slam.path(), poses[at])


def error_of(path, true):
    first, second = (side.ravel() for side in np.indices((len(true), len(true))))
    off = motion_between(path[first], path[second]) - motion_between(true[first], true[second])
    return np.hypot(off[:, 0], off[:, 1]).mean()


SEEDS = 1, 3, 5


def share_of_one_hypothesis():
    return sum(error_m("gmapping", seed) for seed in SEEDS) / one_hypothesis_m()


@cache
def one_hypothesis_m():
    return sum(error_m("scan_matching", seed) for seed in SEEDS)


def test_particles_err_less_than_one_hypothesis_where_a_loop_closes():
    assert share_of_one_hypothesis() < 0.75  # measured: 0.57


def test_but_not_where_the_robot_never_goes_by_another_particle(monkeypatch):
    monkeypatch.setattr(particle_filter, "_DECISIVE", np.inf)
    with pytest.raises(AssertionError):
        test_particles_err_less_than_one_hypothesis_where_a_loop_closes()


def share_of_a_graph():
    def graph_m(seed):
        log, poses = once_around(seed)
        trial = play_localization(localization_for_logs("pose_graph", {})(), log,
                                  SlamSettings(laser=log.laser), Streams(seed), lambda: 0.0)
        return error_of(trial.path[trial.processed], poses[trial.processed])

    return sum(graph_m(seed) for seed in SEEDS) / one_hypothesis_m()


def test_a_graph_closes_loops_of_220_m():
    assert share_of_a_graph() < 0.75  # measured: 0.53


def test_but_not_without_closures(monkeypatch):
    monkeypatch.setattr(ClosureFinder, "found", lambda *_: iter(()))
    assert share_of_a_graph() > 1.0


def long_way_round_m():
    """The error on a ring of 310 m, the third of them: the gap is wider than what is searched where
    a place is well known."""
    log, poses = once_around(3, 85.0, 70.0)
    trial = play_localization(localization_for_logs("pose_graph", {})(), log,
                              SlamSettings(laser=log.laser), Streams(3), lambda: 0.0)
    return error_of(trial.path[trial.processed], poses[trial.processed])


def test_a_loop_of_310_m_closes():
    assert long_way_round_m() < 0.4  # measured: 0.25


def test_but_not_where_a_long_way_leaves_no_doubt(monkeypatch):
    monkeypatch.setattr(closures, "_DRIFT", 0.0)
    with pytest.raises(AssertionError):
        test_a_loop_of_310_m_closes()


def agreeing(turn_rad):
    """Two closures between the sides of a path of 40 m there and 40 m back beside it; the second
    one is off by ``turn_rad``."""
    fleet = FleetGraph()
    for step in [(1.0, 0.0, 0.0)] * 41 + [(0.0, 1.0, np.pi)] + [(1.0, 0.0, 0.0)] * 40:
        fleet.add("robot", 0, np.array(step), np.eye(3), None)
    path = fleet.path("robot")
    first, second = (Closure(own, "robot", theirs, motion_between(path[theirs], path[own])
                             + (3.0, 0.0, 0.0), np.eye(3)) for own, theirs in ((50, 32), (60, 22)))
    second.motion[2] += turn_rad
    return closures.agree(first, second, path, path)


def test_closures_agree_where_both_paths_say_the_same_of_the_way_between_them():
    assert agreeing(0.01)


def test_but_not_where_one_of_them_is_turned():
    assert not agreeing(0.2)
