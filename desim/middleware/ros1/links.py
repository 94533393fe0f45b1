"""The subscriber's end of one link: requestTopic, connection, headers, and retries."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.middleware.ros1.master import Uri
from desim.middleware.ros1.parameters import Retries
from desim.middleware.ros1.sizes import HEADER, HEADER_ANSWER, REQUEST_TOPIC
from desim.middleware.tcp import Connection
from desim.ports.middleware import TransportKind

if TYPE_CHECKING:
    from desim.middleware.ros1.client import Process
    from desim.middleware.ros1.xmlrpc import XmlRpcCall
    from desim.ports.networks import Handle


class RosLink:
    """A link from ``process``, which subscribes to ``topic``, to the publisher at ``uri``, as
    roscpp makes it. It lives until ``drop``. A step that fails is tried again by the client
    library's schedule, always at the same address, or when the master lists the publisher once more
    (until then ``asked`` is False)."""

    def __init__(self, process: Process, topic: str, uri: Uri) -> None:
        self.process, self.topic, self.uri = process, topic, uri
        self.asked = False
        self.up = False
        self._call: XmlRpcCall
        self._connection: Connection | None = None
        self._timer: Handle | None = None
        self._period_ns = 0  # of the retry that was booked last; 0: none since all was well
        self._dropped = False

    def ask(self, _: object = None) -> None:
        """requestTopic, over a connection of its own, which is called at once; the request waits
        for the end of the XML-RPC thread's round."""
        self.asked = True
        processes = self.process.processes
        self._call = processes.rpc.call(
            self.process.host, self.uri.host, self.uri.slave, "requestTopic",
            REQUEST_TOPIC[processes.params.client].call, ("requestTopic", self), self._answered,
            timeout_ns=processes.constants.connect_timeout_ns, fresh=True, held=True)
        self._at_the_end_of_the_round(self._request)

    def unlisted(self) -> bool:
        """The master does not list the publisher any more. Returns whether the link ends, as
        roscpp's always do (subscription.cpp, pubUpdate)."""
        self.drop()
        return True

    def drop(self) -> None:
        """End the link: the publisher is no longer listed, or this process has ended."""
        self._dropped = True
        self._cancel_timer()
        if self.process.alive:
            self._down()
            if self._connection is not None:
                self._connection.close(self.process.host)
        self._connection = None

    # At the publisher.

    def _accepted(self, connection: Connection) -> None:
        """The subscriber's header has arrived."""
        publisher = self.process.processes.on(self.uri.host)
        connection.send(self.uri.host, HEADER_ANSWER, self._headed, connection, "tcpros_header")
        connection.on_closed(self.uri.host, self._left)
        publisher.linked(self, connection)

    def _left(self, connection: Connection, reason: str) -> None:
        connection.close(self.uri.host)
        self.process.processes.on(self.uri.host).unlinked(self, connection)

    # At the subscriber.

    def _answered(self, ok: bool, transport: TransportKind | None) -> None:
        if self._dropped:
            return
        self._cancel_timer()
        if transport is not None:
            self.process.xmlrpc_thread.event(self.process.processes.context.now_ns)
            self._at_the_end_of_the_round(
                self._connect if transport == TransportKind.STREAM else self._established)
            return
        retries = self.process.processes.params.requests
        if retries is not None and retries.covers(self._call.reason):
            self._again(retries, self.ask)
        else:
            self._rest()

    def _connect(self, _: object) -> None:
        processes = self.process.processes
        timeout_ns = processes.constants.connect_timeout_ns
        if timeout_ns is not None:
            self._set_timer(processes.context.now_ns + timeout_ns, self._hang_up)
        self._connection = processes.tcp.connect(
            self.process.host, self.uri.host, self.uri.tcpros, "tcpros",
            opened=self._opened, closed=self._closed, nodelay=processes.params.tcp_nodelay,
            topic=self.topic)

    def _opened(self, connection: Connection) -> None:
        self._cancel_timer()
        connection.send(self.process.host, HEADER, self._accepted, connection, "tcpros_header")

    def _headed(self, connection: Connection) -> None:
        """The publisher's header has arrived: messages may follow."""
        if connection is self._connection:
            self._established()

    def _established(self, _: object = None) -> None:
        self._period_ns = 0
        self.up = True
        self.process.count_links(self.uri.host, 1)

    def _hang_up(self, _: object) -> None:
        """Give up a connection that takes too long."""
        if self._connection is not None:
            self._closed(self._connection, "timeout")

    def _closed(self, connection: Connection, reason: str) -> None:
        if connection is not self._connection:
            return
        connection.close(self.process.host)
        self._connection = None
        self._down()
        self._broke(reason)

    def _broke(self, reason: str) -> None:
        """The connection has ended."""
        self._cancel_timer()
        self._again(self.process.processes.params.connections, self._connect)

    def _rest(self) -> None:
        """Wait until the master lists the publisher once more."""
        self.asked = False
        self.process.rests(self)

    def _down(self) -> None:
        if self.up:
            self.up = False
            self.process.count_links(self.uri.host, -1)

    def _again(self, retries: Retries, step: Callable[..., object]) -> None:
        self._period_ns = retries.after(self._period_ns)
        self._set_timer(self.process.processes.context.now_ns + self._period_ns, step)

    def _set_timer(self, time_ns: int, step: Callable[..., object]) -> None:
        self._timer = self.process.processes.context.at(time_ns, self.process.host, step)

    def _at_the_end_of_the_round(self, step: Callable[..., object]) -> None:
        """Call ``step`` when the XML-RPC thread's round ends, which events postpone."""
        now_ns = self.process.processes.context.now_ns
        due_ns = self.process.xmlrpc_thread.round_end_ns(now_ns)
        if due_ns <= now_ns:
            step(None)
        else:
            self._set_timer(due_ns, lambda _: self._at_the_end_of_the_round(step))

    def _request(self, _: object) -> None:
        process = self.process
        process.xmlrpc_thread.event(process.processes.context.now_ns)  # the socket can be written
        self._call.release()

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
