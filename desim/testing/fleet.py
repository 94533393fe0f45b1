"""A few hosts that talk to each other, and an account of who heard what.

Each host ``h`` publishes ``/report/h``, a stream to all others, ``/beat/h``, datagrams to all
others but the next one, and ``/news``, a stream of all hosts to all but the first one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from desim import ports
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.graph import Graph
from desim.middleware.graph_options import GraphOptions
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from desim.ports.middleware import Middleware
from desim.testing.medium_bench import ImmediateNetwork
from desim.units import NS_PER_S

HOSTS = ("host_1", "host_2", "host_3", "host_10")
TALK_NS = NS_PER_S // 2  # between two messages of a topic
_BALANCES = 10  # of the accounts in this time
_SIZES = (40, 300, 20_000)  # bytes, in turn


class Apart:
    """A rule that a test switches: hosts reach each other if they have the same number in
    ``groups``."""

    Params = ports.Params
    reasons: tuple[str, ...] = ("apart",)

    def __init__(self, hosts: int) -> None:
        self.groups = [0] * hosts

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        """There is nothing to do."""

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [ports.Drop("apart") if self.separates(frame.source, receiver) else ports.PASS
                for receiver in receivers]

    def separates(self, host: int, other: int) -> bool:
        return self.groups[host] != self.groups[other]


class Payload(NamedTuple):
    """The content of a message: the ``number``-th of all, by ``source``."""

    source: int
    number: int
    size_bytes: int


class _Talker(Node):
    """The node of a host."""

    def __init__(self, host: Host, fleet: Fleet) -> None:
        super().__init__(host, "talker")
        self._fleet = fleet

    def start(self) -> None:
        own, fleet = self.host.index, self._fleet
        for topic in fleet.topics_of(own):
            self.advertise(topic, transport="datagram" if "beat" in topic else "stream", queue=0)
        for topic in fleet.listens(own):
            self.subscribe(topic, self._hear, queue=0)

    def _hear(self, message: Message) -> None:
        if message.source != self.host.index:
            self._fleet.heard(self.host.index, message)


class Fleet:
    """``hosts`` over one medium of ``model`` (without one: everything arrives at once) and
    ``rules``.

    ``apart.groups`` keeps hosts from each other. ``faults`` has in words what went wrong so far:
    a message with two fates, one delivered to a host that does not run or does not listen, one
    heard twice, an account that does not balance.
    """

    def __init__(self, middleware: Middleware, hosts: Sequence[str] = HOSTS, *,
                 model: ports.NetworkModel | None = None, rules: Sequence[ports.Rule] = (),
                 seed: int = 0) -> None:
        self.kernel, names = Kernel(), Names()
        self.trace, streams = Trace(names), Streams(seed)
        self.graph = Graph(self.kernel, names, self.trace, streams, middleware, hosts,
                           GraphOptions(on_fate=self._fate))
        self.hosts = self.graph.hosts
        self.apart = Apart(len(self.hosts))
        self.graph.attach(Medium("lan", model or ImmediateNetwork(), [self.apart, *rules],
                                 kernel=self.kernel, names=names, streams=streams,
                                 hosts=[host.name for host in self.hosts],
                                 place=Nowhere(len(self.hosts))))
        self.said: list[tuple[Payload, str, int]] = []  # content, topic, time of birth in ns
        self.faults: list[str] = []
        self.times: dict[tuple[int, int], int] = {}  # message, host: how often heard
        self._listeners: dict[tuple[str, int], list[int]] = {}
        self._fates: dict[tuple[int, int], str | None] = {}
        self._somebody_stopped = False
        for host in self.hosts:
            host.software = lambda host: [_Talker(host, self)]
        self.graph.start()

    # ------------------------------------------------------------------------- who says what

    def topics_of(self, host: int) -> tuple[str, str, str]:
        """The topics that ``host`` publishes."""
        name = self.hosts[host].name
        return f"/report/{name}", f"/beat/{name}", "/news"

    def listens(self, host: int) -> Iterator[str]:
        """The topics that ``host`` listens to."""
        count = len(self.hosts)
        for other in range(count):
            if other != host:
                report, beat, _ = self.topics_of(other)
                yield report
                if host != (other + 1) % count:
                    yield beat
        if host:
            yield "/news"

    def listeners(self, topic: str, source: int) -> list[int]:
        """The hosts that are to hear what ``source`` publishes on ``topic``."""
        known = self._listeners.get((topic, source))
        if known is None:
            known = self._listeners[topic, source] = [
                host for host in range(len(self.hosts))
                if host != source and topic in self.listens(host)]
        return known

    # ------------------------------------------------------------------------- what a test does

    def run(self, duration_ns: int) -> None:
        """Let time pass."""
        self.kernel.run(self.kernel.now_ns + duration_ns)

    def talk(self, duration_ns: int) -> None:
        """Let time pass. Each host that runs publishes on all its topics every half second."""
        end_ns = self.kernel.now_ns + duration_ns
        while self.kernel.now_ns < end_ns:
            now_ns = self.kernel.now_ns
            for host in self.hosts:
                self.kernel.at(now_ns, Phase.CONTROL, host.id, self._speak, host)
            for step in range(1, _BALANCES + 1):
                self.kernel.run(min(end_ns, now_ns + step * TALK_NS // _BALANCES))
                self.balance()

    def stop(self, host: int) -> None:
        self._somebody_stopped = True
        self._now(self.hosts[host].stop)

    def start(self, host: int) -> None:
        self._now(self.hosts[host].start)

    def _now(self, fn: Callable[[], object]) -> None:
        """As an event of its own, as in a run."""
        self.kernel.after(1, Phase.WORLD, 0, lambda _: fn())
        self.run(1)

    def _speak(self, host: Host) -> None:
        if not host.up:
            return
        for topic in self.topics_of(host.index):
            number = len(self.said)
            payload = Payload(host.index, number, _SIZES[number % len(_SIZES)])
            self.said.append((payload, topic, self.kernel.now_ns))
            host.nodes[0].publish(topic, payload)

    # ------------------------------------------------------------------------- what came of it

    def heard(self, host: int, message: Message) -> None:
        payload: Payload = message.content
        key = payload.number, host
        self.times[key] = times = self.times.get(key, 0) + 1
        if times > 1:
            self._fault(f"{self.hosts[host].name} heard message {message.number} of "
                        f"{message.topic} {times} times")

    def unheard(self, since: int = 0) -> list[str]:
        """A line for each message from ``said[since]`` on that a host has not heard which runs and
        listens."""
        return [f"{self.hosts[host].name} has not heard what {self.hosts[payload.source].name} "
                f"said on {topic} at {time_ns / NS_PER_S:g} s"
                for payload, topic, time_ns in self.said[since:]
                for host in self.listeners(topic, payload.source)
                if self.hosts[host].up and (payload.number, host) not in self.times]

    def balance(self) -> None:
        """Check that each reception under way waits in a transport. (A stopped host's last frames
        are the medium's.)"""
        self.graph.catch_up()
        for topic in self.graph.topics.values():
            under_way = topic.counts.in_flight
            waiting = sum(publisher.transport.waiting() for publisher in topic.publishers)
            if waiting > under_way or (waiting < under_way and not self._somebody_stopped):
                self._fault(f"of {topic.name} {under_way} receptions are neither delivered nor "
                            f"dropped, and {waiting} wait in transports")

    def open(self) -> int:
        """Receptions that are neither delivered nor dropped."""
        self.graph.catch_up()
        return sum(topic.counts.in_flight for topic in self.graph.topics.values())

    def _fate(self, message: Message, receiver: int, time_ns: int, reason: str | None,
              first_ns: int, last_ns: int) -> None:
        key, host = (message.number, receiver), self.hosts[receiver]
        if key in self._fates:
            self._fault(f"message {message.number} of {message.topic} has two fates at "
                        f"{host.name}: {self._fates[key] or 'delivered'} and "
                        f"{reason or 'delivered'}")
        self._fates[key] = reason
        if receiver not in self.listeners(message.topic, message.source):
            self._fault(f"a message of {message.topic} by {message.origin.name} was sent to "
                        f"{host.name}, which does not listen")
        if reason is None and not host.up:
            self._fault(f"message {message.number} of {message.topic} was delivered to "
                        f"{host.name}, which does not run")

    def _fault(self, text: str) -> None:
        self.faults.append(f"{text}, at {self.kernel.now_ns / NS_PER_S:g} s")
