"""The names of a scenario's robots and hosts, in the order that every index follows."""

from __future__ import annotations

from collections.abc import Sequence

from desim.errors import did_you_mean
from desim.ports import NamesAccessPoints, natural_key
from desim.scenario.schema.fleet import FleetParams, StartList
from desim.scenario.schema.scenario import Scenario

WORKSTATION = "workstation"  # testbed: where the simulator and the monitor run


def fleet_size(fleet: FleetParams) -> int:
    """``size`` where it is given, else the groups' counts, else the number of start poses, or 1."""
    if fleet.size is not None:
        return fleet.size
    if not isinstance(fleet.robots, str):
        return sum(group.count for group in fleet.robots)
    return len(fleet.start.poses) if isinstance(fleet.start, StartList) else 1


def robot_names(scenario: Scenario) -> tuple[str, ...]:
    """All robots, sorted naturally: ``robot_0`` ..., or the names that the start poses carry."""
    start = scenario.fleet.start
    if isinstance(start, StartList) and all(pose.name for pose in start.poses):
        return tuple(sorted((pose.name or "" for pose in start.poses), key=natural_key))
    return tuple([f"robot_{i}" for i in range(fleet_size(scenario.fleet))])


def host_names(scenario: Scenario) -> tuple[str, ...]:
    """All computers, sorted naturally: on robots, without a body, and testbed's workstation."""
    names = [*robot_names(scenario), *scenario.hosts]
    if scenario.deployment == "testbed":
        names.append(WORKSTATION)
    return tuple(sorted(names, key=natural_key))


def access_point_names(scenario: Scenario) -> dict[str, list[str]]:
    """The access points that can fail, and the media that have one of each name."""
    found: dict[str, list[str]] = {}
    for medium, choice in scenario.network.media.items():
        if isinstance(choice.params, NamesAccessPoints):
            for name in choice.params.access_point_names():
                found.setdefault(name, []).append(medium)
    return found


def unknown(kind: str, name: str, known: Sequence[str]) -> str:
    """The complaint about a ``name`` that is none of the ``known`` ones of its ``kind``."""
    allowed = ", ".join(known if len(known) <= 8 else (*known[:3], "...", known[-1]))
    return f"unknown {kind} {name!r}{did_you_mean(name, known)}; allowed: {allowed}"
