"""The checks of coordination: strategies, what they need, and how maps are shared with them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from desim import plugins
from desim.errors import InputError
from desim.ports import RecordedPaths
from desim.scenario.names import robot_names
from desim.scenario.robot_types import type_names, types_by_name
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path

Found = Iterator[tuple[Path, str]]


def briefed(scenario: Scenario, _: Folder) -> Found:
    """Strategies that need the briefing of another task."""
    for path, strategy in _chosen(scenario):
        try:
            complaint = plugins.unbriefed(strategy, scenario.task.model)
        except InputError:
            continue  # there is no such plug-in, which is complained of where it is named
        if complaint:
            yield path, complaint


def _chosen(scenario: Scenario) -> list[tuple[Path, str]]:
    """The strategies, with the paths that name them."""
    return [(("coordination", "strategy"), scenario.coordination.strategy),
            *(((*at, name, "strategy"), of.strategy.strategy)
              for at, those in ((("hosts",), scenario.hosts), (("fleet", "types"),
                                                               scenario.fleet.types))
              for name, of in those.items() if of.strategy is not None)]


def held(scenario: Scenario, _: Folder) -> Found:
    """Faults that would hold robots that move as a recording says."""
    types = types_by_name(scenario)
    type_of = dict(zip(robot_names(scenario), type_names(scenario.fleet), strict=False))
    for i, fault in enumerate(scenario.faults):
        if fault.kind == "stuck" and (kind := types.get(type_of.get(fault.host, ""))):
            strategy = (kind.strategy or scenario.coordination).strategy
            try:
                is_led = issubclass(plugins.parameters("strategy", strategy), RecordedPaths)
            except InputError:
                continue  # there is no such plug-in, which is complained of where it is named
            if is_led:
                yield ("faults", i, "kind"), (
                    f"{fault.host} moves as a recording says ({plugins.bare(strategy)}), and "
                    "cannot be stuck; allowed: stop")


def frames(scenario: Scenario, _: Folder) -> Found:
    """Places that are told to teammates who do not know where they are."""
    coordination = scenario.coordination
    try:
        if coordination.exchange is None or plugins.has_common_frame(coordination.exchange.model):
            return
        model = repr(plugins.bare(coordination.exchange.model))
        if coordination.team_state is not None:
            yield ("coordination", "team_state"), (
                f"with {model} robots do not know where the others started: their poses and goals "
                "mean nothing to them; set it to null")
        elif "team_state" not in coordination.model_fields_set:
            for path, strategy in _chosen(scenario):
                if plugins.reads_team_state(strategy):
                    way_out = (", and it speaks to its team of places: choose a strategy that is "
                               "silent, or" if plugins.speaks(strategy) else
                               "; set coordination.team_state to null to do without, or choose")
                    yield path, (f"{plugins.bare(strategy)!r} wants its team's poses and goals "
                                 f"every second, which mean nothing with {model}{way_out} another "
                                 "coordination.exchange.model")
    except InputError:
        return  # there is no such plug-in, which is complained of where it is named


def uncoordinated(scenario: Scenario, _: Folder) -> Found:
    """Strategies whose robots would wait for a coordinator that is not there."""
    there = [host.strategy.strategy for host in scenario.hosts.values()
             if host.strategy is not None]
    for path, strategy in _chosen(scenario):
        if path[0] == "hosts":
            continue
        try:
            is_missed = plugins.uncoordinated(strategy, there)
        except InputError:
            continue  # there is no such plug-in, which is complained of where it is named
        if is_missed:
            name = plugins.bare(strategy)
            yield path, (f"{name!r} needs a host without a body that runs it, too; write hosts: "
                         f"{{base: {{strategy: {name}}}}}")


def coordinators(scenario: Scenario, _: Folder) -> Found:
    """Map sharing that gives a host without a body no map, or none at all."""
    exchange = scenario.coordination.exchange
    names = [name for name, host in scenario.hosts.items() if host.strategy is not None]
    if not names:
        return
    path: Path
    try:
        if exchange is None:
            path, why = ("coordination", "exchange"), "null means that nobody sends a map"
        elif plugins.needs_body(exchange.model):
            path, why = ("coordination", "exchange", "model"), (
                f"{plugins.bare(exchange.model)!r} merges into the map of a robot's own scans")
        else:
            return
    except InputError:
        return  # there is no such plug-in, which is complained of where it is named
    yield path, (f"{why}; {', '.join(names)}, with a strategy and without a body, would get no "
                 f"map; allowed with a coordinator: {', '.join(_without_body())}")


def _without_body() -> Iterator[str]:
    """The installed kinds of map sharing that need no body."""
    for name in plugins.available("sharing"):
        with suppress(InputError):  # somebody's plug-in that cannot be loaded
            if not plugins.needs_body(name):
                yield name
