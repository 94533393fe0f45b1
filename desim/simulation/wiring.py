"""The network of a scenario: its hosts, middleware and media, ready for nodes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import nan
from typing import Any

import numpy as np

from desim import plugins
from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Trace
from desim.errors import InputError, below
from desim.middleware.graph import Graph, give_interfaces
from desim.middleware.graph_options import PLAIN, GraphOptions
from desim.middleware.link_states import LinkStates
from desim.network.association_rows import AssociationRows
from desim.network.background import (
    BackgroundFlow,
    Spells,
    on_off,
    periodic,
    poisson,
    trains,
)
from desim.network.itemized_medium import ItemizedMedium
from desim.network.medium import Medium
from desim.network.scoped_rule import scoped
from desim.network.surroundings import Surroundings
from desim.ports import KnowsHandovers, Obstacles, Rule, Snapshot, World, antenna, model_of
from desim.ports.middleware import SharesLinks
from desim.scenario.recipients import carrying_software
from desim.scenario.schema.communication import MediumChoice, Network, OtherHost, PluginChoice
from desim.scenario.schema.scenario import Scenario
from desim.simulation.deployment import HostPlan


class HostPlaces:
    """The hosts' positions as of the last world tick: the media's view of the world. After the
    hosts come ``others``."""

    def __init__(self, world: World, hosts: list[HostPlan], others: Iterable[OtherHost] = ()
                 ) -> None:
        self._world, others = world, tuple(others)
        self._fixed = np.array([*((host.x_m, host.y_m) for host in hosts),
                                *(other.at_m or (nan, nan) for other in others)]).reshape(-1, 2)
        carried = [(i, host.robot) for i, host in enumerate(hosts) if host.robot is not None]
        self._carried, self._bodies = map(_rows, np.array(carried, np.int64).reshape(-1, 2).T)
        self.antennas = antenna.table([*(host.antenna for host in hosts),
                                       *(other.antenna for other in others)])
        self._seen: Snapshot | None = None
        self._positions = self._fixed

    @property
    def obstacles(self) -> Obstacles:
        return self._world.obstacles()

    def positions(self, time_ns: int) -> np.ndarray:
        """[hosts, 2] m; ``time_ns`` is now."""
        snapshot = self._world.snapshot()
        if snapshot is not self._seen:
            self._seen = snapshot
            self._positions = self._fixed.copy()
            self._positions[self._carried] = snapshot.poses[self._bodies, :2]
            self._positions.flags.writeable = False
        return self._positions


def _rows(indices: np.ndarray) -> slice | np.ndarray:
    """``indices`` to index by; as a slice, which is quicker, where they are consecutive."""
    if len(indices) and (np.diff(indices) == 1).all():
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices


def wired(scenario: Scenario, place: Surroundings, kernel: Kernel, trace: Trace, streams: Streams,
          hosts: Sequence[str], options: GraphOptions = PLAIN) -> Graph:
    """A graph of ``hosts`` that stand at ``place``, with the scenario's middleware, media and
    sockets. Raises ``InputError`` that begins with the path of what does not fit."""
    with below("middleware"):
        middleware = _plugin(scenario.middleware)
    others = scenario.network.others
    graph = Graph(kernel, trace.names, trace, streams, middleware, hosts, replace(
        options, others=len(others), sockets=scenario.network.sockets))
    new_medium = (Medium if options.passages is None
                  else partial(ItemizedMedium, options.passages))

    mark = graph.routes.mark if any(
        choice.dscp for choice in scenario.topics.values()) else None

    def made(name: str, choice: MediumChoice) -> Medium:
        model = model_of(plugins.load(choice.kind, choice.plugin), choice.params)
        return new_medium(name, model, _rules(choice), kernel=kernel, names=trace.names,
                          streams=streams, hosts=[*hosts, *others], own=len(hosts), place=place,
                          mark=mark)

    inside: dict[str, dict[int, Medium]] = {}  # by name and host
    for name, choice in scenario.network.media.items():
        with below(f"network.media.{name}"):
            if not choice.inside:
                graph.attach(made(name, choice), choice.hosts)
                continue
            for host in map(graph.host, choice.hosts or carrying_software(scenario)):
                medium = made(f"{name}@{host.name}", choice)
                graph.put_inside(medium, host.index)
                inside.setdefault(name, {})[host.index] = medium
    _route(graph, scenario, inside)
    _add_background(graph, scenario.network)
    for medium in graph.media:
        if isinstance(medium.model, KnowsHandovers):
            graph.associations[medium.name] = AssociationRows(medium, medium.model, kernel, trace)
            medium.model.follow(partial(graph.context.hangs_on, medium))
    return graph


def _rules(choice: MediumChoice) -> list[Rule]:
    rules = []
    for number, rule in enumerate(choice.rules):
        with below(f".rules.{number}"):
            rules.append(scoped(_plugin(rule), rule.params))
    return rules


def _add_background(graph: Graph, network: Network) -> None:
    """Start the background traffic. The random numbers of each flow go by medium and ends, and by
    the number of such flows before it."""
    media = {medium.name: medium for medium in graph.media}
    hosts = [*(host.name for host in graph.hosts), *network.others]
    alike: Counter[tuple[str, str, str]] = Counter()
    for own in network.background:
        medium, (source, receiver) = media[own.medium], map(hosts.index, own.between)
        stream = graph.streams("background", own.medium, *own.between, alike[
            own.medium, *own.between])
        alike[own.medium, *own.between] += 1
        arrays = (periodic(own.size_bytes, own.rate_bps, stream) if own.pattern == "periodic" else
                  poisson(own.size_bytes, own.rate_bps, stream) if own.pattern == "poisson" else
                  on_off(own.size_bytes, own.rate_bps, stream, Spells(own.on_ns, own.off_ns)))
        graph.background.append(BackgroundFlow(
            medium, source, receiver, own.between, own.size_bytes,
            trains(arrays, own.grain_ns), graph.kernel, graph.trace, own.start_ns, own.until_ns))
        give_interfaces(medium, {*medium.attached, source, receiver})


def _route(graph: Graph, scenario: Scenario, inside: dict[str, dict[int, Medium]]) -> None:
    """Give the graph the routes of the scenario: by topic, also ``inside`` hosts, through hosts
    that forward, and past interfaces without a carrier."""
    media, routes = {medium.name: medium for medium in graph.media}, graph.routes
    shares = isinstance(graph.middleware, SharesLinks) and graph.middleware.shares_links
    if shares and any(choice.dscp or any(name in media for name in choice.media)
                      for choice in scenario.topics.values()):
        raise InputError(f"topics: {plugins.bare(scenario.middleware.model)} carries all topics "
                         "between two hosts over one link; none can choose its medium or mark")
    for pattern, choice in scenario.topics.items():
        within = [inside[name] for name in choice.media if name in inside]
        routes.choose(pattern, [media[name] for name in choice.media if name in media],
                      within[0] if within else None, choice.dscp)
    for name, host in scenario.hosts.items():
        if host.forwards:
            routes.forward(name, [media[medium] for medium in host.forwards])
    failover = scenario.network.failover
    if failover is not None:
        routes.link_states = LinkStates(graph, failover.noticed_after_ns,
                                        failover.announce_every_ns)


def _plugin(choice: PluginChoice) -> Any:
    """The plug-in that was chosen, with its parameters."""
    return plugins.load(choice.kind, choice.plugin)(choice.params)
