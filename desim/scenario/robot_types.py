"""The types of a scenario's robots, and what each carries and runs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

from desim.ports import Params
from desim.scenario.names import fleet_size
from desim.scenario.schema.built_in_robots import BUILT_IN_TYPES
from desim.scenario.schema.communication import PluginChoice, StrategyChoice
from desim.scenario.schema.fleet import FleetParams, RobotType
from desim.scenario.schema.robot import Equipment
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Path

P = TypeVar("P", bound=Params)


def type_names(fleet: FleetParams) -> tuple[str, ...]:
    """The name of each robot's type; groups are counted off in the natural order of names."""
    if isinstance(fleet.robots, str):
        return (fleet.robots,) * fleet_size(fleet)
    return tuple(group.type for group in fleet.robots for _ in range(group.count))


def types_by_name(scenario: Scenario) -> dict[str, RobotType]:
    """The types that robots can be of. A built-in type that is used or overridden takes each value
    from the scenario's type of that name, else from its keys of all robots, else from desim."""
    own = scenario.fleet.types
    return BUILT_IN_TYPES | own | {
        name: _written_over(own.get(name, RobotType()), BUILT_IN_TYPES[name], scenario.robot)
        for name in (*own, *used_types(scenario.fleet)) if name in BUILT_IN_TYPES}


def _written_over(kind: RobotType, built_in: RobotType, usual: Equipment) -> RobotType:
    if built_in.robot is not None:
        robot = filled_in(kind.robot or Equipment(), usual)
        if robot.lasers and "laser" not in robot.model_fields_set:
            robot = robot.model_copy(update={"laser": None})
        kind = kind.model_copy(update={"robot": filled_in(robot, built_in.robot)})
    return filled_in(kind, built_in)


def types_of(fleet: FleetParams) -> tuple[RobotType, ...]:
    """The type of each robot."""
    types = {**BUILT_IN_TYPES, **fleet.types}
    return tuple(types[name] for name in type_names(fleet))


def used_types(fleet: FleetParams) -> tuple[str, ...]:
    """The names of the types of ``fleet.robots``, as they are written."""
    return (fleet.robots,) if isinstance(fleet.robots, str) else tuple(
        group.type for group in fleet.robots)


def equipment_of(scenario: Scenario) -> tuple[Equipment, ...]:
    """The equipment of each robot of a complete scenario."""
    return tuple(kind.robot or scenario.robot for kind in types_of(scenario.fleet))


def equipment_by_path(scenario: Scenario) -> Iterator[tuple[Path, Equipment]]:
    """The equipment of the fleet, and of each type that has its own, with their paths."""
    yield ("robot",), scenario.robot
    types = types_by_name(scenario)
    for name in dict.fromkeys((*scenario.fleet.types, *used_types(scenario.fleet))):
        kind = types.get(name)  # an unknown type is complained of elsewhere
        if kind is not None and kind.robot is not None:
            yield ("fleet", "types", name, "robot"), kind.robot


def are_metered(scenario: Scenario) -> bool:
    """Whether the scenario gives the power of any robot's parts."""
    types = types_by_name(scenario)
    own = [types[name].robot for name in used_types(scenario.fleet) if name in types]
    return any((scenario.robot if robot is None else filled_in(robot, scenario.robot)).power
               is not None for robot in own)


def strategies_of(scenario: Scenario) -> tuple[StrategyChoice, ...]:
    """The strategy of each robot."""
    return tuple(kind.strategy or scenario.coordination for kind in types_of(scenario.fleet))


def filled_in(own: P, base: P) -> P:
    """``own`` with what was written in ``base`` for all keys that were not written in it. A plug-in
    is chosen with all of its parameters."""
    update: dict[str, object] = {}
    for field in type(own).model_fields:
        above, below = getattr(own, field), getattr(base, field)
        if field not in base.model_fields_set:
            continue
        if field not in own.model_fields_set:
            update[field] = below
        elif (isinstance(above, Params) and type(above) is type(below)
              and not isinstance(above, PluginChoice)):
            update[field] = filled_in(above, below)
    return own.model_copy(update=update)
