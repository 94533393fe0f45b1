"""Warnings at the end of a run, before anybody trusts its numbers."""

from __future__ import annotations

from types import NoneType

import numpy as np

from desim.advice.doubts import too_late
from desim.advice.unused_networks import unused_networks
from desim.advice.without_effect import without_effect
from desim.errors import did_you_mean
from desim.middleware.graph import Graph
from desim.middleware.topics import Topic
from desim.monitor.monitor import Monitor, StopReason
from desim.monitor.places import free_cells
from desim.monitor.traffic import family
from desim.monitor.truth import Truth
from desim.network.scoped_rule import Scoped
from desim.plugins import bare, load
from desim.ports import StrategyTraits
from desim.ports.computers import UnusedRows
from desim.ports.scope import is_topic
from desim.ports.tasks import GivesMap, Task, TaskTraits, VisitsPlaces
from desim.scenario.robot_types import strategies_of, used_types
from desim.scenario.schema.scenario import Scenario
from desim.units import LENGTH


def warnings(monitor: Monitor) -> list[str]:
    """Warnings of doubtful files of the terrain, of keys without effect, of what would begin after
    the end, of networks that carry nothing, of names that match no topic or node, of computers
    without memory for their software, of topics that nobody advertises, of strategies that have
    nothing to do, of places out of reach, and of fleets that never move."""
    truth, graph = monitor.truth, monitor.truth.graph
    said = [*truth.ground.doubts, *without_effect(monitor), *too_late(truth.scenario)]
    said += unused_networks(truth)
    said += _strange_topics(graph)
    said += _strange_nodes(graph)
    said += _too_small(graph)
    said += _silent(graph)
    said += _uninformed(monitor.task, truth.scenario)
    said += _out_of_reach(monitor.task, truth)
    if truth.explorers and not truth.travelled_m().any():
        reason = monitor.stop_reason or StopReason.ELAPSED
        said.append("no robot has moved: does the strategy choose goals, and do commands arrive?"
                    if reason in {*StopReason} or reason.startswith("condition") else
                    f"the run ended ({reason}) before a robot moved: robots see enough from where "
                    "they start; a larger terrain or a shorter robot.laser.max_range is a task")
    return said


def _uninformed(task: Task, scenario: Scenario) -> list[str]:
    """Warnings of strategies that ignore the task's briefing, where there is nothing to explore."""
    gives = TaskTraits.of(task).gives
    if gives is NoneType or not (isinstance(task, GivesMap) and task.gives_map()):
        return []
    names = dict.fromkeys(choice.strategy for choice in strategies_of(scenario))
    return [f"the strategy {name!r} has nothing to explore: the task "
            f"{bare(scenario.task.model)!r} gives robots the map; choose one that needs a "
            f"{gives.__name__} (needs of its traits)"
            for name in names if StrategyTraits.of(load("strategy", name)).needs is object]


def _strange_topics(graph: Graph) -> list[str]:
    """Warnings of patterns, of media's choices and of rules, that have named no topic."""
    hosts = [host.name for host in graph.hosts]
    known = sorted({family(topic, frozenset(hosts)).removeprefix("/*/") for topic in graph.topics})
    unmatched = [("topics", pattern) for pattern in graph.routes.unmatched()]
    for medium in (*graph.media, *graph.inside):
        for number, rule in enumerate(medium.rules):
            path = f"network.media.{medium.name.partition('@')[0]}.rules.{number}.topics"
            unmatched += [(path, pattern) for pattern in (
                rule.topics if isinstance(rule, Scoped) else ()) if not any(
                    is_topic(topic, pattern, hosts) for topic in graph.topics)]
    return [f"{path}: no topic of the run has matched {pattern!r}{did_you_mean(pattern, known)}; "
            f"topics were {', '.join(known)}" for path, pattern in dict.fromkeys(unmatched)]


def _too_small(graph: Graph) -> list[str]:
    """Warnings of computers whose memory is too small for their software as it starts."""
    hosts: dict[tuple[int, str], list[str]] = {}  # by limit and what needs more
    for host in graph.hosts:
        memory = host.memory
        if memory is not None and memory.limit_bytes is not None \
                and memory.limit_bytes < memory.first_bytes:
            needs = f"{memory.first_bytes / 1e6:.0f} MB"
            hosts.setdefault((memory.limit_bytes, needs), []).append(host.name)
    return [f"host {names[0]}{f' and {len(names) - 1} more' if names[1:] else ''}: computer.memory "
            f"is {limit_bytes / 1e6:g} MB, and the system and the software, as it starts, take "
            f"{needs}: the software dies whenever it starts"
            for (limit_bytes, needs), names in hosts.items()]


def _strange_nodes(graph: Graph) -> list[str]:
    """Warnings of nodes that have a priority and never ran, and of the cost model's rows that the
    run did not use."""
    computers = [host.computer for host in graph.hosts if host.computer is not None]
    ran = {program for host in graph.hosts for program in host.programs}
    named = dict.fromkeys(node for computer in computers for node in computer.priorities)
    models = {id(computer.model): computer.model for computer in computers}
    return [*(f"computer.priorities: no node of the run was called {node!r}"
              f"{did_you_mean(node, sorted(ran))}" for node in named if node not in ran),
            *(warning for model in models.values() if isinstance(model, UnusedRows)
              for warning in model.unused_rows(ran))]


def _silent(graph: Graph) -> list[str]:
    """Warnings of topics to which strategies subscribe, and which no strategy has advertised."""
    ends: dict[str, list[Topic]] = {}
    for name, topic in sorted(graph.topics.items()):
        _, _, of_strategy = name.partition("/strategy/")
        if of_strategy:
            ends.setdefault(of_strategy, []).append(topic)
    advertised = [name for name, topics in ends.items()
                  if any(topic.publishers or topic.counts.intended for topic in topics)]
    return [f"strategies subscribe to {name!r}, which none advertises"
            f"{did_you_mean(name, advertised)}"
            for name, topics in ends.items() if name not in advertised
            and any(topic.listening for topic in topics)]


def _out_of_reach(task: Task, truth: Truth) -> list[str]:
    """Warnings of places of a patrol that nobody has visited, and to which no path leads from where
    the robots are."""
    scenario = truth.scenario
    if not isinstance(task, VisitsPlaces) or not task.unvisited() or not truth.explorers:
        return []
    radius_m = min(scenario.fleet.types[name].inscribed_radius_m
                   for name in used_types(scenario.fleet))
    starts_m = truth.poses()[[truth.robots.index(name) for name in truth.explorers], :2]
    cells_m = free_cells(truth.ground, starts_m, radius_m)
    places = task.briefing().places
    return [f"task.places.{i}: nobody has been at {LENGTH.format(places[i].x_m)}, "
            f"{LENGTH.format(places[i].y_m)}: no path leads there from where the robots are"
            for i in task.unvisited()
            if not (np.hypot(*(cells_m - places[i]).T)
                    <= scenario.robot.navigation.goal_tolerance_m).any()]
