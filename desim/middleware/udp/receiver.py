"""The receiving side of UDP sockets: reassembly, receive buffer, and the thread that reads it."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from desim.engine.kernel import Phase
from desim.middleware.udp.reassembly import Reassembly
from desim.middleware.udp.skb import truesize_bytes
from desim.network.carrier import AnyCarrier, WrappedCarrier
from desim.ports import TimePart

if TYPE_CHECKING:
    from desim.middleware.graph import Graph
    from desim.network.passages import Passage
    from desim.scenario.schema.sockets import Sockets


class ReceiveBuffer:
    """The datagrams of one socket that have not been read. A thread of the middleware takes them
    out, and needs ``read_ns`` for each before it takes the next; nodes that are busy or wait do not
    keep it from that.

    Memory that has been read is given back when a quarter of the limit has come together, or none
    waits of those that were there when this happened last (Linux: ``udp_rmem_release``).
    """

    __slots__ = ("_limit_bytes", "_read_ns", "_taken_bytes", "_free_ns", "_waiting", "_ahead",
                 "_owed_bytes")

    def __init__(self, limit_bytes: int, read_ns: int) -> None:
        self._limit_bytes, self._read_ns = limit_bytes, read_ns
        self._taken_bytes = self._owed_bytes = 0
        self._free_ns = 0  # when the thread takes the next one
        self._waiting: deque[int] = deque()  # their memory
        self._ahead = 0  # the number of those in the thread's own queue (``reader_queue``)

    def put(self, now_ns: int, memory: int) -> int | None:
        """Take a datagram if it fits, or if nothing waits (``__udp_enqueue_schedule_skb`` of Linux
        6.15; before, the last one could exceed the limit). Returns when it is taken out; then call
        ``read``."""
        if self._taken_bytes and self._taken_bytes + memory > self._limit_bytes:
            return None
        self._taken_bytes += memory
        self._waiting.append(memory)
        taken_ns = max(now_ns, self._free_ns)
        self._free_ns = taken_ns + self._read_ns
        return taken_ns

    def read(self) -> None:
        """The thread takes out the first datagram."""
        self._ahead = (self._ahead or len(self._waiting)) - 1
        self._owed_bytes += self._waiting.popleft()
        if self._ahead == 0 or 4 * self._owed_bytes >= self._limit_bytes:
            self._taken_bytes -= self._owed_bytes
            self._owed_bytes, self._ahead = 0, len(self._waiting)


class UdpReception:
    """The datagrams that the UDP sockets of one host receive."""

    __slots__ = ("reassembly", "_params", "_buffers")

    def __init__(self, params: Sockets) -> None:
        self.reassembly = Reassembly(params.reassembly_bytes, params.reassembly_time_ns)
        self._params = params
        self._buffers: dict[object, ReceiveBuffer] = {}

    def buffer(self, socket: object) -> ReceiveBuffer:
        """The buffer of the socket that takes what comes from the sender's ``socket``."""
        if socket not in self._buffers:
            self._buffers[socket] = ReceiveBuffer(self._params.receive_buffer_bytes,
                                                  self._params.read_ns)
        return self._buffers[socket]


class ReceivedTrain(WrappedCarrier[object]):
    """The carrier of one train of datagrams that need reassembly, or time to be read. The train's
    own ``carrier`` hears what its receivers make of it."""

    __slots__ = ("_graph", "_size_bytes", "_packets", "_each")

    def __init__(self, graph: Graph, carrier: AnyCarrier, size_bytes: int, packets: int, each: int
                 ) -> None:
        self._graph, self._carrier = graph, carrier
        self._size_bytes, self._packets, self._each = size_bytes, packets, each

    def arrived(self, token: object, receiver: int) -> None:
        graph = self._graph
        if graph.sockets.read_ns:
            self.arrived_in_part(token, receiver, {})
        elif not graph.hosts[receiver].sockets.reception.reassembly.expiring:
            self._carrier.arrived(token, receiver)
        else:
            self._carrier.settled(token, receiver, self._packets, self._reassembled(receiver, {}))

    def arrived_in_part(self, token: object, receiver: int, lost: dict[int, str]) -> None:
        lost = self._reassembled(receiver, lost)
        if len(lost) == self._packets or not self._graph.sockets.read_ns:
            self._carrier.settled(token, receiver, self._packets, lost)
            return
        graph, buffer = self._graph, self._reception(receiver).buffer(self._carrier.socket)
        now_ns = graph.kernel.now_ns
        taken_ns = buffer.put(now_ns, truesize_bytes(self._size_bytes, self._packets))
        if taken_ns is None:
            self._carrier.lost(token, receiver, "receive_buffer_full")
            return
        if taken_ns == now_ns:
            buffer.read()
            self._carrier.settled(token, receiver, self._packets, lost)
            return
        passage = None if graph.passages is None else graph.passages.arriving
        if passage is not None:
            passage.spent(TimePart.QUEUE, taken_ns - now_ns, receiver, receiver)
        graph.kernel.at(taken_ns, Phase.DELIVER, graph.hosts[receiver].id, self._read,
                        (token, receiver, lost, passage, buffer))

    def _reception(self, receiver: int) -> UdpReception:
        return self._graph.hosts[receiver].sockets.reception

    def _reassembled(self, receiver: int, lost: dict[int, str]) -> dict[int, str]:
        return self._reception(receiver).reassembly.take(
            self._graph.kernel.now_ns, self._size_bytes, self._packets, self._each, lost)

    def _read(self, datagram: tuple[object, int, dict[int, str], Passage | None, ReceiveBuffer]
              ) -> None:
        """A datagram is read, if its host still runs."""
        token, receiver, lost, passage, buffer = datagram
        buffer.read()
        if not self._graph.up[receiver]:
            self._carrier.lost(token, receiver, "host_down")
        elif self._graph.passages is None:
            self._carrier.settled(token, receiver, self._packets, lost)
        else:
            self._graph.passages.arriving = passage
            self._carrier.settled(token, receiver, self._packets, lost)
            self._graph.passages.arriving = None
