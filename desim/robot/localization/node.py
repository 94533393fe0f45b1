"""The node that runs a localization plug-in and publishes the pose that it estimates."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from desim.engine.trace import bits
from desim.middleware.contents import EMPTY, LaserScan, Pose
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription
from desim.ports import Pose2D
from desim.ports.computers import Keeps
from desim.ports.localization import Localization, LocalizationTraits
from desim.robot.localization.checks import (
    checked_path,
    checked_pose,
    drawable,
    writes_checked,
)
from desim.robot.localization.context import SensorContext
from desim.robot.mapping.node import PATIENCE_NS
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.stamped_poses import between
from desim.robot.transforms import wrapped
from desim.scenario.schema.robot import SCAN, Equipment
from desim.units import NS_PER_S

_REDRAWN_RAD = 0.01  # a turn of a pose that is worth a new drawing: 0.25 m at 25 m; a shift: a cell


class UnreadScan:
    """A scan with the odometry of its instant; see ``ScanWithOdometry``."""

    def __init__(self, message: Message, odometry: Pose2D) -> None:
        self._message, self.odometry = message, odometry

    @property
    def content(self) -> LaserScan:
        """The scan with its angles."""
        return self._message.content

    @property
    def ranges(self) -> np.ndarray:
        """[beams] m."""
        return self.content.ranges


class LocalizationNode(Node):
    """Publishes the plug-in's ``pose`` for each message of ``odom``. A plug-in that draws the map
    (SLAM) draws it into ``robot_map``; the event ``map`` announces each change to other nodes of
    the host.

    ``start`` is the robot's pose in the map where it is known, ``bodies_m`` the width of the widest
    teammate, 0 without one, ``team`` the names of those that share its frame, ``strangers`` of
    those that do not.
    """

    _topic = "pose"

    def __init__(self, host: Host, localization: Localization, robot: Equipment,
                 robot_map: RobotMap, start: Pose2D | None, bodies_m: float,
                 team: tuple[str, ...] = (), strangers: tuple[str, ...] = (),
                 namespace: str | None = None) -> None:
        self.draws_map = LocalizationTraits.of(localization).draws_map
        super().__init__(host, "slam" if self.draws_map else "localization", namespace)
        self.localization, self.robot_map = localization, robot_map
        self.team, self.strangers = team, strangers
        self._keeper = localization if isinstance(localization, Keeps) else None
        self._usable_m = robot.mapping.usable_range_m
        self._context = SensorContext(self, robot, start, bodies_m)
        self._scan: PolledSubscription
        self._topics = tuple(robot.lasers_by_topic)[1:]
        self._others: list[PolledSubscription] = []  # of the lasers beside the first
        self._odometry: Pose | None = None  # the latest
        self._placed_ns = -PATIENCE_NS  # stamp of the last odometry that had a scan
        self._undrawn: UnreadScan | None = None  # the scan that may be drawn now
        self._drawn: list[Pose2D] = []  # the poses of the scans in the map
        self._scans: list[tuple[LaserScan, ...]] = []  # of each pose, the first laser's first

    def start(self) -> None:
        self.advertise(self._topic)
        if self.draws_map:
            self._advertise_map()
            self._others = [self.latest(topic) for topic in self._topics]
        self._scan = self.latest(SCAN)
        self.subscribe("odom", self._on_odometry)
        self.localization.start(self._context)

    def kept(self) -> dict[str, int]:
        """See ``Node.kept``: the map that it publishes, and what the plug-in keeps."""
        cells = {"cells": self.robot_map.spec.cells if self.draws_map else 0}
        return cells if self._keeper is None else {**cells, **self._keeper.kept()}

    def _on_odometry(self, message: Message) -> None:
        before, odometry = self._odometry, message.content
        self._odometry = odometry
        scan, self._undrawn = self._scan.read(), None
        at = None if scan is None else self._odometry_at(scan.stamp_ns, before, odometry)
        if scan is not None and at is not None:
            self._undrawn = UnreadScan(scan, Pose2D(*at[1:]))
        with writes_checked(self.localization):
            given = self.localization.on_odometry(self._context, Pose2D(*odometry[1:]),
                                                  self._undrawn)
        pose = checked_pose(self.localization, given)
        self._publish(before, odometry, Pose2D(*map(float, pose)))

    def _publish(self, before: Pose | None, odometry: Pose, pose: Pose2D) -> None:
        """Publish ``pose``, at the instant of ``odometry``; ``before``: the odometry before it."""
        publish_pose(self, before, odometry.stamp_ns, pose)

    def _odometry_at(self, stamp_ns: int, before: Pose | None, odometry: Pose) -> Pose | None:
        """The odometry at the instant of a scan; None if there is none, or not yet. As in
        ``Mapping``, it is interpolated only if the rates have no common instants."""
        if stamp_ns == odometry.stamp_ns:
            self._placed_ns = stamp_ns
            return odometry
        if (before is not None and odometry.stamp_ns - self._placed_ns > PATIENCE_NS
                and before.stamp_ns <= stamp_ns <= odometry.stamp_ns):
            return between(before, odometry, stamp_ns)
        return None

    def draw(self, scan: object, pose: Pose2D) -> None:
        """See ``LocalizationContext.draw``."""
        undrawn = drawable(self.localization, scan, self._undrawn, pose)
        self._undrawn = None
        x_m, y_m, yaw_rad = map(float, pose)
        self.record("localized", bits(x_m), bits(y_m), bits(yaw_rad))
        self._drawn.append(Pose2D(x_m, y_m, yaw_rad))
        scans = undrawn.content, *self._companions(undrawn.content.stamp_ns)
        self._scans.append(scans)
        version = self.robot_map.version
        for each in scans:
            self.robot_map.integrate_scan(x_m, y_m, yaw_rad, each, self._usable_m)
        if self.robot_map.version != version:
            self._announce_map()

    def record_closure(self, source: str, theirs: int, own: int, motion: np.ndarray) -> None:
        """See ``LocalizationContext.closed``."""
        self.record("closed", self._graph.names.id(source), theirs, own)
        self.record("closed_at", *map(bits, motion.tolist()))

    def _advertise_map(self) -> None:
        """Allow the map to be published from now on."""
        self.advertise("map")

    def _announce_map(self) -> None:
        """Publish that the map has changed."""
        self.publish("map", EMPTY)

    def _companions(self, stamp_ns: int) -> Iterator[LaserScan]:
        """The scans of the same instant of the lasers beside the first."""
        messages = (other.read() for other in self._others)
        return (message.content for message in messages
                if message is not None and message.stamp_ns == stamp_ns)

    def redraw(self, poses: np.ndarray) -> None:
        """See ``LocalizationContext.redraw``."""
        path = checked_path(self.localization, poses, len(self._drawn))
        spec = self.robot_map.spec  # gmapping makes its map anew each time, moved or not
        self.worked(scans=len(path), cells=spec.width * spec.height)
        if not self._drawn:
            return
        drawn = np.array(self._drawn)
        shift_m = np.abs(path[:, :2] - drawn[:, :2]).max()
        turn_rad = np.abs(wrapped(path[:, 2] - drawn[:, 2])).max()
        if shift_m < self.robot_map.spec.resolution_m and turn_rad < _REDRAWN_RAD:
            return
        self.record("map_redrawn", len(path))
        self.display("path", path[:, :2])
        self._drawn = [Pose2D(*pose) for pose in path.tolist()]
        self.robot_map.redraw_own(
            [(pose, scan) for pose, scans in zip(path, self._scans, strict=True)
             for scan in scans], self._usable_m)
        self._announce_map()


def publish_pose(node: Node, before: Pose | None, stamp_ns: int, pose: Pose2D) -> None:
    """Have ``node`` publish ``pose`` as the robot's pose, and record it once a second; ``before``:
    the odometry of the pose before."""
    x_m, y_m, yaw_rad = pose
    if before is None or before.stamp_ns // NS_PER_S < stamp_ns // NS_PER_S:
        node.record("believed", bits(x_m), bits(y_m), bits(yaw_rad))
    node.publish("pose", Pose(stamp_ns, x_m, y_m, math.remainder(yaw_rad, math.tau)))
