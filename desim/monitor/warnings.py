"""Warnings at the end of a run, before anybody trusts its numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from desim.computers.costs.table import TableOfCosts
from desim.errors import did_you_mean
from desim.middleware.busy.host import BusyHost
from desim.middleware.graph import Graph
from desim.middleware.topics import Topic
from desim.monitor.tasks.places import free_cells
from desim.monitor.without_effect import without_effect
from desim.network.medium import Medium
from desim.ports.tasks import VisitsPlaces
from desim.scenario.robot_types import used_types
from desim.units import LENGTH

if TYPE_CHECKING:
    from desim.monitor.monitor import Monitor

_MANY_FRAMES = 100  # fewer may be on their way when a run ends


def warnings(monitor: Monitor) -> list[str]:
    """Warnings of keys without effect, of networks that settle nothing, of names that match no
    topic or node, of topics and hosts that nobody could hear, of strategies that have nothing to
    do, of places out of reach, and of fleets that never move."""
    said = without_effect(monitor)
    said += filter(None, map(_under_way, (*monitor.graph.media, *monitor.graph.inside)))
    said += [f"medium {name}: nothing has arrived inside of a host: does its model carry frames "
             "from a host to itself, as link and bus do?" for name in _silent_inside(monitor.graph)]
    said += [f"topics: no topic of the run has matched {pattern!r}"
             for pattern in monitor.graph.routes.unmatched()]
    said += _strange_nodes(monitor.graph)
    said += _silent(monitor.graph)
    said += [f"the strategy {name!r} has nothing to explore: the task {monitor.task_name!r} gives "
             f"robots the map; choose one that needs a {monitor.task_gives} (needs of its class)"
             for name in monitor.uninformed]
    said += _out_of_reach(monitor)
    said += [f"host {name} has no place (hosts.{name}.at), and no message from or to it has "
             "arrived: nobody hears such a host over a radio" for name in _unheard(monitor.graph)]
    if monitor.explorers and not monitor.travelled_m().any():
        said.append("no robot has moved: does the strategy choose goals, and do commands arrive?")
    return said


def _under_way(medium: Medium) -> str:
    """A warning of a medium in which most frames have no fate at the end; else empty."""
    under_way, arriving = medium.in_flight(), medium.flights.count
    settles = medium.delivered or medium.dropped or arriving
    if under_way < (_MANY_FRAMES if settles else 1) or 2 * under_way <= medium.intended:
        return ""
    return (f"medium {medium.name}: {under_way} of {medium.intended} frames are neither delivered "
            "nor dropped at the end: " + (
                "does its model settle every frame?" if not settles else
                "they arrive later: is it too slow for the traffic?" if under_way == arriving else
                f"{arriving} arrive later, and {under_way - arriving} are not settled: is it too "
                "slow for the traffic, or does its model forget frames?"))


def _silent_inside(graph: Graph) -> list[str]:
    """The media inside hosts that had frames and delivered none, in any host."""
    delivered: dict[str, int] = {}
    for medium in graph.inside:
        if medium.intended:
            name = medium.name.partition("@")[0]
            delivered[name] = delivered.get(name, 0) + medium.delivered
    return [name for name, count in delivered.items() if not count]


def _strange_nodes(graph: Graph) -> list[str]:
    """Warnings of nodes that have a priority or a row of a table of costs, and that never ran, of
    triggers with a row that those that ran never had, and of quantities with a cost that never
    came."""
    computers = [host for host in graph.hosts if isinstance(host, BusyHost)]
    ran = {program for host in computers for program in host.programs}
    named: dict[tuple[str, str], None] = {}  # key of the scenario and node
    triggers: dict[tuple[str, str], TableOfCosts] = {}  # node and trigger
    undeclared: dict[str, None] = {}
    for host in computers:
        named |= dict.fromkeys(("computer.priorities", node) for node in host.computer.priorities)
        model = host.computer.model
        if isinstance(model, TableOfCosts):
            named |= dict.fromkeys(("computers", node) for node in model.nodes)
            triggers |= {row: model for row in model.triggers if row not in model.asked}
            undeclared |= dict.fromkeys(model.never_declared())
    return [*(f"{key}: no node of the run was called {node!r}{did_you_mean(node, sorted(ran))}"
              for key, node in named if node not in ran),
            *(f"computers: node {node!r} had no trigger {trigger!r}"
              f"{did_you_mean(trigger, known)}; it had: {', '.join(known)}"
              for (node, trigger), model in triggers.items() if node in ran
              for known in [sorted(own for other, own in model.asked if other == node)]),
            *undeclared]


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


def _unheard(graph: Graph) -> list[str]:
    """The hosts without a place that have software, and whose messages never arrived, nor any for
    them, while others' did."""
    arrivals = np.array([host.last_arrival_ns for host in graph.hosts])
    if not arrivals.any() or not graph.media:
        return []
    places = graph.media[0].positions(graph.kernel.now_ns)
    return [host.name for i, host in enumerate(graph.hosts)
            if host.nodes and np.isnan(places[i]).any()
            and not arrivals[i].any() and not arrivals[:, i].any()]


def _out_of_reach(monitor: Monitor) -> list[str]:
    """Warnings of places of a patrol that nobody has visited, and to which no path leads from where
    the robots are."""
    task, scenario = monitor.task, monitor.scenario
    if not isinstance(task, VisitsPlaces) or not task.unvisited() or not monitor.explorers:
        return []
    radius_m = min(scenario.fleet.types[name].inscribed_radius_m
                   for name in used_types(scenario.fleet))
    starts_m = monitor.poses()[[monitor.robots.index(name) for name in monitor.explorers], :2]
    cells_m = free_cells(monitor.ground, starts_m, radius_m)
    places = task.briefing().places
    return [f"task.places.{i}: nobody has been at {LENGTH.format(places[i].x_m)}, "
            f"{LENGTH.format(places[i].y_m)}: no path leads there from where the robots are"
            for i in task.unvisited()
            if not (np.hypot(*(cells_m - places[i]).T)
                    <= scenario.robot.navigation.goal_tolerance_m).any()]
