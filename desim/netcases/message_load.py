"""The messages of a scenario's software between hosts: topic, source, receivers, rate and size.

Topics, sources and receivers come from the software itself: its nodes start on hosts that only note
advertisements and subscriptions, and never run. Rates and sizes are not known before nodes run;
``paces`` has them.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import NamedTuple, TypedDict

from desim.engine.kernel import Kernel, Phase
from desim.engine.trace import Names, Trace
from desim.middleware.contents import (
    FLOAT64_BYTES,
    ODOMETRY_BYTES,
    TWIST_BYTES,
    Filler,
    laser_scan_bytes,
    occupancy_grid_bytes,
    point_cloud_bytes,
)
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription, Publisher, Subscription, WaitSet
from desim.ports import GridSpec
from desim.robot.sharing.kinds.own_maps import OwnMaps
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S


class Pace(NamedTuple):
    """Messages of ``size_bytes`` at ``rate_hz``. ``turn``: a sensor keeps the common grid of time,
    at this place among those of one instant; None: its node's timer decides."""

    rate_hz: Fraction
    size_bytes: int
    turn: int | None = None


class Wishes(TypedDict):
    """Keywords of ``Node.advertise``."""

    transport: str
    via: str
    queue: int
    latch: bool


class Talk(NamedTuple):
    """The messages of ``node`` of host ``source`` on ``topic`` (absolute) to other hosts, the
    ``receivers``; ``how``: the keywords of ``Node.advertise``."""

    source: str
    node: str
    topic: str
    receivers: tuple[str, ...]
    how: Wishes
    pace: Pace


def paces(scenario: Scenario, grid: GridSpec, map_bytes: int | None) -> dict[str, Pace]:
    """The rates and sizes of the messages of robots, by ``kind_of``, while they all drive and
    always have news. Scans come before poses, as from ``WorldEvents``."""
    robot, maps = scenario.robot, own_maps(scenario)
    pose = Pace(robot.odometry.rate_hz, ODOMETRY_BYTES, turn=2)
    monitor_hz = Fraction(NS_PER_S, scenario.testbed.monitor_period_ns)
    known = {
        **{topic: Pace(laser.rate_hz, laser_scan_bytes(laser.beams), turn=1)
           for topic, laser in robot.lasers_by_topic.items()},
        **({} if robot.sonar is None else {"sonar": Pace(
            robot.sonar.rate_hz, point_cloud_bytes(len(robot.sonar.transducers)), turn=3)}),
        "odom": pose,
        "true_pose": pose,
        "cmd_vel": Pace(robot.navigation.control_rate_hz, TWIST_BYTES),
        "explored_map": Pace(monitor_hz, occupancy_grid_bytes(
            grid.width * grid.height + robot.mapping.padding(grid.width * grid.height))),
        "distance": Pace(monitor_hz, FLOAT64_BYTES),
        **{one.topic: Pace(one.rate_hz, one.size_bytes) for one in robot.publishes},
    }
    if maps is not None and map_bytes is not None:
        known["map_exchange"] = Pace(Fraction(NS_PER_S, maps.period_ns), map_bytes)
    return known


def own_maps(scenario: Scenario) -> OwnMaps.Params | None:
    """The parameters of the sharing of maps, where it is the kind whose rate is known."""
    exchange = scenario.coordination.exchange
    params = None if exchange is None else exchange.params
    return params if isinstance(params, OwnMaps.Params) else None


def kind_of(topic: str) -> str:
    """``/map_exchange/robot_3`` is map_exchange, ``/robot_3/scan`` is scan."""
    _, first, rest = topic.split("/", 2)
    return first if first == "map_exchange" and "/" not in rest else rest


def talks(parts: Simulation, known: dict[str, Pace]) -> tuple[list[Talk], list[str]]:
    """The talks between the hosts of ``parts``, which has not run, in the order of hosts; and the
    topics between hosts whose rate is not known."""
    stages = _stages(parts)
    found, unknown = [], []
    for stage in stages:
        for node, topic, how in stage.advertised:
            receivers = tuple(other.name for other in stages
                              if other is not stage and topic in other.subscribed)
            pace = known.get(kind_of(topic))
            if not receivers:
                continue
            if pace is None:
                unknown.append(topic)
            else:
                found.append(Talk(stage.name, node, topic, receivers, how, pace))
    return found, unknown


class PacedNode(Node):
    """Publishes the messages of a node of this host, under its name, and so with its timers'
    phases."""

    def __init__(self, host: Host, name: str, talks: list[Talk]) -> None:
        super().__init__(host, name)
        self._talks = talks

    def start(self) -> None:
        by_timer: dict[tuple[Fraction, int | None], list[tuple[Publisher, Filler]]] = {}
        for talk in self._talks:
            by_timer.setdefault((talk.pace.rate_hz, talk.pace.turn), []).append(
                (self.advertise(talk.topic, **talk.how), Filler(talk.pace.size_bytes)))
        for (rate_hz, turn), words in by_timer.items():
            say = partial(self._publish_all, words)
            if turn is None:
                self.timer(rate_hz, say)
            else:
                self.host.graph.kernel.ticker(rate_hz, Phase.SENSE, turn, say, 0)

    def _publish_all(self, words: list[tuple[Publisher, Filler]], _: int) -> None:
        for publisher, word in words:
            publisher.publish(word)


class Listener(Node):
    """Subscribes to topics."""

    def __init__(self, host: Host, topics: list[str]) -> None:
        super().__init__(host, "listener")
        self._topics = topics

    def start(self) -> None:
        for topic in self._topics:
            self.subscribe(topic, lambda message: None)


def _stages(parts: Simulation) -> list[_Stage]:
    names = Names()
    graph = Graph(Kernel(), names, Trace(names), parts.streams, Direct(),
                  [host.name for host in parts.plan])
    stages = [_Stage(graph, host.name, host.index) for host in graph.hosts]
    for stage, plan in zip(stages, parts.plan, strict=True):
        for node in parts.nodes(stage, plan):
            node.start()
    return stages


class _Stage(Host):
    """A host that notes the advertisements and subscriptions of its nodes."""

    def __init__(self, graph: Graph, name: str, index: int) -> None:
        super().__init__(graph, name, index)
        self.advertised: list[tuple[str, str, Wishes]] = []
        self.subscribed: set[str] = set()

    def advertise(self, node: str, topic: str, transport: str, via: str, queue: int,
                  latch: bool) -> Publisher:
        how: Wishes = {"transport": transport, "via": via, "queue": queue, "latch": latch}
        self.advertised.append((node, topic, how))
        return super().advertise(node, topic, transport, via, queue, latch)

    def subscribe(self, node: str, topic: str, callback: Callable[[Message], object],
                  queue: int) -> Subscription:
        self.subscribed.add(topic)
        return Subscription(self.graph.topic(topic), callback, queue)

    def latest(self, node: str, topic: str, wait_set: WaitSet | None) -> PolledSubscription:
        self.subscribed.add(topic)
        return PolledSubscription(self)
