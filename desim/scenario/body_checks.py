"""The checks of bodies: their footprints, and whether what they carry is on them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

from desim.scenario.checks import Checks, Found
from desim.scenario.robot_types import equipment_by_path, filled_in, types_by_name, used_types
from desim.scenario.schema import footprint
from desim.scenario.schema.fleet import RobotType
from desim.scenario.schema.robot import BUILT_IN_LASERS, Equipment, Laser
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path
from desim.units import FREQUENCY, LENGTH

_ROUNDED_M = 1e-3  # to which a radius may be written beside a footprint


def outline(path: Path, kind: RobotType) -> Found:
    """The complaints about the footprint of a type, which stands at ``path``."""
    corners = kind.footprint
    if corners is None:
        return
    wrong = list(footprint.complaints(corners))
    for corner, text in wrong:
        yield (*path, "footprint", *(() if corner is None else (corner,))), text
    around_m = footprint.radii_m(corners)[1]
    given = "radius_m" in kind.model_fields_set
    if given and not wrong and abs(kind.radius_m - around_m) > _ROUNDED_M:
        yield (*path, "radius"), (
            f"must be that of the circle around the footprint, {around_m:g} m, or left out, got "
            f"{LENGTH.format(kind.radius_m)}")


def lasers(equipment: Equipment) -> Iterator[tuple[Path, str | Laser]]:
    """The lasers as they are written, with their paths."""
    if equipment.laser is not None and not equipment.lasers:
        yield ("laser",), equipment.laser
    for name, laser in equipment.lasers.items():
        yield ("lasers", name), laser


def clearance(path: Path, kind: RobotType) -> Found:
    """The complaints about the clearance of a type, which stands at ``path``."""
    if kind.clearance_m >= kind.height_m:
        yield (*path, "clearance"), (
            f"must be below the top of the body, its height, {LENGTH.format(kind.height_m)}, got "
            f"{LENGTH.format(kind.clearance_m)}")


def _sensor_rates(scenario: Scenario, _: Folder) -> Found:
    """Sensors that measure oftener than bodies move."""
    tick_hz, shared = scenario.physics.rate_hz, scenario.robot
    for path, equipment in equipment_by_path(scenario):
        for at, rate_hz, why in _rates_of_last_tick(equipment, shared):
            if rate_hz > tick_hz:
                yield (*path, *at, "rate"), (
                    f"must be at most that of physics, {FREQUENCY.format(tick_hz)}, got "
                    f"{FREQUENCY.format(rate_hz)}: {why}")


def _rates_of_last_tick(equipment: Equipment,
                        shared: Equipment) -> Iterator[tuple[Path, Fraction, str]]:
    """The rate of each sensor of ``equipment`` that measures at the pose of the last tick, with its
    path, and the reason why it may not be higher than that of ticks. What a type has from the
    fleet's equipment, ``shared``, is that one's."""
    for at, written in lasers(equipment):
        if equipment is not shared and at == ("laser",):
            if "laser" not in equipment.model_fields_set:
                continue
            written = filled_in(equipment, shared).laser or written  # noqa: PLW2901
        laser = BUILT_IN_LASERS.get(written) if isinstance(written, str) else written
        if laser is not None and laser.pose == "last_tick":
            yield at, laser.rate_hz, ("scans see the pose of the last tick; allowed with pose: "
                                      "interpolated")
    for name in ("odometry", "sonar"):
        sensor = getattr(equipment, name)
        if sensor is not None and (equipment is shared or "rate_hz" in sensor.model_fields_set):
            yield (name,), sensor.rate_hz, "it measures at the pose of the last tick"


def _mounts(scenario: Scenario, _: Folder) -> Found:
    """Lasers and sonars that are not on the body that carries them."""
    for name, kind in types_by_name(scenario).items():
        path: Path = ("fleet", "types", name, "robot") if kind.robot else ("robot",)
        if name not in used_types(scenario.fleet) and not (
                kind.robot and name in scenario.fleet.types):
            continue
        for at, laser in lasers(kind.robot or scenario.robot):
            if isinstance(laser, Laser) and not _carries(kind, laser.x_m, laser.y_m):
                yield (*path, *at), (
                    f"is mounted {LENGTH.format(math.hypot(laser.x_m, laser.y_m))} from the middle "
                    f"of a {name}, {_extent(kind)}; allowed: on the body")
        sonar = (kind.robot or scenario.robot).sonar
        for i, (x_m, y_m, _) in enumerate(sonar.transducers if sonar else ()):
            if not _carries(kind, x_m, y_m):
                yield (*path, "sonar"), (
                    f"transducer {i} is not on the body of a {name}, {_extent(kind)}; allowed: on "
                    "the body")


def _carries(kind: RobotType, x_m: float, y_m: float) -> bool:
    """Whether a place is on the body; on one whose footprint is wrong, any is."""
    if kind.footprint:
        return (footprint.holds(kind.footprint, x_m, y_m)
                or any(footprint.complaints(kind.footprint)))
    return math.hypot(x_m, y_m) <= kind.radius_m


def _extent(kind: RobotType) -> str:
    return ("outside of its footprint" if kind.footprint else
            f"whose radius is {LENGTH.format(kind.radius_m)}")


CHECKS: Checks = (
    ((("robot", "laser"), ("robot", "lasers"), ("robot", "sonar"), ("fleet",)), _mounts),
    ((("robot", "laser"), ("robot", "lasers"), ("robot", "odometry"), ("robot", "sonar"),
      ("fleet", "types"), ("physics", "rate")), _sensor_rates),
)
