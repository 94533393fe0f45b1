"""The UDP sockets of one host, and the nodes that wait for room there or in the middleware."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.engine.kernel import Phase
from desim.middleware.udp.receiver import UdpReception
from desim.middleware.udp.socket import UdpSocket

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.scenario.schema.sockets import Sockets


class HostSockets:
    """The sockets of ``host``. A node whose datagrams wait is blocked (``Host.block``)."""

    def __init__(self, host: Host, params: Sockets) -> None:
        self.host = host
        self.params = params
        self.reception = UdpReception(params)
        self._sockets: list[UdpSocket] = []
        self._named: dict[str, UdpSocket] = {}
        self._blocked: dict[str, tuple[int, int]] = {}  # since when, how many trains wait
        self._waited_ns = self._since_ns = 0  # of all nodes until ``_since_ns``

    def new(self) -> UdpSocket:
        """A socket of a publisher's own."""
        socket = UdpSocket(self)
        self._sockets.append(socket)
        return socket

    def named(self, name: str) -> UdpSocket:
        """The socket that all who know its name share."""
        if name not in self._named:
            self._named[name] = self.new()
        return self._named[name]

    def blocked_since_ns(self, node: str) -> int | None:
        """Since when ``node`` is blocked; None: it is not."""
        return self._blocked[node][0] if node in self._blocked else None

    def block(self, node: str | None, trains: int = 1) -> None:
        """So many more trains of ``node`` wait, or a call of it in the middleware."""
        if node is not None:
            now_ns = self.host.graph.kernel.now_ns
            if node not in self._blocked:
                self._since_ns = self._since_ns if self._blocked else now_ns
                self._blocked[node] = now_ns, 0
                self.host.block(node)
            since_ns, before = self._blocked[node]
            self._blocked[node] = since_ns, before + trains

    def unblock(self, node: str | None, trains: int = 1) -> None:
        """So many of these wait no more."""
        if node not in self._blocked or not trains:  # nobody, or its host has stopped
            return
        since_ns, before = self._blocked[node]
        self._blocked[node] = since_ns, before - trains
        if before == trains:
            host = self.host
            host.graph.kernel.after(0, Phase.CONTROL, host.id, self._goes_on, node)

    def waited_ns(self) -> int:
        """For how long at least one node was blocked so far."""
        now_ns = self.host.graph.kernel.now_ns
        return self._waited_ns + (now_ns - self._since_ns if self._blocked else 0)

    def close(self) -> None:
        """The host stops."""
        self._waited_ns = self.waited_ns()
        sockets, self._sockets = self._sockets, []
        self._named.clear()
        self.reception = UdpReception(self.params)
        self._blocked.clear()
        for socket in sockets:
            socket.close()

    def _goes_on(self, node: str) -> None:
        """Let ``node`` go on, unless it waits again or its host has stopped."""
        if self._blocked.get(node, (0, 1))[1] == 0:
            waited_ns = self.waited_ns()
            del self._blocked[node]
            self._waited_ns = self._waited_ns if self._blocked else waited_ns
            self.host.unblock(node)
