"""Will this network carry the messages of this fleet?

Plays a scenario's topics, transports and media without its robots: nodes publish messages of the
same sizes at the same rates, on hosts that stand still. The messages that are published during the
measurement count; for their fates one more period of the slowest topic is played. Delivered means
that the receiving host has the message.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import Field

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.graph_options import GraphOptions
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.monitor.traffic import family
from desim.monitor.utilisation import busy_ns, utilisation
from desim.netcases.case import Measures
from desim.netcases.map_message_size import free_place, whole_map_bytes
from desim.netcases.message_load import Listener, PacedNode, Talk, own_maps, paces, talks
from desim.network.medium import Medium
from desim.network.surroundings import Still
from desim.ports import Params
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.simulation.wiring import HostPlaces, wired
from desim.units import NS_PER_S, ByteSize, Period, Ratio


class FleetLoad(Params):
    """The load of a scenario's topics on its network: sends the messages of its robots, for some
    time and without robots, and reports what arrives, when, and how busy the media are.

    The software of the scenario decides the topics, publishers and subscribers; its sensors,
    controllers and periods the rates and sizes. All robots always drive, and always have a new map
    to send. Faults are left out.
    """

    scenario: str = Field(description="a scenario's YAML file")
    overrides: tuple[str, ...] = Field((), alias="set", examples=["A.B.C=VALUE"], description=(
        "another value of the scenario; can be given again"))
    map_bytes: ByteSize | None = Field(None, examples=["20000 B"], description=(
        "of a map update between robots (a robot's map of the whole terrain, in the scenario's "
        "content and encoding)"))
    spread: bool = Field(False, description="robots stand anywhere in the terrain, drawn by the "
                                            "seed (where they start)")
    duration_ns: Period = Field("20 s", description="that is measured, after one period of the "
                                                    "slowest topic (four updates of gmapping)")
    enough: Ratio = Field("99 %", description="of the messages of each topic must arrive, and 95 % "
                                              "of those before the next one is due (a guess)")


class FamilyAccount:
    """The fates of the messages of one family of topics that were born in time."""

    def __init__(self) -> None:
        self.talks: list[Talk] = []
        self.sent = 0
        self.delays_ns: list[int] = []
        self.lost: dict[str, int] = {}

    def settle(self, delay_ns: int, reason: str | None) -> None:
        if reason is None:
            self.delays_ns.append(delay_ns)
        else:
            self.lost[reason] = self.lost.get(reason, 0) + 1

    def measures(self, duration_ns: int) -> Measures:
        pace, delivered = self.talks[0].pace, len(self.delays_ns)
        lost = dict(sorted(self.lost.items()))
        lost["in_flight"] = self.sent - delivered - sum(lost.values())
        delays_ms = np.array(self.delays_ns) / 1e6
        p95, p99 = np.percentile(delays_ms, (95, 99)).tolist() if delivered else (None, None)
        return {
            "senders": len({talk.source for talk in self.talks}),
            "receivers": len({name for talk in self.talks for name in talk.receivers}),
            "rate_hz": float(pace.rate_hz), "size_bytes": pace.size_bytes,
            "offered_mbps": self.sent * pace.size_bytes * 8e3 / duration_ns,
            "sent": self.sent, "delivered": delivered,
            "lost": {reason: count for reason, count in lost.items() if count},
            "delivery_ratio": delivered / self.sent if self.sent else None,
            "delay_mean_ms": float(delays_ms.mean()) if delivered else None,
            "delay_p95_ms": p95, "delay_p99_ms": p99,
        }


class Reading(NamedTuple):
    """A medium's counters at one moment."""

    offered_bytes: int
    rx_bytes: int
    delivered: int
    dropped: dict[str, int]
    packets_delivered: int
    packets_dropped: dict[str, int]
    busy_ns: np.ndarray | None

    @classmethod
    def of(cls, medium: Medium) -> Reading:
        return cls(sum(medium.tx_bytes) + medium.refused_bytes, sum(medium.rx_bytes),
                   medium.delivered, dict(medium.dropped), medium.packets_delivered,
                   dict(medium.packets_dropped), busy_ns(medium))

    def measures(self, medium: Medium, duration_ns: int) -> Measures:
        """The measures of ``medium`` since this reading, ``duration_ns`` ago; with all headers, and
        repetitions of transports. ``frames`` and ``packets`` are those whose fate was settled, per
        receiver; a frame counts as lost when all of its packets are."""
        now = Reading.of(medium)
        lost = _since(self.dropped, now.dropped)
        packets_lost = _since(self.packets_dropped, now.packets_dropped)
        return {"offered_mbps": (now.offered_bytes - self.offered_bytes) * 8e3 / duration_ns,
                "carried_mbps": (now.rx_bytes - self.rx_bytes) * 8e3 / duration_ns,
                "utilisation": utilisation(
                    medium, duration_ns, 0 if self.busy_ns is None else self.busy_ns),
                "frames": now.delivered - self.delivered + sum(lost.values()), "lost": lost,
                "packets": (now.packets_delivered - self.packets_delivered
                            + sum(packets_lost.values())), "packets_lost": packets_lost}


