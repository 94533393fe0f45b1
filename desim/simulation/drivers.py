"""Drivers: nodes that publish what sensors see and apply commands to motors.

In ``testbed`` one of them sits on the workstation and serves every robot, as the simulator of the
paper does; in ``field`` each robot's computer runs one for its own body.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np

from desim.middleware.batches.publisher import BatchPublisher
from desim.middleware.contents import (
    ODOMETRY_BYTES,
    Bump,
    LaserScan,
    Lazy,
    Pose,
    SonarReadings,
    laser_scan_bytes,
    point_cloud_bytes,
)
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription, Publisher, WaitSet
from desim.ports import Snapshot, World
from desim.robot.declared_traffic import Copied
from desim.scenario.schema.robot import Equipment, Laser, Sonar
from desim.scenario.schema.scenario import SubscribingProcesses

Sensor = tuple[int, int]  # a robot, and the number of its sensor of one sort

_new = tuple.__new__  # a named tuple at half the price


class Readings(NamedTuple):
    """The publishers of readings of one kind, as one; the i-th is that of ``sensors[i]``."""

    sensors: tuple[Sensor, ...]
    publisher: BatchPublisher

    @classmethod
    def of(cls, publishers: list[tuple[Sensor, Publisher]], size_bytes: int) -> Readings:
        """The readings, of ``size_bytes`` each, of pairs of a sensor and its publisher."""
        return cls(tuple(sensor for sensor, _ in publishers),
                   BatchPublisher([publisher for _, publisher in publishers], size_bytes))


def kinds_of_lasers(equipment: Iterable[Equipment]) -> tuple[Laser, ...]:
    """The different lasers of a fleet; ``sense_scan`` takes a laser's index in them."""
    return tuple(dict.fromkeys(laser for own in equipment
                               for laser in own.lasers_by_topic.values()))


def kinds_of_sonars(equipment: Iterable[Equipment]) -> tuple[Sonar, ...]:
    """The different sonars of a fleet; ``sense_sonar`` takes a sonar's index in them."""
    return tuple(dict.fromkeys(own.sonar for own in equipment if own.sonar is not None))


def copied_by_processes(prefix: str, own: Equipment, processes: SubscribingProcesses
                        ) -> list[Copied]:
    """The messages of the sensors of one robot, with the number of processes that get each of them;
    its topics begin with ``prefix``."""
    scans = [Copied(f"{prefix}/{topic}", laser_scan_bytes(laser.beams), laser.rate_hz,
                    processes.scan) for topic, laser in own.lasers_by_topic.items()]
    return [*scans, Copied(f"{prefix}/odom", ODOMETRY_BYTES, own.odometry.rate_hz, processes.odom)]


