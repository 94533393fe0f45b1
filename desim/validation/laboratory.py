"""A laboratory for middleware: hosts on one network that publish and listen, and a tap on the wire.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from statistics import median
from typing import ClassVar, NamedTuple

from desim import plugins, ports
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.contents import Filler
from desim.middleware.graph import Graph
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.tcp import StreamMessage
from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from desim.ports.cases import Check
from desim.ports.middleware import Middleware
from desim.units import NS_PER_S

KNOWN_ADDRESSES = {"arp": "static"}  # of TCP's parameters: how it was measured
CHECK_SEQUENCE_BYTES = 4  # of an Ethernet packet; tcpdump does not see it


class LabMessage(NamedTuple):
    """A message of which only its number matters."""

    seq: int
    topic: str = "/bench"


def lab_message(seq: int) -> StreamMessage[LabMessage]:
    """A message as TCP sees one."""
    return StreamMessage(LabMessage(seq))


class LabNode(Node):
    """A node that acts as a row of the validation describes; ``received`` is its log: (time in s,
    topic, number, born in s)."""

    def __init__(self, host: Host, begin: Callable[[LabNode], object]) -> None:
        super().__init__(host, "node")
        self._begin = begin
        self.received: list[tuple[float, str, int, float]] = []

    def start(self) -> None:
        self._begin(self)

    def publishes(self, topic: str, size_bytes: int, rate_hz: int, *, transport: str = "stream",
                  queue: int = 1) -> None:
        """Publish ``topic`` at this rate from now on; 0: never."""
        self.advertise(topic, transport=transport, queue=queue)
        if rate_hz:
            self.timer(rate_hz, lambda _: self.publish(topic, Filler(size_bytes)),
                       start="zero")

    def listens(self, topic: str, queue: int = 0) -> None:
        """Log all messages of ``topic``."""
        self.subscribe(topic, self._log, queue=queue)

    def _log(self, message: Message) -> None:
        self.received.append((self.now_ns / NS_PER_S, message.topic, message.seq,
                           message.born_ns / NS_PER_S))


class Tap:
    """Sees every frame that is sent, as tcpdump does at its sender. A rule that lets all pass."""

    Params = ports.Params
    reasons: ClassVar[tuple[str, ...]] = ()

    def __init__(self) -> None:
        self.bytes = self.packets = 0

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        """Nothing to prepare."""

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> None:
        self.packets += frame.segments
        self.bytes += frame.size_bytes - CHECK_SEQUENCE_BYTES * frame.segments


class Lossy:
    """A rule that loses each packet with ``probability`` from an instant on."""

    Params = ports.Params

    def __init__(self, probability: float, from_s: float) -> None:
        loss = plugins.load("rule", "loss")
        self._loss = loss(loss.Params(probability=probability))
        self._from_ns = round(from_s * NS_PER_S)
        self.reasons = self._loss.reasons

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._loss.start(context, hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict] | None:
        if self._context.now_ns < self._from_ns:
            return None
        return self._loss.judge(frame, receivers)


class Laboratory:
    """Hosts with one node each, on a LAN. ``lives``: the function that begins each host's node; the
    k-th host starts at ``starts_s[k]`` (default: all at once). In each of ``cuts``, (from, until)
    in s, the first host is cut off. ``rules`` act on all frames."""

    def __init__(self, lives: Mapping[str, Callable[[LabNode], object]], middleware: Middleware, *,
                 delay: str = "50 us", cuts: Sequence[tuple[float, float]] = (),
                 starts_s: Sequence[float] = (), rules: Sequence[ports.Rule] = (),
                 seed: int = 0) -> None:
        self.kernel, names, streams = Kernel(), Names(), Streams(seed)
        trace = Trace(names)
        self.graph = Graph(self.kernel, names, trace, streams, middleware, lives)
        self.tap = Tap()
        ideal = plugins.load("network", "ideal")
        hosts = [host.name for host in self.graph.hosts]
        rules = [self.tap, *(_apart(next(iter(lives)), *cut) for cut in cuts), *rules]
        self.graph.attach(Medium(
            "lan", ideal(ideal.Params(delay=delay)), rules, kernel=self.kernel, names=names,
            streams=streams, hosts=hosts, place=Nowhere(len(hosts))))
        self._nodes: dict[str, LabNode] = {}
        self._starts_s = dict(zip(lives, starts_s or [0.0] * len(lives), strict=True))
        for name, begin in lives.items():
            host = self.graph.host(name)
            host.software = partial(self._software, begin)
            self.kernel.at(round(self._starts_s[name] * NS_PER_S), Phase.WORLD, host.id,
                           Host.start, host)

    def run(self, until_s: float) -> Laboratory:
        self.kernel.run(round(until_s * NS_PER_S))
        return self

    def node(self, host: str) -> LabNode:
        """The node of a host that has started."""
        return self._nodes[host]

    def _software(self, begin: Callable[[LabNode], object], host: Host) -> list[Node]:
        node = self._nodes[host.name] = LabNode(host, begin)
        return [node]

    def received_after(self, host: str, time_s: float, of: str | None = None) -> float:
        """The time in s from this instant to the next message at ``host`` (``of`` this topic); NaN:
        none arrived."""
        return next((at - time_s for at, topic, *_ in self.node(host).received
                     if at > time_s and of in (None, topic)), float("nan"))


def _apart(host: str, from_s: float, until_s: float) -> ports.Rule:
    partition = plugins.load("rule", "partition")
    return partition(partition.Params(groups=[[host]], **{
        "from": f"{from_s * 1000:.3f} ms", "until": f"{until_s * 1000:.3f} ms"}))


def within(share: float, what: str, simulated: float, measured: float, unit: str = "") -> Check:
    """A check that two numbers differ by at most a share of the measured one."""
    return Check(what, simulated, measured, share * abs(measured), unit)


def alike(what: str, simulated: Sequence[float], measured: Sequence[float],
          unit: str) -> list[Check]:
    """Checks of a quantity that scatters: medians within 15 %, and ranges that overlap."""
    apart = max(min(simulated) - max(measured), min(measured) - max(simulated), 0.0)
    return [within(0.15, f"{what}: median", median(simulated), median(measured), unit),
            Check(f"{what}: between the ranges", apart, 0.0, 0.0, unit)]
