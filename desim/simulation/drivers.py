"""Drivers: nodes that publish what sensors see and apply commands to motors.

In ``testbed`` one of them sits on the workstation and serves every robot, as the simulator of the
paper does; in ``field`` each robot's computer runs one for its own body.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from desim.middleware.batches import BatchPublisher
from desim.middleware.contents import ODOMETRY_BYTES, LaserScan, Pose, laser_scan_bytes
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.middleware.topics import Latest, WaitSet
from desim.ports import Snapshot, World
from desim.scenario.schema.robot import Laser


class Driver(Node):
    """Sensors and motors of ``robots`` (indices into ``world.robots``)."""

    def __init__(self, host: Host, world: World, robots: Sequence[int], laser: Laser) -> None:
        super().__init__(host, "driver")
        self.robots = tuple(robots)
        self._world = world
        self._laser = laser
        self._increment_rad = laser.field_of_view_rad / (laser.beams - 1)
        self._alone = {i: np.array([i]) for i in self.robots}
        self._motors: dict[Latest, int] = {}  # the robot of each topic of velocities
        self._commands = WaitSet()

    def start(self) -> None:
        scans, poses = [], []
        for robot in self.robots:
            prefix = f"/{self._world.robots[robot]}"
            scans.append(self.advertise(f"{prefix}/scan"))
            poses.append(self.advertise(f"{prefix}/odom"))
            poses.append(self.advertise(f"{prefix}/true_pose"))
            self._motors[self.latest(f"{prefix}/cmd_vel", self._commands)] = robot
        self._scans = BatchPublisher(scans, laser_scan_bytes(self._laser.beams))
        self._poses = BatchPublisher(poses, ODOMETRY_BYTES)

    def sense_scan(self, snapshot: Snapshot, tick: int) -> None:
        """Publish scan number ``tick`` of every robot; the beams are cast when somebody reads."""
        self._scans.publish(partial(self._scan, snapshot, tick))

    def sense_pose(self, snapshot: Snapshot, tick: int) -> None:
        """Publish odometry reading number ``tick`` and the true pose of every robot."""
        self._poses.publish(partial(self._pose, snapshot, tick))

    def _scan(self, snapshot: Snapshot, tick: int, number: int) -> LaserScan:
        ranges = self._world.scan(snapshot, self._alone[self.robots[number]], tick)[0]
        return LaserScan(snapshot.time_ns, ranges, -0.5 * self._laser.field_of_view_rad,
                         self._increment_rad, self._laser.max_range_m)

    def _pose(self, snapshot: Snapshot, tick: int, number: int) -> Pose:
        """Of each robot its odometer's, then its true one."""
        robot = self.robots[number // 2]
        if number % 2:
            x_m, y_m, yaw_rad = snapshot.poses[robot].tolist()
        else:
            x_m, y_m, yaw_rad = map(float, self._world.odometry(snapshot, robot, tick))
        return Pose(snapshot.time_ns, x_m, y_m, yaw_rad)

    def drive(self) -> None:
        """Pass on the velocities that have come since the last call."""
        for latest, message in self._commands.news():
            twist = message.content
            self._world.command(self._motors[latest], twist.forward_mps, twist.left_mps,
                                twist.turn_radps)
