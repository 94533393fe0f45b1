"""A flow of a network case over TCP."""

from __future__ import annotations

import numpy as np

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.headers import on_wire
from desim.middleware.tcp import Connection, Tcp, TcpParams
from desim.netcases.sources import Source
from desim.network.medium import Medium
from desim.ports.cases import Flow

_SERVICE = "flow"


def stack_on(medium: Medium, hosts: tuple[str, ...], kernel: Kernel, names: Names,
             streams: Streams) -> Tcp:
    """The TCP of all ``hosts``, over ``medium``. They know each other's addresses."""
    graph = Graph(kernel, names, Trace(names), streams, Direct(Direct.Params()), hosts)
    graph.attach(medium)
    graph.start()
    tcp = Tcp(graph.context, TcpParams(arp="static"))
    for host in range(len(hosts)):
        tcp.listen(host, _SERVICE, lambda connection: None)
    return tcp


class TcpSource(Source):
    """Writes messages into a connection, which it opens again when it ends."""

    def __init__(self, flow: Flow, hosts: tuple[str, ...], kernel: Kernel, entity: int,
                 tcp: Tcp) -> None:
        size_bytes, _ = on_wire(flow.payload_bytes)
        super().__init__(flow._replace(size_bytes=size_bytes), hosts, kernel, entity)
        self._tcp, self._receiver = tcp, hosts.index(flow.receivers[0])

    def begin(self, stream: np.random.Generator) -> None:
        self._kernel.after(self.flow.begin_ns, Phase.NETWORK, self._entity, self._connect)
        if not self._saturated:
            super().begin(stream)

    def _connect(self, _: object) -> None:
        connection = self._tcp.connect(
            self._host, self._receiver, _SERVICE, _SERVICE, opened=self._opened,
            closed=self._closed, keepalive=False)
        self._socket = connection.sender(self._host)

    def _opened(self, _: Connection) -> None:
        if self._saturated:
            self._fill()

    def _fill(self) -> None:
        while self._socket.takes:
            self._send(None)
        self._socket.when_writable(self._fill)

    def _send(self, _: object) -> None:
        self.sent += 1
        if self._socket.takes:
            self._socket.send(self.flow.payload_bytes, self._count, self._kernel.now_ns, _SERVICE)
        else:
            self.losses["queue_full"] += 1

    def _closed(self, connection: Connection, reason: str) -> None:
        self.losses[reason] += len(connection.undelivered(self._host))
        self._connect(None)
