"""Drivers: nodes that publish what sensors see and apply commands to motors.

In ``testbed`` one of them sits on the workstation and serves every robot, as the simulator of the
paper does; in ``field`` each robot's computer runs one for its own body. The monitor's node is here
too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from desim.middleware.contents import ODOMETRY_BYTES, LaserScan, Lazy, Pose, laser_scan_bytes
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import Latest, Publisher, WaitSet
from desim.ports import Snapshot, World
from desim.scenario.schema.robot import Laser


class Driver(Node):
    """Sensors and motors of ``robots`` (indices into ``world.robots``)."""

    def __init__(self, host: Host, world: World, robots: Sequence[int], laser: Laser) -> None:
        super().__init__(host, "driver")
        self.robots = tuple(robots)
        self._world = world
        self._laser = laser
        self._scan_bytes = laser_scan_bytes(laser.beams)
        self._increment_rad = laser.field_of_view_rad / (laser.beams - 1)
        self._alone = {i: np.array([i]) for i in self.robots}
        self._scans: list[tuple[int, Publisher]] = []
        self._poses: list[tuple[Publisher, Callable[[Snapshot, int], Pose]]] = []
        self._motors: dict[Latest, int] = {}  # the robot of each topic of velocities
        self._commands = WaitSet()

    def start(self) -> None:
        for robot in self.robots:
            prefix = f"/{self._world.robots[robot]}"
            self._scans.append((robot, self.advertise(f"{prefix}/scan")))
            self._poses.append((self.advertise(f"{prefix}/odom"), partial(self._odometry, robot)))
            self._poses.append((self.advertise(f"{prefix}/true_pose"), partial(_true_pose, robot)))
            self._motors[self.latest(f"{prefix}/cmd_vel", self._commands)] = robot

    def sense_scan(self, snapshot: Snapshot, tick: int) -> None:
        """Publish scan number ``tick`` of every robot; the beams are cast when somebody reads."""
        for robot, publisher in self._scans:
            if publisher.has_subscribers():
                publisher.publish(Lazy(self._scan_bytes,
                                       partial(self._scan, snapshot, robot, tick)))

    def sense_pose(self, snapshot: Snapshot, tick: int) -> None:
        """Publish odometry reading number ``tick`` and the true pose of every robot."""
        for publisher, read in self._poses:
            if publisher.has_subscribers():
                publisher.publish(Lazy(ODOMETRY_BYTES, partial(read, snapshot, tick)))

    def _scan(self, snapshot: Snapshot, robot: int, tick: int) -> LaserScan:
        ranges = self._world.scan(snapshot, self._alone[robot], tick)[0]
        return LaserScan(snapshot.time_ns, ranges, -0.5 * self._laser.field_of_view_rad,
                         self._increment_rad, self._laser.max_range_m)

    def _odometry(self, robot: int, snapshot: Snapshot, tick: int) -> Pose:
        x_m, y_m, yaw_rad = self._world.odometry(snapshot, robot, tick)
        return Pose(snapshot.time_ns, float(x_m), float(y_m), float(yaw_rad))

    def drive(self) -> None:
        """Pass on the velocities that have come since the last call."""
        for latest, message in self._commands.news():
            twist = message.content
            self._world.command(self._motors[latest], twist.forward_mps, twist.left_mps,
                                twist.turn_radps)


class MonitorNode(Node):
    """Subscribes to every robot's explored map and travelled distance.

    The traffic between controllers and monitor ends here: it is counted and timed like any other.
    The verdict on the run does not depend on it: the monitor itself watches out of band, so that no
    load can delay it.
    """

    def __init__(self, host: Host, robots: tuple[str, ...]) -> None:
        super().__init__(host, "monitor")
        self._robots = robots

    def start(self) -> None:
        for robot in self._robots:
            self.subscribe(f"/{robot}/explored_map", self._received)
            self.subscribe(f"/{robot}/distance", self._received)

    def _received(self, message: Message) -> None:
        """Do nothing: the arrival is in the trace."""


def _true_pose(robot: int, snapshot: Snapshot, tick: int) -> Pose:
    x_m, y_m, yaw_rad = snapshot.poses[robot].tolist()
    return Pose(snapshot.time_ns, x_m, y_m, yaw_rad)
