"""The robots of the fleet: names, bodies and starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from desim.scenario.names import robot_names
from desim.scenario.robot_types import equipment_of, types_of
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


class RobotSpec(NamedTuple):
    """One robot: its body, its start and its sensors. ``snap`` lets a start inside a wall move; a
    start that is still to be ``drawn`` has no place yet (NaN)."""

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
    otherwise the i-th pose is the i-th robot's; groups are counted off in the order of names."""
    fleet, names = scenario.fleet, robot_names(scenario)
    poses = _poses(fleet, names)
    drawn = fleet.start if isinstance(fleet.start, StartRandom) else None
    return [RobotSpec(name, body, *poses[name], fleet.start.snap, drawn, own.lasers_by_topic,
                      own.odometry, own.sonar.cones if own.sonar else ())
            for name, body, own in zip(names, types_of(fleet), equipment_of(scenario),
                                       strict=True)]


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
