"""The checks of the fleet: types, numbers, starts, and names of hosts."""

from __future__ import annotations

from desim import plugins
from desim.errors import did_you_mean
from desim.scenario import body_checks
from desim.scenario.checks import Checks, Found
from desim.scenario.names import WORKSTATION, robot_names
from desim.scenario.robot_types import types_by_name
from desim.scenario.schema.fleet import MAX_ROBOTS, StartList
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path
from desim.units import LENGTH


def _fleet(scenario: Scenario, _: Folder) -> Found:
    fleet = scenario.fleet
    types = types_by_name(scenario)
    groups = () if isinstance(fleet.robots, str) else fleet.robots
    used: list[tuple[Path, str]] = [(("fleet", "robots", i, "type"), group.type)
                                    for i, group in enumerate(groups)]
    if isinstance(fleet.robots, str):
        used.append((("fleet", "robots"), fleet.robots))
    for path, name in used:
        if name not in types:
            yield path, (f"unknown type {name!r}{did_you_mean(name, types)}; allowed: "
                         f"{', '.join(types)}")
    count = sum(group.count for group in groups)
    if groups and fleet.size not in (None, count):
        yield ("fleet", "size"), f"must be the sum of the groups' counts, {count}, got {fleet.size}"
    if count > MAX_ROBOTS:
        yield ("fleet", "robots"), f"must be at most {MAX_ROBOTS} robots together, got {count}"
    for name in fleet.types:
        kind = types[name]
        if (kind.drive == "aerial") != (kind.altitude_m > 0.0):
            yield ("fleet", "types", name, "altitude"), (
                f"must be above 0 m with drive: aerial, and 0 m with any other, got "
                f"{LENGTH.format(kind.altitude_m)} with drive: {kind.drive}")
        yield from body_checks.outline(("fleet", "types", name), kind)
        yield from body_checks.clearance(("fleet", "types", name), kind)
    if isinstance(fleet.start, StartList):
        yield from _start_list(fleet.start, count or fleet.size)
    if fleet.size == 0 and "model" in scenario.task.model_fields_set \
            and plugins.bare(scenario.task.model) != "none":
        yield ("task", "model"), "there is nobody to do it (fleet.size is 0); allowed: none"


def _start_list(start: StartList, size: int | None) -> Found:
    path = ("fleet", "start", "poses")
    if size not in (None, len(start.poses)):
        yield path, (f"must be as many as there are robots, {size}, got {len(start.poses)}; for "
                     "any number of robots let fleet.start be {from: [x, y], step: [dx, dy]}")
    if len(start.poses) > MAX_ROBOTS:
        yield path, f"must be a list of at most {MAX_ROBOTS}, got {len(start.poses)}"
    names = [pose.name for pose in start.poses]
    if any(names) and not all(names):
        yield (*path, names.index(None)), "the key 'name' is missing; all poses have one or none"
    for i, name in enumerate(names):
        if name and name in names[:i]:
            yield (*path, i, "name"), f"{name!r} is the name of another robot"


def _hosts(scenario: Scenario, _: Folder) -> Found:
    robots = robot_names(scenario)
    testbed = [WORKSTATION] if scenario.deployment == "testbed" else []
    if WORKSTATION in robots and testbed:
        yield ("fleet", "start"), (f"a robot is called {WORKSTATION!r}, which is the name of "
                                   "another host in a testbed")
    taken = {*robots, *testbed}
    for name in scenario.hosts:
        if name in taken:
            yield ("hosts", name), f"{name!r} is the name of another host"


CHECKS: Checks = (
    ((("fleet",),), _fleet),
    ((("fleet",), ("hosts",), ("deployment",)), _hosts),
)
