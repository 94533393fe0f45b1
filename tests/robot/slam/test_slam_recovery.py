"""A made log, with a known way and known noise, is recovered; a broken model recovers nothing."""

from functools import cache

import numpy as np
import pytest
from slam_logs import Laser, made_log, ring, way

from desim.engine.streams import Streams
from desim.imports.slam_logs.slam_trial import play
from desim.ports import Pose2D
from desim.robot.slam.kinds import SLAM
from desim.robot.slam.settings import SlamSettings
from desim.robot.transforms import motion_between

CORRIDOR, WIDTH, HEIGHT = 2.5, 14.0, 10.0
LASERS = {"sick": Laser(), "wide": Laser(270, 270.0), "coarse": Laser(61, 240.0, 12.0, 0.02)}
BOUND_M = {"sick": 0.1, "wide": 0.1, "coarse": 0.25}  # beams 4 degrees apart, twice the noise


@cache
def log_of(name):
    """A way once around a block, and a little farther. The odometry is 1 m and 1 rad off then."""
    near, right, top = CORRIDOR / 2, WIDTH - CORRIDOR / 2, HEIGHT - CORRIDOR / 2
    poses = way([(near, near), (right, near), (right, top), (near, top), (near, near),
                 (right, near)])
    return made_log(ring(WIDTH, HEIGHT, CORRIDOR), poses, LASERS[name]), poses


def slam_of(name, log, **settings):
    return SLAM[name](SlamSettings(laser=log.laser, **settings), Streams(1).key("slam"))


def off(path, true):
    """The mean distance in m and rad of a path from the true one, from its first pose on."""
    error = motion_between(motion_between(true[:1], true), motion_between(path[:1], path))
    return np.hypot(error[:, 0], error[:, 1]).mean(), np.abs(error[:, 2]).mean()


@pytest.mark.parametrize("name", SLAM)
@pytest.mark.parametrize("laser", LASERS)
@pytest.mark.parametrize("resolution_m", [0.05, 0.2])
def test_a_way_around_a_block_is_recovered(name, laser, resolution_m):
    log, true = log_of(laser)
    trial = play(slam_of(name, log, resolution_m=resolution_m), log, lambda: 0.0)
    metres, radians = off(trial.path, true)
    assert metres < BOUND_M[laser] and radians < 0.02


def test_odometry_alone_recovers_nothing():
    log, true = log_of("sick")
    metres, radians = off(log.odometry, true)
    assert metres > 0.5 and radians > 0.2


@pytest.mark.parametrize("broken", ["turned", "scaled", "mirrored"])
def test_a_broken_model_of_the_laser_recovers_nothing(broken):
    log, true = log_of("sick")
    laser = log.laser
    log = log._replace(**{
        "turned": {"laser": laser._replace(angle_min_rad=laser.angle_min_rad + 0.3)},
        "scaled": {"laser": laser._replace(increment_rad=0.9 * laser.increment_rad)},
        "mirrored": {"ranges": log.ranges[:, ::-1]}}[broken])
    metres, radians = off(play(slam_of("scan_matching", log), log, lambda: 0.0).path, true)
    assert metres > 0.1 or radians > 0.02


def test_a_laser_beside_the_middle_of_the_robot_is_its_mount():
    log, true = log_of("wide")
    mount = np.array([0.2, -0.1, 0.5])
    robot = motion_between(np.array([*-_turned(mount), -mount[2]]), np.zeros(3))
    assert np.allclose(robot, mount)
    slam = SLAM["scan_matching"](SlamSettings(laser=log.laser._replace(mount=Pose2D(*mount))),
                                 Streams(1).key("slam"))
    centre = _behind(log.odometry, mount)
    path = play(slam, log._replace(odometry=centre), lambda: 0.0).path
    metres, radians = off(path, _behind(true, mount))
    assert metres < 0.1 and radians < 0.02


def _turned(mount):
    """The place of the robot's middle as seen from the laser, without its sign."""
    c, s = np.cos(mount[2]), np.sin(mount[2])
    return np.array((c * mount[0] + s * mount[1], c * mount[1] - s * mount[0]))


def _behind(poses, mount):
    """The poses of the robot whose laser has ``poses``."""
    yaw = poses[:, 2] - mount[2]
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack((poses[:, 0] - c * mount[0] + s * mount[1],
                     poses[:, 1] - s * mount[0] - c * mount[1], yaw), axis=-1)


def test_a_scan_is_processed_after_enough_motion():
    log, _ = log_of("sick")
    slam = slam_of("scan_matching", log)
    processed = np.flatnonzero([slam.update(log.odometry[k], log.ranges[k]) for k in range(60)])
    # 0.103 m a scan: the tenth after the last one is the first that is 1 m farther.
    assert processed.tolist() == [0, 10, 20, 30, 40, 50]


@pytest.mark.parametrize("name", SLAM)
def test_scans_may_be_few(name):
    log, true = log_of("sick")
    few = log._replace(times_s=log.times_s[::7], odometry=log.odometry[::7],
                       ranges=np.ascontiguousarray(log.ranges[::7]))
    metres, radians = off(play(slam_of(name, few), few, lambda: 0.0).path, true[::7])
    assert metres < 0.1 and radians < 0.02


def test_odometry_that_fails_once_does_not_spoil_the_path():
    log, true = log_of("sick")
    odometry = log.odometry.copy()
    odometry[100:, 0] += 0.45
    path = play(slam_of("scan_matching", log), log._replace(odometry=odometry), lambda: 0.0).path
    metres, radians = off(path, true)
    assert metres < 0.1 and radians < 0.02


def test_scans_without_a_return_are_odometry():
    log, _ = log_of("sick")
    blind = log._replace(ranges=np.full_like(log.ranges, log.laser.longest_m)).first(100)
    for name in SLAM:
        slam = slam_of(name, log, particles=2)
        path = play(slam, blind, lambda: 0.0).path
        metres, _ = off(path, blind.odometry)
        assert metres < (1e-6 if name == "scan_matching" else 2.0)


def test_the_map_is_that_of_the_building():
    log, true = log_of("sick")
    slam = slam_of("scan_matching", log)
    grid = play(slam, log, lambda: 0.0).map
    rows, columns = np.nonzero(grid.occupancy >= 50)
    x = grid.origin_m[0] + (columns + 0.5) * 0.05
    y = grid.origin_m[1] + (rows + 0.5) * 0.05
    start = true[0]  # the map's frame is that of the first odometry
    c, s = np.cos(start[2]), np.sin(start[2])
    x, y = start[0] + c * x - s * y, start[1] + s * x + c * y
    walls = ring(WIDTH, HEIGHT, CORRIDOR)
    ax, ay, bx, by = walls.T[:, :, None]
    along = np.clip(((x - ax) * (bx - ax) + (y - ay) * (by - ay))
                    / ((bx - ax) ** 2 + (by - ay) ** 2), 0.0, 1.0)
    away = np.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay)).min(0)
    assert np.median(away) < 0.04 and np.quantile(away, 0.95) < 0.1
    inside = grid.occupancy[int((0 - grid.origin_m[1]) / 0.05), int((0 - grid.origin_m[0]) / 0.05)]
    assert inside == 0
