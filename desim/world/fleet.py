"""The robots of the fleet: names, bodies and starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from desim.errors import below
from desim.ports import RecordedPaths
from desim.scenario.names import robot_names
from desim.scenario.robot_types import equipment_of, type_names, types_of
from desim.scenario.schema.communication import StrategyChoice
from desim.scenario.schema.fleet import (
    BodyType,
    FleetParams,
    StartGrid,
    StartLine,
    StartList,
    StartRandom,
)
from desim.scenario.schema.robot import SCAN, Laser, Odometry
from desim.scenario.schema.scenario import Scenario
from desim.world.recorded_motion import RecordedMotion
from desim.world.recorded_paths import RecordedPath, read_paths


class RobotSpec(NamedTuple):
    """One robot: its body, its start and its sensors. ``snap`` lets a start inside a wall move; a
    start that is still to be ``drawn`` has no place yet (NaN). One with a ``path`` moves along it,
    from its start on."""

    name: str
    body: BodyType
    x_m: float
    y_m: float
    yaw_rad: float
    snap: bool = False
    drawn: StartRandom | None = None
    lasers: Mapping[str, Laser] = MappingProxyType({SCAN: Laser()})  # by the topics of their scans
    odometry: Odometry = Odometry()
    cones: tuple[Laser, ...] = ()  # of the transducers of a sonar
    path: RecordedPath | None = None

    @property
    def planes_m(self) -> tuple[float, ...]:
        """The heights of the lasers' planes above the ground."""
        return tuple(self.body.altitude_m + laser.height_m for laser in self.lasers.values())

    @property
    def top_m(self) -> float:
        """The height of its highest part, body or laser, above the ground."""
        return self.body.altitude_m + max(self.body.height_m, *(
            laser.height_m for laser in (*self.lasers.values(), *self.cones)))


def place_fleet(scenario: Scenario) -> list[RobotSpec]:
    """The robots in natural order of their names. A pose that carries a name is that robot's,
    otherwise the i-th pose is the i-th robot's; groups are counted off in the order of names. A
    robot that follows a recording starts where that begins."""
    fleet, names = scenario.fleet, robot_names(scenario)
    paths = _paths(scenario)
    poses = _poses(fleet, names)
    for name, path in paths.items():
        x_m, y_m, yaw_rad = RecordedMotion([path]).at(0)[0][0].tolist()
        poses[name] = x_m, y_m, yaw_rad
    drawn = fleet.start if isinstance(fleet.start, StartRandom) else None
    return [RobotSpec(name, body, *poses[name], fleet.start.snap,
                      None if name in paths else drawn, own.lasers_by_topic, own.odometry,
                      own.sonar.cones if own.sonar else (), paths.get(name))
            for name, body, own in zip(names, types_of(fleet), equipment_of(scenario),
                                       strict=True)]


def _paths(scenario: Scenario) -> dict[str, RecordedPath]:
    """The paths of the robots that follow a recording."""
    robots: dict[str, list[str]] = {}  # by the key of their strategy
    choices: dict[str, StrategyChoice] = {}
    for name, kind, type_ in zip(robot_names(scenario), type_names(scenario.fleet),
                                 types_of(scenario.fleet), strict=True):
        key = "coordination" if type_.strategy is None else f"fleet.types.{kind}.strategy"
        robots.setdefault(key, []).append(name)
        choices[key] = type_.strategy or scenario.coordination
    paths: dict[str, RecordedPath] = {}
    for key, choice in choices.items():
        if isinstance(choice.params, RecordedPaths):
            with below(key):
                paths |= read_paths(choice.params, robots[key], scenario.stop.elapsed_ns)
    return paths


def _poses(fleet: FleetParams, names: tuple[str, ...]) -> dict[str, tuple[float, float, float]]:
    start = fleet.start
    if isinstance(start, StartRandom):
        return dict.fromkeys(names, (math.nan, math.nan, math.nan))
    if isinstance(start, StartGrid):
        (x, y), (dx, dy), columns = start.origin_m, start.step_m, start.columns
        return {name: (x + i % columns * dx, y + i // columns * dy, start.heading_rad)
                for i, name in enumerate(names)}
    if isinstance(start, StartLine):
        (x, y), (dx, dy) = start.origin_m, start.step_m
        return {name: (x + i * dx, y + i * dy, start.heading_rad) for i, name in enumerate(names)}
    poses = start.poses if isinstance(start, StartList) else ()  # a file is a list when loaded
    named = all(pose.name for pose in poses)
    return {(named and pose.name) or name: (pose.x_m, pose.y_m, pose.heading_rad)
            for name, pose in zip(names, poses, strict=False)}
