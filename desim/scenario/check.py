"""The checks of a scenario beyond the types of its values."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Iterator
from itertools import pairwise

from desim import plugins
from desim.errors import InputError, did_you_mean
from desim.ports.tasks import TaskTraits
from desim.scenario import (
    body_checks,
    clock_checks,
    coordination_checks,
    expression,
    file_kinds,
    generated_terrain,
    loop_checks,
    network_checks,
    remote_slam_checks,
)
from desim.scenario.complaints import Complaint
from desim.scenario.names import WORKSTATION, access_point_names, host_names, robot_names, unknown
from desim.scenario.quantities import (
    ROBOTS,
    ROBOTS_TABLE,
    measurements,
    not_measured,
    quantities,
)
from desim.scenario.robot_types import (
    equipment_by_path,
    filled_in,
    types_by_name,
    used_types,
)
from desim.scenario.schema.communication import Fault
from desim.scenario.schema.environment import BUILT_IN_TERRAINS, MapFile, Shape
from desim.scenario.schema.fleet import MAX_ROBOTS, StartList
from desim.scenario.schema.navigation import MAX_LOCAL_SIDE
from desim.scenario.schema.robot import BUILT_IN_LASERS
from desim.scenario.schema.scenario import Physics, Scenario
from desim.scenario.source_places import Folder, Path
from desim.units import DURATION, LENGTH, NS_PER_S, POWER

Found = Iterator[tuple[Path, str]]


def complaints(scenario: Scenario, folder: Folder, wrong: tuple[Path, ...]) -> list[Complaint]:
    """All that is wrong. Checks that read one of the ``wrong`` paths are left out: there stands a
    default now, and not what the user meant."""
    return [Complaint(path, text) for families, check in _CHECKS
            if not any(all(a == b for a, b in zip(path, family, strict=False))
                       for path in wrong for family in families)
            for path, text in check(scenario, folder)]


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


def _shape(path: Path, shape: Shape) -> Found:
    if min(shape.size_m) <= 0:
        yield (*path, "size"), "must be above zero"
    for i, block in enumerate(shape.rectangles):
        for key, (low, high) in (("x", block.x_m), ("y", block.y_m)):
            if low >= high:
                yield (*path, "rectangles", i, key), (
                    f"must go from a lower to a higher value, got {LENGTH.format(low)} to "
                    f"{LENGTH.format(high)}")


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


def _known_names(scenario: Scenario, _: Folder) -> Found:
    hosts = host_names(scenario) if scenario.faults else ()
    points = access_point_names(scenario) if scenario.faults else {}
    for i, fault in enumerate(scenario.faults):
        what, known = ("robot", robot_names(scenario)) if fault.kind == "stuck" else ("host", hosts)
        if fault.host in points:
            if fault.kind != "stop":
                yield ("faults", i, "kind"), (
                    "an access point has no software and no drive; allowed: stop")
            if len(points[fault.host]) > 1:
                yield ("faults", i, "host"), (
                    f"{' and '.join(points[fault.host])} have an access point {fault.host} each; "
                    "allowed: one of a single medium")
        elif fault.host not in known:
            if fault.kind == "stop":
                known = (*known, *points)
            yield ("faults", i, "host"), unknown(what, fault.host, known)
    robots = robot_names(scenario) if scenario.robot.passive else ()
    for i, name in enumerate(scenario.robot.passive):
        if name not in robots:
            yield ("robot", "passive", i), unknown("robot", name, robots)


def _faults(scenario: Scenario, _: Folder) -> Found:
    """Faults of one host or of one drive come one after the other."""
    before: dict[tuple[str, bool], tuple[int, Fault]] = {}
    # sorted by time; where two begin together the one that is written later is wrong
    for i, fault in sorted(enumerate(scenario.faults), key=lambda item: item[1].at_ns):
        number, earlier = before.get((fault.host, fault.kind == "stuck"), (None, None))
        begins, has = _VERBS[fault.kind]
        if earlier is not None and not _over(earlier, fault.at_ns):
            until = ("for good" if earlier.down_for_ns is None else
                     f"until {DURATION.format(earlier.at_ns + earlier.down_for_ns)}")
            yield ("faults", i), (
                f"{fault.host} is to {begins} at {DURATION.format(fault.at_ns)}, but "
                f"faults.{number} {has} it at {DURATION.format(earlier.at_ns)} {until}; allowed: "
                "one after the other")
        if earlier is None or _over(earlier, fault.at_ns):
            before[fault.host, fault.kind == "stuck"] = i, fault


_VERBS = {"stop": ("stop", "has stopped"), "software": ("lose its software", "has stopped"),
          "stuck": ("be stuck", "holds")}


def _over(fault: Fault, time_ns: int) -> bool:
    """Whether the host has started again before ``time_ns``."""
    return fault.down_for_ns is not None and fault.at_ns + fault.down_for_ns < time_ns


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


def _expressions(scenario: Scenario, _: Folder) -> Found:
    """Those of stop and measure."""
    try:
        names = quantities(scenario, _measured(scenario))
    except InputError:
        return  # there is no such task, which is complained of where it is named
    written: list[tuple[Path, str, Callable[[str, Collection[str]], object], Collection[str]]] = [
        *((("measure", "when", i), text, expression.of_quantities, names)
          for i, text in enumerate(scenario.measure.when)),
        (("measure", "cost"), scenario.measure.cost, expression.number, (*names, ROBOTS))]
    if scenario.stop.when is not None:
        written.insert(0, (("stop", "when"), scenario.stop.when, expression.condition, names))
    for path, text, read, known in written:
        complaint = not_measured(scenario, text)
        if complaint:
            yield path, complaint
            continue
        try:
            read(text, known)
        except InputError as error:
            yield path, str(error)


def _measured(scenario: Scenario) -> tuple[str, ...]:
    """The quantities that the task has of its own."""
    return TaskTraits.of(plugins.load("task", scenario.task.model)).quantities


def _periods(scenario: Scenario, _: Folder) -> Found:
    """Those of single measurements."""
    try:
        known = measurements(_measured(scenario))
    except InputError:
        return  # as above
    for name in scenario.measure.periods:
        if name not in known:
            yield ("measure", "periods", name), (
                f"unknown measurement {name!r}{did_you_mean(name, known)}; allowed: "
                f"{', '.join(known)}")
        elif name == ROBOTS_TABLE and scenario.measure.periods[name] % NS_PER_S:
            yield ("measure", "periods", name), (
                "must be whole seconds, got "
                f"{DURATION.format(scenario.measure.periods[name])}")


def _world(scenario: Scenario, _: Folder) -> Found:
    name = scenario.physics.model
    if name == Physics.model_fields["model"].default:
        return  # it is ours, and importing it would compile its kernels
    try:
        plugins.load("world", name)
    except InputError as error:
        yield ("physics", "model"), str(error)


_CHECKS: tuple[tuple[tuple[Path, ...], Callable[[Scenario, Folder], Found]], ...] = (
    ((("environment", "terrain"),), _terrain),
    ((("environment", "terrain"), ("fleet",)), _passages),
    ((("environment", "doors"),), _doors),
    ((("fleet",),), _fleet),
    ((("fleet",), ("hosts",), ("deployment",)), _hosts),
    ((("fleet",), ("hosts",), ("deployment",), ("faults",), ("robot", "passive")), _known_names),
    ((("fleet",), ("hosts",), ("deployment",), ("robot", "clock"), ("testbed", "clock")),
     clock_checks.servers),
    ((("fleet",), ("hosts",), ("deployment",), ("robot", "clock"), ("testbed", "clock"),
      ("network", "media")), clock_checks.reach),
    ((("fleet",), ("hosts",), ("deployment",), ("robot", "clock"), ("testbed", "clock")),
     clock_checks.circles),
    ((("robot", "clock"), ("testbed", "clock"), ("hosts",), ("fleet", "types")),
     clock_checks.offsets),
    ((("faults",),), _faults),
    ((("robot", "laser"), ("robot", "lasers"), ("fleet", "types")), _laser),
    ((("robot", "laser"), ("robot", "lasers"), ("robot", "sonar"), ("fleet",)), body_checks.mounts),
    ((("robot", "laser"), ("robot", "lasers"), ("robot", "odometry"), ("robot", "sonar"),
      ("fleet", "types"), ("physics", "rate")), body_checks.sensor_rates),
    ((("robot", "navigation"), ("fleet", "types")), _local_window),
    ((("robot", "mapping"), ("fleet", "types")), _one_raster),
    ((("robot", "power"), ("fleet", "types")), _radios),
    ((("stop", "when"), ("measure", "when"), ("measure", "cost"), ("task",), ("robot", "power"),
      ("fleet",), ("computers",)), _expressions),
    ((("measure", "periods"), ("task",)), _periods),
    *network_checks.CHECKS,
    *loop_checks.CHECKS,
    ((("robot", "localization"), ("robot", "passive"), ("fleet",), ("hosts",), ("deployment",)),
     remote_slam_checks.hosts),
    ((("robot", "localization"), ("fleet", "types"), ("coordination", "exchange")),
     remote_slam_checks.sharing),
    ((("coordination",), ("hosts",), ("fleet", "types"), ("task",)), coordination_checks.briefed),
    ((("coordination",), ("fleet",), ("faults",)), coordination_checks.held),
    ((("coordination",), ("hosts",), ("fleet", "types")), coordination_checks.frames),
    ((("coordination",), ("hosts",), ("fleet", "types")), coordination_checks.uncoordinated),
    ((("coordination", "exchange"), ("hosts",)), coordination_checks.coordinators),
    ((("physics", "model"),), _world),
)
