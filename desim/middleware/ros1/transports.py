"""TCPROS and UDPROS at the publisher."""

from __future__ import annotations

from collections import deque

from desim.middleware.headers import LENGTH_BYTES
from desim.middleware.message import Message
from desim.middleware.ros1.client import RosPublication
from desim.middleware.ros1.links import RosLink
from desim.middleware.tcp import Connection, StreamMessage
from desim.middleware.transports import LinkedTransport
from desim.ports.middleware import MiddlewareContext, Transport


class Tcpros(LinkedTransport["Outlet"]):
    """One publisher's messages over the links of its process and topic, with an outbox for each. A
    host with a new link is a new receiver: messages that it did not get over the old one are
    dropped as ``link_closed``. ``unfinished``: the messages in all outboxes and sockets, which is
    asked for after each callback where memory has a limit: adding them up took 2 % of a run of
    cluster.yaml with thirty robots, by a profile."""

    def __init__(self, context: MiddlewareContext, source: int, publication: RosPublication,
                 limit: int, blocks: bool) -> None:
        def link_to(receiver: int, outlet: Outlet | None) -> Outlet:
            connection = publication.connections[receiver]
            if outlet is None or outlet.connection is not connection:
                return Outlet(self, context, source, receiver, connection, limit, blocks)
            return outlet

        super().__init__(link_to, context.drop)
        self.unfinished = 0

    def waiting(self) -> int:
        return self.unfinished


class Outlet:
    """The way to one subscriber: an outbox of ``limit`` messages (0: any number) that drops its
    oldest, and the messages in the socket. roscpp writes one more when poll() reports room; a
    thread of rospy ``blocks`` in sendall(), and goes on as long as the socket takes some
    (tcpros_pubsub.py QueuedConnection)."""

    __slots__ = ("connection", "_transport", "_context", "_sender", "_receiver", "_limit",
                 "_blocks", "_outbox", "_written", "_closed")

    def __init__(self, transport: Tcpros, context: MiddlewareContext, source: int, receiver: int,
                 connection: Connection, limit: int, blocks: bool) -> None:
        self.connection = connection
        self._transport = transport
        self._context = context
        self._sender = connection.sender(source)
        self._receiver = receiver
        self._limit, self._blocks = limit, blocks
        self._outbox: deque[Message] = deque()
        self._written: deque[StreamMessage[Message]] = deque()
        self._closed = False

    def offer(self, message: Message) -> None:
        self._transport.unfinished += 1
        outbox = self._outbox
        sender = self._sender
        if not outbox and (sender.takes if self._blocks else sender.writable):
            self._write(message)
            return
        outbox.append(message)
        if len(outbox) == 1:
            sender.when_writable(self._go_on)
        elif 0 < self._limit < len(outbox):
            self._transport.unfinished -= 1
            self._context.drop(outbox.popleft(), self._receiver, "outbox_full")

    def close(self, reason: str) -> None:
        """Drop all messages that wait or have not arrived. Later arrivals have no effect."""
        self._closed = True
        self._transport.unfinished -= self.waiting
        drop, receiver = self._context.drop, self._receiver
        for written in self._written:
            drop(written.message, receiver, reason, written.first_ns, written.last_ns)
        for message in self._outbox:
            drop(message, receiver, reason)
        self._written.clear()
        self._outbox.clear()

    @property
    def waiting(self) -> int:
        return len(self._written) + len(self._outbox)

    def _write(self, message: Message) -> None:
        written = StreamMessage(message)
        self._written.append(written)
        self._sender.send(message.size_bytes + LENGTH_BYTES, self._arrived, written, None)

    def _arrived(self, written: StreamMessage[Message]) -> None:
        if not self._closed:
            self._written.popleft()
            self._transport.unfinished -= 1
            self._context.deliver(written.message, self._receiver, written.first_ns,
                                  written.last_ns)

    def _go_on(self) -> None:
        if self._closed:
            return
        outbox, sender = self._outbox, self._sender
        while outbox and (sender.takes if self._blocks else sender.writable):
            self._write(outbox.popleft())
        if outbox:
            sender.when_writable(self._go_on)


class Udpros:
    """Sends ``datagrams`` to all subscribers that have asked for them, for ever: a publisher never
    learns that one is gone. A subscriber that asks again is a new receiver."""

    def __init__(self, datagrams: Transport, publication: RosPublication) -> None:
        self._datagrams, self._publication = datagrams, publication
        self._asked: dict[int, RosLink] = {}
        self.send, self.close, self.waiting = datagrams.send, datagrams.close, datagrams.waiting

    def connect(self, receivers: list[int]) -> list[int]:
        links = self._publication.links
        asked = {receiver: links[receiver] for receiver in receivers}
        self._datagrams.connect([receiver for receiver in receivers
                                 if self._asked.get(receiver) is asked[receiver]])
        self._asked = asked
        return self._datagrams.connect(receivers)
