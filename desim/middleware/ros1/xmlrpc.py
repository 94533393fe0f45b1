"""XML-RPC: calls over kept alive HTTP connections, as roscpp makes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from desim.middleware.tcp import Connection, Tcp
from desim.ports.middleware import MiddlewareContext
from desim.ports.networks import Handle

IDLE_NS = 30_000_000_000  # roscpp xmlrpc_manager: a cached client that rests is reaped

Request: TypeAlias = Any  # a tuple: a method and its arguments, for the two ends to understand
Done = Callable[..., object]  # of: whether it was answered, the response

Key = tuple[int, int, str]  # client, server, service


class XmlRpcCall:
    """One call under way. The two ends understand ``request`` and the response; the network sees
    their sizes: with the HTTP header, without TCP and IP."""

    __slots__ = ("client", "server", "service", "kind", "request_bytes", "request", "done",
                 "connection", "response", "reason", "over", "held", "_fresh", "_rpc", "_timer",
                 "_reused")

    def __init__(self, rpc: XmlRpc, client: int, server: int, service: str, kind: str,
                 request_bytes: int, request: Request, done: Done, fresh: bool, held: bool) -> None:
        self.client, self.server, self.service = client, server, service
        self.kind = kind
        self.request_bytes, self.request = request_bytes, request
        self.done = done
        self.connection: Connection | None = None
        self.response: object = None
        self.reason: str | None = None  # why it failed, if that is known
        self.over = False  # nobody waits for the answer any more
        self.held = held
        self._fresh = fresh
        self._rpc = rpc
        self._timer: Handle | None = None
        self._reused = False

    def reply(self, response_bytes: int, response: object = None) -> None:
        """The server answers, once, now or later. Nothing happens where it has restarted, or the
        client has given up."""
        self.response = response
        if self.connection is None:
            context = self._rpc.context
            context.at(context.now_ns, self.client, lambda _: self.finish(True))
        elif self.connection.holds(self.server):
            self.connection.send(self.server, response_bytes, self._answered,
                                 self.connection, self.kind)

    def wait(self, timeout_ns: int) -> None:
        context = self._rpc.context
        self._timer = context.at(context.now_ns + timeout_ns, self.client, self._timed_out)

    def go(self, connection: Connection, reused: bool) -> None:
        """Send the request."""
        self.connection = connection
        self._reused = reused
        connection.send(self.client, self.request_bytes, self._rpc.received, self, self.kind)

    def release(self) -> None:
        """Allow the request to be sent, now that its connection has been called."""
        self.held = False
        if not self.over and self.connection is not None:
            self.go(self.connection, False)

    def broke(self) -> bool:
        """The connection ended before the call was answered. Returns True if the call goes on over
        a new one: a server may have closed a connection that rested (XmlRpcClient tries again,
        once)."""
        if self._reused:
            self._reused = False
            return True
        self.finish(False)
        return False

    def finish(self, ok: bool) -> None:
        """Report the outcome to the caller."""
        if not self.over:
            self.forget()
            self.done(ok, self.response if ok else None)

    def forget(self) -> None:
        """Give up the call: its caller has stopped."""
        self.over = True
        if self._timer is not None:
            self._timer.cancel()
        self._rpc.calls[self.client].pop(self, None)

    def _answered(self, connection: Connection) -> None:
        if not self.over:
            if self._fresh:
                self._hang_up(connection)
            else:
                self._rpc.rest(connection)
            self.finish(True)

    def _timed_out(self, _: object) -> None:
        self.reason = "timeout"
        if self.connection is not None:
            self._hang_up(self.connection)
        self.finish(False)

    def _hang_up(self, connection: Connection) -> None:
        connection.about = None
        connection.close(self.client)


class XmlRpc:
    """All calls of a run. A connection carries one call at a time; a client's idle ones are taken
    again, and closed after ``idle_ns``. Calls within a host take ``local_ns`` and no bytes."""

    def __init__(self, context: MiddlewareContext, tcp: Tcp, idle_ns: int = IDLE_NS,
                 local_ns: int = 0) -> None:
        self.context = context
        self.calls: dict[int, dict[XmlRpcCall, None]] = {}  # under way, by client
        self._tcp = tcp
        self._idle_ns, self._local_ns = idle_ns, local_ns
        self._idle: dict[Key, list[tuple[Connection, int]]] = {}  # and since when
        self._reapers: dict[Key, Handle] = {}
        self._servers: dict[tuple[int, str], Callable[[XmlRpcCall], object]] = {}

    def serve(self, host: int, service: str, answer: Callable[[XmlRpcCall], object]) -> None:
        """``answer(call)`` for each call to ``service`` on ``host``, until it stops; it answers by
        ``call.reply``."""
        self._servers[host, service] = answer
        self._tcp.listen(host, service, lambda connection: connection.on_closed(
            host, lambda connection, reason: connection.close(host)))

    def call(self, client: int, server: int, service: str, kind: str, request_bytes: int,
             request: Request, done: Done, *, timeout_ns: int | None = None,
             fresh: bool = False, held: bool = False) -> XmlRpcCall:
        """Call ``service`` on ``server``; ``done(ok, response)`` in the end, unless ``client``
        stops; never before this returns. Without ``timeout_ns`` it waits until TCP gives up, and
        for ever where the request was acknowledged: these connections are not kept alive. Bytes are
        discovery of ``kind``. ``fresh``: over a connection of its own, closed after the
        answer (roscpp for requestTopic). ``held``: the request waits for ``XmlRpcCall.release``."""
        call = XmlRpcCall(self, client, server, service, kind, request_bytes, request, done, fresh,
                          held)
        self.calls.setdefault(client, {})[call] = None
        if timeout_ns is not None:
            call.wait(timeout_ns)
        if client == server:
            self.context.at(self.context.now_ns + self._local_ns, server, self._local, call)
            return call
        idle = self._idle.get((client, server, service))
        while idle and not fresh:
            connection, _ = idle.pop()
            if connection.holds(client):
                connection.about = call
                call.go(connection, True)
                return call
        self._connect(call)
        return call

    def forget(self, host: int) -> None:
        """Forget the calls, idle connections and servers of a stopped host. To be called before
        ``Tcp.switched``."""
        for call in list(self.calls.get(host, ())):
            call.forget()
        for key in [key for key in self._idle if key[0] == host]:
            del self._idle[key]
            if key in self._reapers:
                self._reapers.pop(key).cancel()
        for server in [key for key in self._servers if key[0] == host]:
            del self._servers[server]

    # For calls.

    def rest(self, connection: Connection) -> None:
        """Keep a connection for reuse: it has brought an answer."""
        connection.about = None
        now_ns = self.context.now_ns
        key = connection.client, connection.server, connection.service
        self._idle.setdefault(key, []).append((connection, now_ns))
        if key not in self._reapers:
            self._reapers[key] = self.context.at(now_ns + self._idle_ns, key[0], self._reap, key)

    def received(self, call: XmlRpcCall) -> None:
        """The request is at the server."""
        self._servers[call.server, call.service](call)

    def _local(self, call: XmlRpcCall) -> None:
        if call.over:
            return
        server = self._servers.get((call.server, call.service))
        if server is None:
            call.finish(False)
        else:
            server(call)

    def _connect(self, call: XmlRpcCall) -> None:
        connection = self._tcp.connect(  # once it is open, TCP sends the request of itself
            call.client, call.server, call.service, call.kind, opened=lambda connection: None,
            closed=self._closed, nodelay=True, keepalive=False)
        connection.about = call
        call.connection = connection
        if not call.held:
            call.go(connection, False)

    def _reap(self, key: Key) -> None:
        """Close connections that have rested for long. The last to rest is the first to be taken
        again, so they are in order of time."""
        idle = self._idle[key]
        due_ns = self.context.now_ns - self._idle_ns
        while idle and idle[0][1] <= due_ns:
            connection, _ = idle.pop(0)
            connection.close(connection.client)
        if idle:
            self._reapers[key] = self.context.at(idle[0][1] + self._idle_ns, key[0], self._reap,
                                                 key)
        else:
            del self._reapers[key]

    def _closed(self, connection: Connection, reason: str) -> None:
        call, connection.about = connection.about, None
        connection.close(connection.client)
        if call is not None:
            call.reason = reason
            if call.broke():
                self._connect(call)


class XmlrpcThread:
    """The thread of a roscpp process that serves XML-RPC and makes its requestTopic calls.

    It works in rounds of ``period_ns`` (roscpp xmlrpc_manager.cpp: server_.work(0.1)). Between two
    rounds it takes up the calls that are new or answered. An event within a round's period prolongs
    the round by another period; the first later event ends it (XmlRpcDispatch::work: each of its
    polls waits for the whole time). Without a period a round ends at once.
    """

    def __init__(self, period_ns: int, begin_ns: int) -> None:
        self._period_ns = period_ns
        self._begin_ns = begin_ns
        self._end_ns = begin_ns + period_ns

    def event(self, now_ns: int) -> None:
        """A call or an answer has arrived, or a request may be written."""
        period_ns = self._period_ns
        if now_ns >= self._end_ns and period_ns:
            self._begin_ns = now_ns - (now_ns - self._end_ns) % period_ns
        within = now_ns <= self._begin_ns + period_ns
        self._end_ns = now_ns + period_ns if within else now_ns

    def round_end_ns(self, now_ns: int) -> int:
        """The end of the present round, if there is no event before it."""
        if now_ns <= self._end_ns or not self._period_ns:
            return max(self._end_ns, now_ns)
        return now_ns + (self._end_ns - now_ns) % self._period_ns
