"""The checks of the environment: its terrain, doors and physics."""

from __future__ import annotations

import os
from itertools import pairwise

from desim import plugins
from desim.errors import InputError, did_you_mean
from desim.scenario import file_kinds, generated_terrain
from desim.scenario.checks import Checks, Found
from desim.scenario.robot_types import types_by_name, used_types
from desim.scenario.schema.environment import BUILT_IN_TERRAINS, MapFile, Shape
from desim.scenario.schema.scenario import Physics, Scenario
from desim.scenario.source_places import Folder, Path
from desim.units import DURATION, LENGTH


def _terrain(scenario: Scenario, folder: Folder) -> Found:
    path: Path = ("environment", "terrain")
    terrain = scenario.environment.terrain
    if isinstance(terrain, Shape):
        yield from _shape(path, terrain)
        return
    if not isinstance(terrain, str | MapFile):
        yield from generated_terrain.complaints(path, terrain)
        return
    is_map = isinstance(terrain, MapFile)
    name = terrain.map if isinstance(terrain, MapFile) else terrain
    if is_map or name.endswith((".yaml", ".yml")):
        file = os.path.normpath(os.path.join(folder(path), name))
        if not os.path.isfile(file):
            yield (*path, "map") if is_map else path, f"no such map: {file}"
    elif name not in BUILT_IN_TERRAINS:
        file = os.path.normpath(os.path.join(folder(path), name))
        if advice := file_kinds.advice(file):
            yield path, f"{file}: no map_server file; {advice}"
            return
        yield path, (f"unknown terrain {name!r}{did_you_mean(name, BUILT_IN_TERRAINS)}; "
                     f"allowed: {', '.join(BUILT_IN_TERRAINS)}, a map_server file (*.yaml), a "
                     "shape, or a generated maze, office or warehouse")


def _shape(path: Path, shape: Shape) -> Found:
    if min(shape.size_m) <= 0:
        yield (*path, "size"), "must be above zero"
    for i, block in enumerate(shape.rectangles):
        for key, (low, high) in (("x", block.x_m), ("y", block.y_m)):
            if low >= high:
                yield (*path, "rectangles", i, key), (
                    f"must go from a lower to a higher value, got {LENGTH.format(low)} to "
                    f"{LENGTH.format(high)}")


def _passages(scenario: Scenario, _: Folder) -> Found:
    terrain, fleet = scenario.environment.terrain, scenario.fleet
    if isinstance(terrain, str | MapFile | Shape):
        return
    types = types_by_name(scenario)
    widest = max((name for name in used_types(fleet) if name in types),
                 key=lambda name: types[name].inscribed_radius_m, default=None)
    if widest is not None:
        yield from generated_terrain.narrow(("environment", "terrain"), terrain,
                                            2 * types[widest].inscribed_radius_m, widest)


def _doors(scenario: Scenario, _: Folder) -> Found:
    for i, door in enumerate(scenario.environment.doors):
        path = ("environment", "doors", i, "open")
        for j, (opens, closes) in enumerate(door.open_ns):
            if opens >= closes:
                yield (*path, j), (f"must open before it closes, got {DURATION.format(opens)} to "
                                   f"{DURATION.format(closes)}")
        for j, (before, after) in enumerate(pairwise(door.open_ns), start=1):
            if after[0] < before[1]:
                yield (*path, j), (f"must begin after the interval before it has ended "
                                   f"({DURATION.format(before[1])}), got "
                                   f"{DURATION.format(after[0])}")


def _world(scenario: Scenario, _: Folder) -> Found:
    name = scenario.physics.model
    if name == Physics.model_fields["model"].default:
        return  # it is ours, and importing it would compile its kernels
    try:
        plugins.load("world", name)
    except InputError as error:
        yield ("physics", "model"), str(error)


CHECKS: Checks = (
    ((("environment", "terrain"),), _terrain),
    ((("environment", "terrain"), ("fleet",)), _passages),
    ((("environment", "doors"),), _doors),
    ((("physics", "model"),), _world),
)
