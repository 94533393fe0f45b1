"""A plug-in of localization on a log gets what the contract promises."""

import numpy as np
import pytest
from slam_logs import SICK, made_log, ring, way

from desim.engine.streams import Streams
from desim.errors import ModelError
from desim.imports.slam_logs.localization_trial import play_localization
from desim.imports.slam_logs.log_robot import LogRobot
from desim.imports.slam_logs.slam_trial import play
from desim.ports import Pose2D
from desim.ports.localization import LocalizationTraits
from desim.robot.localization.kinds.odometry import DeadReckoning
from desim.robot.localization.kinds.scan_matching import ScanMatching
from desim.robot.slam.kinds import scan_matching
from desim.robot.slam.settings import SlamSettings


@pytest.fixture(scope="module")
def log():
    return made_log(ring(14.0, 10.0, 2.5), way([(1.2, 1.2), (12.8, 1.2), (12.8, 8.8)]))


@pytest.fixture(scope="module")
def settings(log):
    return SlamSettings(laser=log.laser)


def trial(localization, log, settings):
    return play_localization(localization, log, settings, Streams(1), lambda: 0.0)


def new(cls):
    return cls(cls.Params())


def test_scan_matching_is_the_same_with_and_without_the_contract(log, settings):
    as_plugin = trial(new(ScanMatching), log, settings)
    alone = play(scan_matching(settings, Streams(1).key("slam")), log, lambda: 0.0)
    assert (as_plugin.processed == alone.processed).all()
    assert np.allclose(as_plugin.online, alone.online, atol=1e-9)
    assert np.allclose(as_plugin.path[alone.processed], alone.path[alone.processed], atol=0.06)
    assert (as_plugin.map.occupancy == 100).any()


def test_dead_reckoning_is_the_odometry(log, settings):
    found = trial(new(DeadReckoning), log, settings)
    assert (found.online == log.odometry).all() and (found.path == log.odometry).all()
    assert found.processed[0] and 15 < found.processed.sum() < 30
    ways = np.diff(np.flatnonzero(found.processed))
    assert ways.max() <= 12  # 1 m, of steps of 0.1 m that are 3 % too long, or turns


class Noting:
    """Draws the first three scans, and shifts them all at the last scan."""

    traits = LocalizationTraits(draws_map=True)

    def __init__(self, scans):
        self.scans, self.seen, self.called_ns = scans, [], []

    def start(self, context):
        self.given = (context.name, context.start, context.odometry_errors, context.bodies_m,
                      context.laser, context.map, context.now_ns)
        context.every(1_000_000_000, lambda context: self.called_ns.append(context.now_ns))

    def on_odometry(self, context, odometry, sighting):
        self.seen.append((context.now_ns, odometry, sighting))
        if len(self.seen) <= 3:
            context.draw(sighting, odometry)
        if len(self.seen) == self.scans:
            context.redraw(np.array([seen[1] for seen in self.seen[:3]]) + (1.0, 2.0, 0.0))
        return odometry


def test_a_plug_in_is_given_the_log(log, settings):
    noting = Noting(len(log.times_s))
    found = trial(noting, log, settings)
    name, start, errors, bodies_m, laser, drawn, began_ns = noting.given
    assert (name, start, errors, bodies_m, began_ns) == ("robot", None, None, 0.0, 0)
    assert laser == (SICK.geometry.angle_min_rad, SICK.geometry.increment_rad, 30.0,
                     SICK.geometry.shortest_m, (0.0, 0.0, 0.0))
    assert drawn == (0.05, 1.0, 0.5, 30.0)
    assert [now_ns for now_ns, _, _ in noting.seen] == [
        200_000_000 * k for k in range(len(log.times_s))]
    for (_, odometry, sighting), place, ranges in zip(noting.seen, log.odometry, log.ranges,
                                                      strict=True):
        assert odometry == sighting.odometry == tuple(place)
        assert (sighting.ranges == ranges).all() and not sighting.ranges.flags.writeable
    assert np.flatnonzero(found.processed).tolist() == [0, 1, 2]
    off = found.path - (log.odometry + (1.0, 2.0, 0.0))
    assert np.allclose(off[:3], 0.0)
    assert 0.0 < np.hypot(off[3:, 0], off[3:, 1]).max() < 1.5  # aligned, near where it drove
    assert (found.online == log.odometry).all()


def test_a_timer_is_called_once_however_long_the_log_was_silent(log, settings):
    noting = Noting(0)
    gap = log._replace(times_s=log.times_s + 1e9 * (np.arange(len(log.times_s)) >= 100))
    trial(noting, gap, settings)
    called_s = np.array(noting.called_ns) / 1e9
    assert len(called_s) == pytest.approx(log.times_s[-1], abs=2)
    assert (np.diff(called_s) >= 0.8).all()  # scans come every 0.2 s


def test_a_clock_that_goes_back_stands(log, settings):
    noting = Noting(0)
    trial(noting, log._replace(times_s=log.times_s[::-1]), settings)
    assert {now_ns for now_ns, _, _ in noting.seen} == {0}


class Twice(Noting):
    def on_odometry(self, context, odometry, sighting):
        context.draw(sighting, odometry)
        context.draw(sighting, odometry)


class Undeclared(Noting):
    traits = LocalizationTraits()


class Short(Noting):
    def on_odometry(self, context, odometry, sighting):
        context.draw(sighting, odometry)
        context.redraw(np.zeros((2, 3)))


class Nowhere(Noting):
    def on_odometry(self, context, odometry, sighting):
        return Pose2D(0.0, float("nan"), 0.0)


class Away(Noting):
    def on_odometry(self, context, odometry, sighting):
        context.draw(sighting, (0.0, 0.0, 0.0))


@pytest.mark.parametrize("cls, says", [
    (Twice, "draws something else than the scan that has just come, or that twice; wanted: that "),
    (Undeclared, "draws a scan; wanted: traits = LocalizationTraits.draws_map=True. in its class"),
    (Short, r"draws the map anew with float64 \[2, 3\]; wanted: finite poses \[1, 3\]"),
    (Nowhere, "returned Pose2D.*nan.* in on_odometry; wanted: a Pose2D of three finite numbers"),
    (Away, r"draws a scan from \(0.0, 0.0, 0.0\); wanted: a Pose2D of three finite numbers"),
])
def test_who_breaks_the_contract_is_named(log, settings, cls, says):
    robot = LogRobot(cls(0), settings, Streams(1))
    with pytest.raises(ModelError, match=f"{cls.__name__} .*{says}"):
        robot.read(0.0, log.odometry[0], log.ranges[0])
