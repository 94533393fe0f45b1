"""Warnings of networks that carry nothing: media, hosts and flows of background traffic."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.middleware.topics import Topic
from desim.monitor.truth import Truth
from desim.network.medium import Medium
from desim.ports import HearsAntennas, Separates
from desim.scenario.schema.scenario import Scenario
from desim.units import NS_PER_S

_SOON_NS = 10 * NS_PER_S  # two scans of a station without an access point
_MANY_FRAMES = 100  # fewer may be on their way when a run ends


def unused_networks(truth: Truth) -> Iterator[str]:
    """Warnings of media that settle nothing or carry nothing inside of hosts, of hosts without a
    body that nobody can hear, of flows of background traffic of which nothing arrives, and of
    access points out of reach."""
    graph, scenario = truth.graph, truth.scenario
    for name, media in _by_name(graph).items():
        if media[0] in graph.inside and not any(medium.delivered for medium in media):
            yield from _silent_inside(name, media, scenario)
        else:
            yield from _under_way(name, media)
    for host in graph.hosts:
        if host.nodes and host.name not in truth.robots:
            yield from _silent_host(host, scenario)
    yield from _silent_flows(graph, scenario)
    yield from _out_of_reach(graph)


def _out_of_reach(graph: Graph) -> Iterator[str]:
    """Warnings of media where no host hung on an access point when the run began."""
    for name, rows in graph.associations.items():
        first_ns = min((one.time_ns for one in rows.model.handovers), default=None)
        soon = first_ns is not None and first_ns <= _SOON_NS
        if soon or not rows.at_start or any(rows.at_start.values()):
            continue
        later = ("never did" if first_ns is None else
                 f"did so from {first_ns / NS_PER_S:.1f} s on")
        yield (f"medium {name}: {_counted([*rows.at_start])} hung on no access point when the run "
               f"began, and {later}: are its access points in reach of them "
               f"(network.media.{name}.access_points)?")


def _by_name(graph: Graph) -> dict[str, list[Medium]]:
    """The media between hosts, and those inside of hosts, which have one name together."""
    groups: dict[str, list[Medium]] = {}
    for medium in (*graph.media, *graph.inside):
        groups.setdefault(medium.name.partition("@")[0], []).append(medium)
    return groups


def _under_way(name: str, media: list[Medium]) -> Iterator[str]:
    """A warning where most frames have no fate at the end."""
    under_way = sum(medium.in_flight() for medium in media)
    arriving = sum(medium.flights.count for medium in media)
    intended = sum(medium.intended for medium in media)
    settles = arriving or any(medium.delivered or medium.dropped for medium in media)
    if under_way < (_MANY_FRAMES if settles else 1) or 2 * under_way <= intended:
        return
    yield (f"medium {name}: {under_way} of {intended} frames are neither delivered nor dropped at "
           "the end: " + (
               "does its model settle every frame?" if not settles else
               "they arrive later: is it too slow for the traffic?" if under_way == arriving else
               f"{arriving} arrive later, and {under_way - arriving} are not settled: is it too "
               "slow for the traffic, or does its model forget frames?"))


def _silent_inside(name: str, media: list[Medium], scenario: Scenario) -> Iterator[str]:
    """A warning of media inside hosts that had frames and delivered none, in any host."""
    if not any(medium.intended for medium in media):
        return
    dropped: Counter[str] = Counter()
    for medium in media:
        dropped.update(medium.dropped)
    carries = (f"does its model, {scenario.network.media[name].model}, carry frames from a host to "
               "itself, as link and bus do?")
    yield f"medium {name}: nothing has arrived inside of a host: " + (
        "its frames arrive after the end: is it too slow for the traffic?"
        if any(medium.flights.count for medium in media) else
        f"its frames have no fate at the end: is it too slow for the traffic, and {carries}"
        if not dropped else
        f"{_listed(dropped)}: {carries}" if dropped.keys() & set(media[0].model.reasons) else
        f"{_listed(dropped)}, by its rules")


def _silent_host(host: Host, scenario: Scenario) -> Iterator[str]:
    """A warning of a host from and to which no message has arrived, if the reason is known."""
    graph = host.graph
    talks = list(_talks(host))
    if not talks or any(host.last_arrival_ns) or any(
            other.last_arrival_ns[host.index] for other in graph.hosts):
        return
    ways = [graph.routes.of(sender, receiver, topic.name) for topic, sender, receiver in talks]
    lost: Counter[str] = Counter()
    for topic in {topic.name: topic for topic, _, _ in talks}.values():
        if not topic.counts.delivered:
            lost.update(topic.counts.dropped)
    if not any(ways):
        others = sorted({(sender.index if receiver == host.index else receiver)
                         for _, sender, receiver in talks})
        yield (f"host {host.name}: no message from or to it has arrived: it has no medium in "
               f"common with {_counted([graph.hosts[other].name for other in others])}, and no "
               "host forwards between them (network.media.<name>.hosts, topics, "
               "hosts.<name>.forwards)")
    elif _is_placeless(graph, host.index) and all(
            way is None or _needs_places(way, host.index) for way in ways):
        yield (f"host {host.name} has no place{_key_of_place(host.name, scenario)}, and no message "
               "from or to it has arrived: nobody hears such a host over a radio")
    elif lost:
        media = ", ".join(sorted({way.name for way in ways if isinstance(way, Medium)}))
        yield (f"host {host.name}: no message from or to it has arrived; of its topics were "
               f"dropped: {_listed(lost)}" + (
                   f": is {media} too slow for them, or the host out of reach there?" if media
                   else ""))


def _talks(host: Host) -> Iterator[tuple[Topic, Host, int]]:
    """The topics on which something was published from ``host`` to another one or from another one
    to it, with the sender and the receiver's index."""
    for topic in host.graph.topics.values():
        if not topic.counts.published:
            continue
        for sender in dict.fromkeys(publisher.host for publisher in topic.publishers):
            for receiver in topic.listening:
                if receiver != sender.index and host.index in (sender.index, receiver):
                    yield topic, sender, receiver


