"""The node that finds the robot's pose and draws its map at once, by SLAM."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from desim.engine.trace import bits
from desim.middleware.contents import Empty, LaserScan, Pose
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import Latest
from desim.ports import Pose2D
from desim.robot.mapping import PATIENCE_NS
from desim.robot.poses import between
from desim.robot.robot_map import RobotMap
from desim.robot.slam.localizations import SLAM
from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.slam.settings import OdometryNoise, ScannerGeometry, SlamSettings
from desim.robot.slam.transforms import compose, motion_between, wrapped
from desim.scenario.schema.robot import Equipment, Odometry
from desim.units import NS_PER_S

_REDRAWN_RAD = 0.01  # a turn of a pose that is worth a new drawing: 0.25 m at 25 m; a shift: a cell


class SlamNode(Node):
    """Publishes ``pose`` with each message of ``odom``: the pose of the last processed scan, moved
    on by the odometry since. Draws processed scans into ``robot_map``, and draws it anew where the
    most likely path has changed.

    ``start`` is the robot's pose in the map, as its launch file has it. None, after a restart: the
    first message of ``odom`` is taken at its word. ``bodies_m``: the width of the widest teammate,
    0 without one. The event ``map`` announces each change of the map to other nodes of the host.
    """

    def __init__(self, host: Host, robot: Equipment, robot_map: RobotMap, start: Pose2D | None,
                 bodies_m: float) -> None:
        super().__init__(host, "slam")
        self.robot_map = robot_map
        self._robot, self._usable_m = robot, robot.mapping.usable_range_m
        self._slam: ParticleSlam = SLAM[robot.localization](settings_of(robot, bodies_m),
                                                            self.noise_key("particles"))
        self._scan = Latest(host)
        self._odometry: Pose | None = None  # the latest
        self._start = None if start is None else np.array(start)
        self._placed_at: np.ndarray | None = None  # the odometry of the last scan that was placed
        self._readings = 0  # of the odometer, since then
        self._placed_ns = -PATIENCE_NS  # stamp of the last odometry that had a scan
        self._drawn: list[np.ndarray] = []  # the poses of the scans in the map
        self._scans: list[LaserScan] = []

    def start(self) -> None:
        self.advertise("pose")
        self.advertise("map")
        self._scan = self.latest("scan")
        self.subscribe("odom", self._on_odometry)
        self.timer(Fraction(NS_PER_S, self._robot.slam.redraw_every_ns), self._redraw)

    def _on_odometry(self, message: Message) -> None:
        before, odometry = self._odometry, message.content
        self._odometry = odometry
        self._readings += 1
        if self._start is None:
            self._start = np.array(odometry[1:])
        scan, at = self._scan.message, None
        if scan is not None:
            at = self._odometry_at(scan.born_ns, before, odometry)
        if scan is not None and at is not None:
            self._placed_at = np.array(at[1:])
            is_due = self._slam.advance(self._placed_at, self._readings)
            self._readings = 0
            if is_due:
                self._process(scan.content)
        pose = np.array(odometry[1:])
        if self._placed_at is not None:
            pose = compose(self._pose(), motion_between(self._placed_at, pose))
        x_m, y_m, yaw_rad = pose.tolist()
        if before is None or before.stamp_ns // NS_PER_S < odometry.stamp_ns // NS_PER_S:
            self.record("believed", bits(x_m), bits(y_m), bits(yaw_rad))
        self.publish("pose", Pose(odometry.stamp_ns, x_m, y_m, math.remainder(yaw_rad, math.tau)))

    def _odometry_at(self, stamp_ns: int, before: Pose | None, odometry: Pose) -> Pose | None:
        """The odometry of the instant of a scan, None if there is none of it (yet). As in
        ``Mapping``, poses are interpolated only where the rates have no common instants."""
        if stamp_ns == odometry.stamp_ns:
            self._placed_ns = stamp_ns
            return odometry
        if (before is not None and odometry.stamp_ns - self._placed_ns > PATIENCE_NS
                and before.stamp_ns <= stamp_ns <= odometry.stamp_ns):
            return between(before, odometry, stamp_ns)
        return None

    def _process(self, scan: LaserScan) -> None:
        """Match a scan, and draw it into the map."""
        self._slam.process(scan.ranges)
        pose = self._pose()
        x_m, y_m, yaw_rad = pose.tolist()
        self.record("localized", bits(x_m), bits(y_m), bits(yaw_rad))
        self._drawn.append(pose)
        self._scans.append(scan)
        version = self.robot_map.version
        self.robot_map.integrate_scan(x_m, y_m, yaw_rad, scan, self._usable_m)
        if self.robot_map.version != version:
            self.publish("map", Empty())

    def _pose(self) -> np.ndarray:
        """[3] the most likely pose in the map's frame, at the last scan that was placed."""
        return self._in_map(self._slam.pose)

    def _in_map(self, poses: np.ndarray) -> np.ndarray:
        """Poses that SLAM gives as seen from the start."""
        assert self._start is not None
        return compose(self._start, poses)

    def _redraw(self, _: int) -> None:
        """Draw the map anew if the most likely path is another one than that in the map."""
        if not self._drawn:
            return
        path = self._in_map(self._slam.path())
        drawn = np.array(self._drawn)
        shift_m = np.abs(path[:, :2] - drawn[:, :2]).max()
        turn_rad = np.abs(wrapped(path[:, 2] - drawn[:, 2])).max()
        if shift_m < self.robot_map.spec.resolution_m and turn_rad < _REDRAWN_RAD:
            return
        self.record("map_redrawn", len(path))
        self.display("path", path[:, :2])
        self._drawn = list(path)
        self.robot_map.redraw_own(zip(path, self._scans, strict=True), self._usable_m)
        self.publish("map", Empty())


def settings_of(robot: Equipment, bodies_m: float) -> SlamSettings:
    """The settings of SLAM for a robot's laser, odometry and map, among bodies of this width."""
    laser, mapping = robot.scanner, robot.mapping
    return SlamSettings(
        particles=robot.slam.particles, resolution_m=mapping.resolution_m,
        linear_update_m=mapping.linear_update_m, angular_update_rad=mapping.angular_update_rad,
        noise=_NOISE[robot.odometry.model](robot.odometry),
        scanner=ScannerGeometry(-0.5 * laser.field_of_view_rad,
                                laser.field_of_view_rad / (laser.beams - 1),
                                longest_m=min(laser.max_range_m, mapping.usable_range_m),
                                bodies_m=bodies_m))


def _independent(odometry: Odometry) -> OdometryNoise:
    """The noise of two readings. It does not drift: drawn in full, it would become a drift."""
    two = math.sqrt(2.0)
    return OdometryNoise(0.0, 0.0, 0.0, 0.0, two * odometry.position_noise_m,
                         two * odometry.heading_noise_rad, strayed=math.inf, spread=0.3)


def _random_walk(odometry: Odometry) -> OdometryNoise:
    """The noise of all readings since."""
    return OdometryNoise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, odometry.position_noise_m,
                         odometry.heading_noise_rad, strayed=math.inf)


_NOISE = {"independent": _independent, "random_walk": _random_walk}