def _since(before: dict[str, int], now: dict[str, int]) -> dict[str, int]:
    """Counts by reason since ``before``, without zeros."""
    return {reason: more for reason, count in sorted(now.items())
            if (more := count - before.get(reason, 0))}


class LoadRun:
    """The network of ``parts``, which has not run, with the talks ``advertised`` on it. Messages
    count that are born from ``begin_ns``, exclusive, to ``end_ns``."""

    def __init__(self, parts: Simulation, advertised: list[Talk], spread: bool, begin_ns: int,
                 end_ns: int) -> None:
        self._said, self._begin_ns, self._end_ns = advertised, begin_ns, end_ns
        hosts = [host.name for host in parts.plan]
        self._families: dict[str, FamilyAccount] = {}
        self._accounts: dict[str, FamilyAccount] = {}  # by topic
        for talk in advertised:
            account = self._families.setdefault(family(talk.topic, frozenset(hosts)),
                                                FamilyAccount())
            account.talks.append(talk)
            self._accounts[talk.topic] = account
        kernel, streams = Kernel(), Streams(parts.scenario.seed)
        place = Still(_positions(parts, streams, spread))
        place.obstacles = parts.world.obstacles()
        place.antennas = _host_places(parts).antennas
        self.graph = wired(parts.scenario, place, kernel, Trace(Names()), streams, hosts,
                           GraphOptions(on_fate=self._settle))
        for host in self.graph.hosts:
            host.software = self._nodes

    def played(self) -> tuple[Measures, Measures]:
        """The measures of each family of topics, and of each medium."""
        graph, duration_ns = self.graph, self._end_ns - self._begin_ns
        graph.start()
        graph.kernel.run(self._begin_ns)
        self._count_sent(-1)
        before = [Reading.of(medium) for medium in graph.media]
        graph.kernel.run(self._end_ns)
        self._count_sent(1)
        media = {medium.name: reading.measures(medium, duration_ns)
                 for medium, reading in zip(graph.media, before, strict=True)}
        graph.kernel.run(self._end_ns + self._begin_ns)
        return {name: account.measures(duration_ns)
                for name, account in sorted(self._families.items())}, media

    def _count_sent(self, sign: int) -> None:
        for topic, account in self._accounts.items():
            account.sent += sign * self.graph.topic(topic).counts.intended

    def _settle(self, message: Message, receiver: int, time_ns: int, reason: str | None,
                *_: int) -> None:
        if self._begin_ns < message.born_ns <= self._end_ns:
            self._accounts[message.topic].settle(time_ns - message.born_ns, reason)

    def _nodes(self, host: Host) -> list[Node]:
        by_node: dict[str, list[Talk]] = {}
        for talk in self._said:
            if talk.source == host.name:
                by_node.setdefault(talk.node, []).append(talk)
        subscribed = [talk.topic for talk in self._said if host.name in talk.receivers]
        return [*(PacedNode(host, node, advertised) for node, advertised in by_node.items()),
                Listener(host, subscribed)]


def play(scenario: Scenario, params: FleetLoad) -> Measures:
    """``topics`` (by family) and ``media`` (by name) with their measures, of ``measured_s``, and
    of ``awaited_s`` behind them in which messages may still arrive; what was assumed: ``spread``;
    ``map_bytes`` of an update (None: robots exchange no maps), and ``map_given``; ``left_out``,
    topics that cross, but nobody says how often. Raises ``InputError`` for what does not fit
    together."""
    parts = Simulation(scenario)
    map_bytes, maps = params.map_bytes, own_maps(scenario)
    if map_bytes is None and maps is not None and parts.world.robots:
        map_bytes = whole_map_bytes(parts, maps, Streams(scenario.seed))
    advertised, left_out = talks(parts, paces(scenario, parts.grid, map_bytes))
    longest_ns = max((round(NS_PER_S / talk.pace.rate_hz) for talk in advertised), default=0)
    topics, media = LoadRun(parts, advertised, params.spread, longest_ns,
                            longest_ns + params.duration_ns).played()
    hosts = frozenset(host.name for host in parts.plan)
    return {"hosts": len(hosts), "measured_s": params.duration_ns / NS_PER_S,
            "awaited_s": longest_ns / NS_PER_S, "spread": params.spread, "map_bytes": map_bytes,
            "map_given": params.map_bytes is not None,
            "left_out": sorted({family(topic, hosts) for topic in left_out}),
            "topics": topics, "media": media}


def _host_places(parts: Simulation) -> HostPlaces:
    return HostPlaces(parts.world, parts.plan, parts.scenario.network.others.values())


def _positions(parts: Simulation, streams: Streams, spread: bool) -> np.ndarray:
    """[hosts, 2] m where hosts start, or with robots on free cells that their names draw."""
    places = _host_places(parts).positions(0).copy()
    if spread:
        for index, host in enumerate(parts.plan):
            if host.robot is not None:
                places[index] = free_place(parts.monitor.truth.ground, streams, "spread", host.name)
    return places
