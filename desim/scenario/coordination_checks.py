"""The checks of coordination: strategies, what they need, and how maps are shared with them."""

from __future__ import annotations

from contextlib import suppress
from types import NoneType

from desim import plugins
from desim.errors import InputError
from desim.ports import RecordedPaths, StrategyTraits
from desim.ports.sharing import SharingTraits
from desim.ports.tasks import GivesMap, TaskTraits
from desim.scenario.checks import Checks, Found
from desim.scenario.names import robot_names
from desim.scenario.robot_types import type_names, types_by_name
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path


def _briefed(scenario: Scenario, _: Folder) -> Found:
    """Strategies that need the briefing of another task."""
    task = scenario.task.model
    with suppress(InputError):  # there is no such task, which is complained of where it is named
        gives = TaskTraits.of(plugins.load("task", task)).gives
        for path, strategy in _chosen(scenario):
            needs = StrategyTraits.of(_loaded("strategy", strategy)).needs
            if not issubclass(gives, needs):
                given = "nothing" if gives is NoneType else f"a {gives.__name__}"
                yield path, (f"{plugins.bare(strategy)!r} needs a task that gives robots a "
                             f"{needs.__name__}; the task {plugins.bare(task)!r} gives {given}")


def _loaded(kind: str, name: str) -> type | None:
    """The class of a plug-in. None if there is none, which is complained of where it is named."""
    try:
        cls: type = plugins.load(kind, name)
    except InputError:
        return None
    return cls


def _chosen(scenario: Scenario) -> list[tuple[Path, str]]:
    """The strategies, with the paths that name them."""
    return [(("coordination", "strategy"), scenario.coordination.strategy),
            *(((*at, name, "strategy"), of.strategy.strategy)
              for at, those in ((("hosts",), scenario.hosts), (("fleet", "types"),
                                                               scenario.fleet.types))
              for name, of in those.items() if of.strategy is not None)]


def _held(scenario: Scenario, _: Folder) -> Found:
    """Faults that would hold robots that move as a recording says."""
    types = types_by_name(scenario)
    type_of = dict(zip(robot_names(scenario), type_names(scenario.fleet), strict=False))
    for i, fault in enumerate(scenario.faults):
        if fault.kind == "stuck" and (kind := types.get(type_of.get(fault.host, ""))):
            strategy = (kind.strategy or scenario.coordination).strategy
            block = plugins.block_of(_loaded("strategy", strategy))
            if block is not None and issubclass(block, RecordedPaths):
                yield ("faults", i, "kind"), (
                    f"{fault.host} moves as a recording says ({plugins.bare(strategy)}), and "
                    "cannot be stuck; allowed: stop")


def _frames(scenario: Scenario, _: Folder) -> Found:
    """Places that are told to teammates who do not know where they are."""
    coordination, exchange = scenario.coordination, scenario.coordination.exchange
    if exchange is None or SharingTraits.of(_loaded("sharing", exchange.model)).common_frame:
        return
    model = repr(plugins.bare(exchange.model))
    if coordination.team_state is not None:
        yield ("coordination", "team_state"), (
            f"with {model} robots do not know where the others started: their poses and goals "
            "mean nothing to them; set it to null")
    elif "team_state" not in coordination.model_fields_set:
        for path, strategy in _chosen(scenario):
            if StrategyTraits.of(_loaded("strategy", strategy)).reads_team_state:
                yield path, (f"{plugins.bare(strategy)!r} wants its team's poses and goals every "
                             f"second, which mean nothing with {model}; choose another "
                             "coordination.exchange.model or, for a strategy without messages of "
                             "its own, set coordination.team_state to null to do without")


def _uncoordinated(scenario: Scenario, _: Folder) -> Found:
    """Strategies whose robots would wait for a coordinator that is not there."""
    there = [_loaded("strategy", strategy) for path, strategy in _chosen(scenario)
             if path[0] == "hosts"]
    for path, strategy in _chosen(scenario):
        cls = _loaded("strategy", strategy)
        if path[0] != "hosts" and cls not in there and StrategyTraits.of(cls).needs_coordinator:
            name = plugins.bare(strategy)
            yield path, (f"{name!r} needs a host without a body that runs it, too; write hosts: "
                         f"{{base: {{strategy: {name}}}}}")


def _coordinators(scenario: Scenario, _: Folder) -> Found:
    """Map sharing that gives a host without a body no map, or none at all."""
    exchange = scenario.coordination.exchange
    names = [name for name, host in scenario.hosts.items() if host.strategy is not None]
    if not names or _task_gives_map(scenario):
        return
    path: Path
    if exchange is None:
        path, why = ("coordination", "exchange"), "null means that nobody sends a map"
    elif SharingTraits.of(_loaded("sharing", exchange.model)).needs_body:
        path, why = ("coordination", "exchange", "model"), (
            f"{plugins.bare(exchange.model)!r} merges into the map of a robot's own scans")
    else:
        return
    yield path, (f"{why}; {', '.join(names)}, with a strategy and without a body, would get no "
                 f"map; allowed with a coordinator: {', '.join(_without_body())}")


def _task_gives_map(scenario: Scenario) -> bool:
    """Whether all hosts with a strategy start with the map of the terrain."""
    task = _loaded("task", scenario.task.model)
    return task is not None and isinstance(
        one := task(scenario.task.params), GivesMap) and one.gives_map()


def _without_body() -> list[str]:
    """The installed kinds of map sharing that need no body."""
    return [name for name in plugins.available("sharing") if (cls := _loaded("sharing", name))
            and not SharingTraits.of(cls).needs_body]


CHECKS: Checks = (
    ((("coordination",), ("hosts",), ("fleet", "types"), ("task",)), _briefed),
    ((("coordination",), ("fleet",), ("faults",)), _held),
    ((("coordination",), ("hosts",), ("fleet", "types")), _frames),
    ((("coordination",), ("hosts",), ("fleet", "types")), _uncoordinated),
    ((("coordination", "exchange"), ("hosts",)), _coordinators),
)
