"""What the software of a scenario says between hosts: which topic, from whom to whom, how often and
how large.

Who says what to whom is asked of the software itself: its nodes start on hosts that only note what
is advertised and subscribed to, and never run. How often and how large is not theirs to say before
they run; it stands in ``paces``.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

from desim.engine.kernel import Kernel, Phase
from desim.engine.trace import Names, Trace
from desim.middleware.graph import Graph, Host, Message, Node
from desim.middleware.messages import (
    FLOAT64_BYTES,
    ODOMETRY_BYTES,
    TWIST_BYTES,
    laser_scan_bytes,
    occupancy_grid_bytes,
)
from desim.middleware.topics import Latest, Publisher
from desim.ports import GridSpec
from desim.ports.middleware import Endpoint, MiddlewareContext, Offer
from desim.scenario.schema.whole import Scenario
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S


class Pace(NamedTuple):
    """A message of ``size_bytes`` at ``rate_hz``. ``turn`` of a sensor, which keeps the common grid
    of time: its place among those of one instant; None: whenever its node's timer says."""

    rate_hz: Fraction
    size_bytes: int
    turn: int | None = None


class Talk(NamedTuple):
    """What ``node`` of host ``source`` says on ``topic`` (absolute) to other hosts, ``receivers``;
    ``how``: the keywords of ``Node.advertise``."""

    source: str
    node: str
    topic: str
    receivers: tuple[str, ...]
    how: dict[str, Any]
    pace: Pace


def paces(scenario: Scenario, grid: GridSpec, map_bytes: int) -> dict[str, Pace]:
    """How often and how large what robots say is, by ``kind_of``, while they all drive and have
    always something new to tell. Scans come before poses, as from ``WorldClock``."""
    robot, exchange = scenario.robot, scenario.coordination.exchange
    pose = Pace(robot.odometry.rate_hz, ODOMETRY_BYTES, turn=2)
    monitor_hz = Fraction(NS_PER_S, scenario.testbed.monitor_period_ns)
    known = {
        "scan": Pace(robot.scanner.rate_hz, laser_scan_bytes(robot.scanner.beams), turn=1),
        "odom": pose,
        "true_pose": pose,
        "cmd_vel": Pace(robot.navigation.control_rate_hz, TWIST_BYTES),
        "explored_map": Pace(monitor_hz, occupancy_grid_bytes(grid.width * grid.height)),
        "distance": Pace(monitor_hz, FLOAT64_BYTES),
    }
    if exchange is not None:
        known["map_exchange"] = Pace(Fraction(NS_PER_S, exchange.period_ns), map_bytes)
    return known


def kind_of(topic: str) -> str:
    """``/map_exchange/robot_3`` is map_exchange, ``/robot_3/scan`` is scan."""
    _, first, *_, last = topic.split("/")
    return first if first == "map_exchange" else last


def talks(parts: Simulation, known: dict[str, Pace]) -> tuple[list[Talk], list[str]]:
    """What crosses between the hosts of ``parts``, which has not run, in the order of hosts; and
    the topics that cross, too, but of which nobody says how often."""
    stages = _stages(parts)
    found, unknown = [], []
    for stage in stages:
        for node, topic, how in stage.said:
            receivers = tuple(other.name for other in stages
                              if other is not stage and topic in other.heard)
            pace = known.get(kind_of(topic))
            if receivers and pace is None:
                unknown.append(topic)
            elif receivers:
                found.append(Talk(stage.name, node, topic, receivers, how, pace))
    return found, unknown


class Word(NamedTuple):
    """A content that is nothing but large."""

    size_bytes: int


class Speaker(Node):
    """Says what a node of this host would say. It has that node's name, and so its timers' phases.
    """

    __slots__ = ("_talks",)

    def __init__(self, host: Host, name: str, talks: list[Talk]) -> None:
        super().__init__(host, name)
        self._talks = talks

    def start(self) -> None:
        by_timer: dict[tuple, list[tuple[Publisher, Word]]] = {}
        for talk in self._talks:
            by_timer.setdefault((talk.pace.rate_hz, talk.pace.turn), []).append(
                (self.advertise(talk.topic, **talk.how), Word(talk.pace.size_bytes)))
        for (rate_hz, turn), words in by_timer.items():
            say = partial(self._say, words)
            if turn is None:
                self.timer(rate_hz, say)
            else:
                self.host.graph.kernel.ticker(rate_hz, Phase.SENSE, turn, say, 0)

    def _say(self, words: list[tuple[Publisher, Word]], _: int) -> None:
        for publisher, word in words:
            publisher.publish(word)


class Listener(Node):
    """Hears topics."""

    __slots__ = ("_topics",)

    def __init__(self, host: Host, topics: list[str]) -> None:
        super().__init__(host, "listener")
        self._topics = topics

    def start(self) -> None:
        for topic in self._topics:
            self.subscribe(topic, self._heard)

    def _heard(self, message: Message) -> None: ...


def _stages(parts: Simulation) -> list[_Stage]:
    names = Names()
    graph = Graph(Kernel(), names, Trace(names), parts.streams, _Nobody(),
                  [host.name for host in parts.plan])
    stages = [_Stage(graph, host.name, host.index) for host in graph.hosts]
    for stage, plan in zip(stages, parts.plan, strict=True):
        for node in parts.nodes(stage, plan):
            node.start()
    return stages


class _Stage(Host):
    """A host that notes what its nodes want to say and to hear."""

    __slots__ = ("said", "heard")

    def __init__(self, graph: Graph, name: str, index: int) -> None:
        super().__init__(graph, name, index)
        self.said: list[tuple[str, str, dict[str, Any]]] = []
        self.heard: set[str] = set()

    def advertise(self, node: str, topic: str, transport: str, via: str, queue: int,
                  latch: bool) -> Publisher:
        how = {"transport": transport, "via": via, "queue": queue, "latch": latch}
        self.said.append((node, self.absolute(topic), how))
        return super().advertise(node, topic, transport, via, queue, latch)

    def subscribe(self, node: str, topic: str, callback: Callable[[Message], Any],
                  queue: int) -> None:
        self.heard.add(self.absolute(topic))

    def latest(self, node: str, topic: str) -> Latest:
        self.heard.add(self.absolute(topic))
        return Latest()


class _Nobody:
    """A registry in which nobody finds anybody."""

    def start(self, context: MiddlewareContext) -> None: ...

    def advertise(self, offer: Offer) -> None: ...

    def subscribe(self, subscriber: Endpoint) -> None: ...

    def switched(self, host: int, up: bool) -> None: ...

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        return ()
