"""The way of real frames through one medium: from the TAP of a host to those of others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from desim.engine.kernel import Phase
from desim.loop.addresses import host_of, is_group
from desim.loop.capture import FrameCapture
from desim.loop.packets import protocol_of, size_on_wire, topic_of
from desim.loop.taps import HostTap
from desim.middleware.contents import Filler
from desim.middleware.graph import Graph
from desim.middleware.message import Message
from desim.network.carrier import Carrier
from desim.network.medium import Medium

_AT_ONCE = 64  # frames of one TAP
# From a program to the air pass up to so many ns, drawn by name, as interrupts and wake-ups take
# tens of us on Linux (our choice). Computing takes no time in the guest: without this, hosts that
# answer one broadcast would always collide.
STACK_NS = 100_000

Late = Callable[[int], object]  # is notified of the instant (ns) at which a frame was due


class Carried(NamedTuple):
    """A real frame, and the message that stands for it."""

    message: Message
    frame: bytes


class Conversation(Carrier[Carried]):
    """The frames of one host and topic on one medium. To the graph each is a message, so that
    tables, ``desim why`` and rules by topic know them as they know desim's own."""

    __slots__ = ("protocol", "_graph", "_taps", "_late")

    def __init__(self, graph: Graph, topic: str, taps: Mapping[int, HostTap], late: Late) -> None:
        self.protocol = protocol_of(topic)
        self._graph, self._taps, self._late = graph, taps, late

    def topics(self, token: Carried) -> tuple[str, ...]:
        return (token.message.topic,)

    def arrived(self, token: Carried, receiver: int) -> None:
        graph, (message, frame) = self._graph, token
        self._late(graph.kernel.now_ns)
        if self._taps[receiver].write(frame):
            graph.arrivals.note(message, graph.hosts[receiver], graph.kernel.now_ns,
                                message.born_ns, message.born_ns)
        else:
            graph.drop(message, receiver, "interface_down", message.born_ns, message.born_ns)

    def lost(self, token: Carried, receiver: int, reason: str) -> None:
        born_ns = token.message.born_ns
        self._graph.drop(token.message, receiver, reason, born_ns, born_ns)

    def repeated(self, token: Carried, receiver: int) -> None:
        self._graph.repeat(token.message, receiver)
        self._taps[receiver].write(token.frame)

    def missed(self, token: Carried, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        self._graph.miss(token.message, receivers, reason, medium)


class Gateway:
    """The TAPs of one medium. ``late`` as ``Conversation`` calls it; ``capture`` gets each frame
    that sets out."""

    def __init__(self, graph: Graph, medium: Medium, taps: Sequence[HostTap], late: Late,
                 capture: FrameCapture | None = None) -> None:
        self._graph, self._medium, self._late = graph, medium, late
        self._capture = capture
        self._taps = {tap.address.host: tap for tap in taps}
        self._others = {host: tuple(sorted(self._taps.keys() - {host})) for host in self._taps}
        self._conversations: dict[tuple[int, str], Conversation] = {}
        self._last_ns = dict.fromkeys(self._taps, 0)  # when each host's last frame set out
        self._draws = {host: graph.streams("loop", medium.name, graph.hosts[host].name)
                       for host in self._taps}
        self.frames = self.strays = 0  # those that were sent, and those of them to nobody

    def take(self, tap: HostTap, now_ns: int) -> None:
        """Read what the programs behind ``tap`` have sent at ``now_ns``. Each frame sets out a
        little later, after all before it."""
        host = tap.address.host
        for _ in range(_AT_ONCE):
            frame = tap.read()
            if frame is None:
                return
            self._last_ns[host] = at_ns = max(self._last_ns[host], now_ns + int(
                self._draws[host].integers(STACK_NS)))
            self._graph.kernel.at(at_ns, Phase.NETWORK, host, self._send, (host, frame))

    def _send(self, sent: tuple[int, bytes]) -> None:
        source, frame = sent
        self.frames += 1
        if self._capture is not None:
            self._capture.add(self._graph.kernel.now_ns, frame)
        receivers, size_bytes = self._receivers(source, frame[:6]), size_on_wire(frame)
        graph, host = self._graph, self._graph.hosts[source]
        if not receivers or not host.up:
            self.strays += 1
            graph.record_frame(host.id, host.id, 0, size_bytes)  # of no message: it goes nowhere
            return
        topic = topic_of(frame)
        carrier = self._conversations.get((source, topic))
        if carrier is None:
            carrier = Conversation(graph, topic, self._taps, self._late)
            self._conversations[source, topic] = carrier
        host.published += 1
        message = Message(host, graph.topic(topic), host.published, len(frame),
                          graph.kernel.now_ns, Filler(len(frame)))
        graph.depart(message, len(receivers))
        to = graph.hosts[receivers[0]].id if len(receivers) == 1 else self._medium.id
        graph.record_frame(host.id, to, message.seq, size_bytes)
        self._medium.transmit(source, receivers, size_bytes, 1, is_group(frame[:6]), carrier,
                              Carried(message, frame))

    def _receivers(self, source: int, to: bytes) -> tuple[int, ...]:
        if is_group(to):
            return self._others.get(source, ())
        receiver = host_of(to)
        return (receiver,) if receiver in self._others.get(source, ()) else ()