def _silent_flows(graph: Graph, scenario: Scenario) -> Iterator[str]:
    """Warnings of background traffic of which packets were dropped, and none has arrived."""
    names = [*(host.name for host in graph.hosts), *scenario.network.others]
    for number, flow in enumerate(graph.background):
        if flow.delivered or not flow.dropped:
            continue
        placeless = [names[end] for end in (flow.source, flow.receiver)
                     if _is_placeless(graph, end) and _needs_places(flow.medium, end)]
        yield (f"network.background.{number}: none of {flow.sent} packets from {flow.between[0]} "
               f"to {flow.between[1]} has arrived: {_listed(flow.dropped)}" + "".join(
                   f"; {name} has no place{_key_of_place(name, scenario)}, and nobody hears such a "
                   "host over a radio" for name in placeless[:1]))


def _needs_places(way: object, placeless: int) -> bool:
    """Whether a medium has antennas, or knows no way from a host without a place to anybody."""
    if not isinstance(way, Medium):
        return False
    model, others = way.model, (host for host in way.attached if host != placeless)
    return isinstance(model, HearsAntennas) or isinstance(model, Separates) and all(
        model.separates(placeless, other) for other in others)


def _is_placeless(graph: Graph, host: int) -> bool:
    """Whether a host, or one of others behind the graph's, has no place."""
    return bool(graph.media) and bool(
        np.isnan(graph.media[0].positions(graph.kernel.now_ns)[host]).any())


def _key_of_place(name: str, scenario: Scenario) -> str:
    """The key that gives a host a place, in brackets; empty for the workstation, which has none."""
    return next((f" ({path}.{name}.at)" for path, hosts in
                 (("hosts", scenario.hosts), ("network.others", scenario.network.others))
                 if name in hosts), "")


def _listed(counts: Mapping[str, int]) -> str:
    """Reasons with their numbers, the most frequent first."""
    return ", ".join(f"{counts[reason]} {reason}"
                     for reason in sorted(counts, key=lambda reason: (-counts[reason], reason)))


def _counted(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
