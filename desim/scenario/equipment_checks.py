"""The checks of what robots carry: lasers, maps, the local costmap, radios."""

from __future__ import annotations

import math

from desim.errors import did_you_mean
from desim.scenario import body_checks
from desim.scenario.checks import Checks, Found
from desim.scenario.robot_types import equipment_by_path, filled_in
from desim.scenario.schema.navigation import MAX_LOCAL_SIDE
from desim.scenario.schema.robot import BUILT_IN_LASERS
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder
from desim.units import LENGTH, POWER


def _laser(scenario: Scenario, _: Folder) -> Found:
    for path, equipment in equipment_by_path(scenario):
        if equipment.lasers and "laser" in equipment.model_fields_set and equipment.laser:
            yield (*path, "laser"), "must be null, or left out, beside lasers"
        if not equipment.lasers and equipment.laser is None:
            yield (*path, "laser"), "null is allowed beside lasers alone: a robot has at least one"
        if not equipment.lasers and "lasers" in equipment.model_fields_set and (
                "laser" not in equipment.model_fields_set):
            yield (*path, "lasers"), ("must be one laser at least, or left out beside laser, the "
                                      "only one")
        for at, laser in body_checks.lasers(equipment):
            if isinstance(laser, str):
                if laser not in BUILT_IN_LASERS:
                    yield (*path, *at), (
                        f"unknown laser {laser!r}{did_you_mean(laser, BUILT_IN_LASERS)};"
                        f" allowed: {', '.join(BUILT_IN_LASERS)}, or its parameters")
                continue
            for key, angle_rad in (("field_of_view", laser.field_of_view_rad),
                                   ("yaw", abs(laser.yaw_rad))):
                if angle_rad > 2.0 * math.pi + 1e-9:
                    yield (*path, *at, key), (
                        f"must be at most 360 deg, got {math.degrees(angle_rad):g} deg")


def _local_window(scenario: Scenario, _: Folder) -> Found:
    for path, equipment in equipment_by_path(scenario):
        navigation = filled_in(equipment.navigation, scenario.robot.navigation)
        side = navigation.local_size_m / navigation.local_resolution_m
        if side > MAX_LOCAL_SIDE:
            yield (*path, "navigation", "local_resolution"), (
                f"makes the local window {side:.6g} cells wide; allowed: {MAX_LOCAL_SIDE}")


def _one_raster(scenario: Scenario, _: Folder) -> Found:
    """Types whose maps have other cells, or another size in messages, than the fleet's."""
    shared = scenario.robot.mapping
    for path, equipment in equipment_by_path(scenario):
        own = filled_in(equipment.mapping, shared)
        if own.resolution_m != shared.resolution_m:
            yield (*path, "mapping", "resolution"), (
                f"must be that of the fleet, {LENGTH.format(shared.resolution_m)}, got "
                f"{LENGTH.format(own.resolution_m)}: robots share their maps")
        if own.published_size_m != shared.published_size_m:
            yield (*path, "mapping", "published_size"), (
                f"must be that of the fleet, {_sides(shared.published_size_m)}, got "
                f"{_sides(own.published_size_m)}: robots share their maps")


def _sides(size_m: tuple[float, float] | None) -> str:
    return "null" if size_m is None else f"[{', '.join(map(LENGTH.format, size_m))}]"


def _radios(scenario: Scenario, _: Folder) -> Found:
    """Radios that draw less when they have something to do."""
    for path, equipment in equipment_by_path(scenario):
        power, fleet = equipment.power, scenario.robot.power
        if power is None:
            continue
        radio = (power if fleet is None else filled_in(power, fleet)).radio
        for key, power_w in ("receive", radio.receive_w), ("send", radio.send_w):
            if power_w < radio.idle_w:
                yield (*path, "power", "radio", key), (
                    f"must be at least that of an idle radio, which listens, too: "
                    f"{POWER.format(radio.idle_w)}, got {POWER.format(power_w)}")


CHECKS: Checks = (
    ((("robot", "laser"), ("robot", "lasers"), ("fleet", "types")), _laser),
    ((("robot", "navigation"), ("fleet", "types")), _local_window),
    ((("robot", "mapping"), ("fleet", "types")), _one_raster),
    ((("robot", "power"), ("fleet", "types")), _radios),
)