class Driver(Node):
    """Sensors and motors of ``robots`` (indices into ``world.robots``). ``equipment`` [world's
    robots]: what each of the world's robots carries. ``stuck``: the robots whose drive is blocked
    now."""

    def __init__(self, host: Host, world: World, robots: Sequence[int],
                 equipment: Sequence[Equipment], stuck: Collection[int]) -> None:
        super().__init__(host, "driver")
        self.robots = tuple(robots)
        self._world = world
        self._equipment = equipment
        self._stuck = stuck
        # Of each kind that one of the robots here has, by its index among those of the fleet.
        self._scans: dict[int, tuple[Laser, Readings]] = {}
        self._sonars: dict[int, tuple[Sonar, Readings]] = {}
        self._poses: dict[int, Readings] = {}
        self._lowest_m = [min(laser.height_m for laser in own.lasers_by_topic.values())
                          for own in equipment]
        self._alone = {i: np.array([i]) for i in self.robots}
        self._bumpers: dict[int, str] = {}  # the topic of each robot that has one
        self._motors: dict[PolledSubscription, int] = {}  # the robot of each topic of velocities
        self._commands = WaitSet()

    def start(self) -> None:
        scans: dict[Laser, list[tuple[Sensor, Publisher]]] = {
            laser: [] for laser in kinds_of_lasers(self._equipment)}
        poses: dict[Fraction, list[tuple[Sensor, Publisher]]] = {
            own.odometry.rate_hz: [] for own in self._equipment}
        sonars: dict[Sonar, list[tuple[Sensor, Publisher]]] = {
            sonar: [] for sonar in kinds_of_sonars(self._equipment)}
        for robot in self.robots:
            prefix, own = f"/{self._world.robots[robot]}", self._equipment[robot]
            for number, (topic, laser) in enumerate(own.lasers_by_topic.items()):
                scans[laser].append(((robot, number), self.advertise(f"{prefix}/{topic}")))
            poses[own.odometry.rate_hz].extend(
                ((robot, number), self.advertise(f"{prefix}/{topic}"))
                for number, topic in enumerate(("odom", "true_pose")))
            if own.sonar is not None:  # its transducers come after the lasers
                sensor = robot, len(own.lasers_by_topic)
                sonars[own.sonar].append((sensor, self.advertise(f"{prefix}/sonar")))
            if own.bumper:
                self._bumpers[robot] = f"{prefix}/bumper"
                self.advertise(self._bumpers[robot])
            self._motors[self.latest(f"{prefix}/cmd_vel", self._commands)] = robot
        self._scans = {kind: (laser, Readings.of(those, laser_scan_bytes(laser.beams)))
                       for kind, (laser, those) in enumerate(scans.items()) if those}
        self._sonars = {
            kind: (sonar, Readings.of(those, point_cloud_bytes(len(sonar.transducers))))
            for kind, (sonar, those) in enumerate(sonars.items()) if those}
        self._poses = {kind: Readings.of(those, ODOMETRY_BYTES)
                       for kind, those in enumerate(poses.values()) if those}

    def sense_scan(self, kind: int, snapshot: Snapshot, tick: int) -> None:
        """Publish scan number ``tick`` of every laser of a kind, by its index in
        ``kinds_of_lasers``; beams are cast when a node reads the scan."""
        if kind in self._scans:
            laser, (sensors, publisher) = self._scans[kind]
            publisher.publish(partial(
                Lazy, publisher.size_bytes, partial(self._scan, laser, sensors, snapshot,
                                                    self.host.clock_ns(snapshot.time_ns), tick)))

    def sense_sonar(self, kind: int, snapshot: Snapshot, tick: int) -> None:
        """Publish reading number ``tick`` of every sonar of a kind, by its index in
        ``kinds_of_sonars``."""
        if kind in self._sonars:
            sonar, (sensors, publisher) = self._sonars[kind]
            publisher.publish(partial(Lazy, publisher.size_bytes,
                                      partial(self._sonar, sonar, sensors, snapshot, tick)))

    def sense_pose(self, kind: int, snapshot: Snapshot, tick: int) -> None:
        """Publish reading number ``tick`` of all odometers of a rate, by the index of the rate in
        the equipment of the fleet, and the true poses of these robots."""
        if kind in self._poses:
            sensors, publisher = self._poses[kind]
            publisher.publish(partial(self._pose, sensors, snapshot, snapshot.poses.tolist(),
                                      self.host.clock_ns(snapshot.time_ns), tick))

    def _scan(self, laser: Laser, sensors: tuple[Sensor, ...], snapshot: Snapshot, stamp_ns: int,
              tick: int, i: int) -> LaserScan:
        robot, number = sensors[i]
        ranges = self._world.scan(snapshot, self._alone[robot], tick, number)[0]
        ranges.setflags(write=False)  # all that read the message share it
        return _new(LaserScan, (stamp_ns, ranges, laser.angle_min_rad, laser.increment_rad,
                                laser.max_range_m, laser.x_m, laser.y_m,
                                laser.height_m <= self._lowest_m[robot]))

    def _sonar(self, sonar: Sonar, sensors: tuple[Sensor, ...], snapshot: Snapshot, tick: int,
               i: int) -> SonarReadings:
        robot, first = sensors[i]
        scans, stamp_ns = [], self.host.clock_ns(snapshot.time_ns)
        for number, cone in enumerate(sonar.cones, start=first):
            rays = self._world.scan(snapshot, self._alone[robot], tick, number)[0]
            nearest = np.maximum(rays.min(keepdims=True), np.float32(sonar.min_range_m))
            scans.append(LaserScan(stamp_ns, nearest, cone.yaw_rad, 0.0, cone.max_range_m,
                                   cone.x_m, cone.y_m))
        return SonarReadings(tuple(scans))

    def _pose(self, sensors: tuple[Sensor, ...], snapshot: Snapshot, poses: list[list[float]],
              stamp_ns: int, tick: int, i: int) -> Pose:
        """Of each robot its odometer's, then its true one, of ``poses``."""
        robot, is_true = sensors[i]
        if is_true:
            return _new(Pose, (stamp_ns, *poses[robot]))
        return _new(Pose, (stamp_ns, *map(float, self._world.odometry(snapshot, robot, tick))))

    def bump(self, robot: int) -> None:
        """Publish that ``robot`` has come into contact with something, if it has a bumper here."""
        if robot in self._bumpers:
            self.publish(self._bumpers[robot], Bump(self.now_ns))

    def drive(self) -> None:
        """Pass on the velocities that have come since the last call."""
        for latest, message in self._commands.news():
            robot, twist = self._motors[latest], message.content
            if robot not in self._stuck:
                self._world.command(robot, twist.forward_mps, twist.left_mps, twist.turn_radps)
