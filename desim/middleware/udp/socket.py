"""A UDP socket and its send buffer, as in Linux."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from desim.middleware.earliest import Earliest
from desim.middleware.udp.cut_train import CutTrain, parts_of
from desim.middleware.udp.receiver import ReceivedTrain
from desim.middleware.udp.skb import truesize_before_last, truesize_bytes
from desim.network.carrier import AnyCarrier
from desim.network.ways import Way
from desim.ports import TimePart
from desim.units import NEVER_NS

if TYPE_CHECKING:
    from desim.middleware.udp.host_sockets import HostSockets
    from desim.network.medium import Medium
    from desim.ports.middleware import Sends

_new = tuple.__new__  # Datagrams at half the price
HALF = 2  # the part of the buffer that has to be free before one who waits goes on
PART_PACKETS = 16  # of a train that does not fit: it takes room, and gives it back, by these


class Datagrams(NamedTuple):
    """A train of datagrams for the same ``receivers``, and who hears of its fate. ``each``: the
    packets of a datagram. ``node`` publishes them, and waits for room; None: nobody does."""

    medium: Medium | Way
    sends: Sends
    receivers: tuple[int, ...]
    size_bytes: int
    packets: int
    broadcast: bool
    carrier: AnyCarrier
    token: object
    each: int
    node: str | None


class UdpSocket:
    """A socket that all datagrams of one sender, or of several nodes, go through.

    Packets take memory of its send buffer (``truesize_bytes``) until they have left the host: when
    the network model has settled them, or when it says (``ports.KnowsDepartures``). A datagram goes
    out if less than ``limit`` is taken, so that the last one may exceed it. If not, it waits until
    less than half of it is taken, and its node with it (Linux: ``sock_alloc_send_pskb``,
    ``sock_def_write_space``).
    """

    __slots__ = ("_sockets", "_graph", "_kernel", "_host", "_limit_bytes", "_slow",
                 "used_bytes", "_leaving", "_waiting", "_resumption", "_when_free")

    def __init__(self, sockets: HostSockets) -> None:
        host = sockets.host
        self._sockets, self._graph, self._kernel = sockets, host.graph, host.graph.kernel
        self._host = host.index
        self._limit_bytes = sockets.params.send_buffer_bytes
        self._slow = sockets.params.read_ns > 0  # who reads needs time for each datagram
        self.used_bytes = 0
        self._leaving: list[tuple[int, int]] = []  # a heap: when, how many bytes
        # By node, with the time since when.
        self._waiting: dict[str | None, deque[tuple[int, Datagrams]]] = {}
        self._resumption = Earliest(self._kernel, host.id, self._resume)
        self._when_free: list[Callable[[], object]] = []

    def send(self, medium: Medium | Way, receivers: tuple[int, ...], size_bytes: int, packets: int,
             broadcast: bool, carrier: AnyCarrier, token: object, each: int = 1,
             node: str | None = None, sends: Sends | None = None) -> int | None:
        """Send a train (``Datagrams``), maybe past an entry of an address table (``sends``).
        Returns what ``Medium.transmit`` does; None if some of it waits."""
        if node not in self._waiting and (packets == each or not self._slow):
            room_bytes = self._limit_bytes
            if packets > each:
                room_bytes -= truesize_before_last(size_bytes, packets, each)
            if self.used_bytes >= room_bytes:
                self._forget_left()
            if self.used_bytes < room_bytes:
                if each > 1 or self._slow:
                    carrier = ReceivedTrain(self._graph, carrier, size_bytes, packets, each)
                return self._transmit(medium, sends or medium, receivers, size_bytes, packets,
                                      broadcast, carrier, token)
        self._wait(Datagrams(medium, sends or medium, receivers, size_bytes, packets, broadcast,
                             carrier, token, each, node))
        return None

    @property
    def waits(self) -> bool:
        """Whether something waits for room."""
        return bool(self._waiting)

    def when_free(self, fn: Callable[[], object]) -> None:
        """Call ``fn`` once, when nothing waits any more."""
        self._when_free.append(fn)

    def close(self) -> None:
        """The host stops: what waits is lost, and what has been sent goes on."""
        self._when_free.clear()
        waiting, self._waiting = self._waiting, {}
        for _, train in chain.from_iterable(waiting.values()):
            for receiver in train.receivers:
                train.carrier.lost(train.token, receiver, "sender_down")

    def _transmit(self, medium: Medium | Way, sends: Sends, receivers: tuple[int, ...],
                  size_bytes: int, packets: int, broadcast: bool, carrier: AnyCarrier,
                  token: object) -> int | None:
        first = medium.first(self._host, receivers[0]) if isinstance(medium, Way) else medium
        number = first.frames + 1
        due_ns = sends.transmit(self._host, receivers, size_bytes, packets, broadcast, carrier,
                                token)
        departures = first.departures
        leaves_ns = departures.last_ns(self._host) if departures.foretold else 0
        if leaves_ns > self._kernel.now_ns:
            taken = truesize_bytes(size_bytes, packets)
            heappush(self._leaving, (leaves_ns, taken))
            self.used_bytes += taken
        elif due_ns is None and not departures.known and first.is_open(number):
            taken = truesize_bytes(size_bytes, packets)
            departures.held[number] = self._left, taken
            self.used_bytes += taken
        return due_ns

    def _wait(self, train: Datagrams) -> None:
        """Let ``train`` wait, in parts if it consists of many packets. A node that does not wait
        itself, such as a driver, loses what it sends while others of it wait."""
        now_ns, node = self._kernel.now_ns, train.node
        if node is not None and self._sockets.blocked_since_ns(node) not in (None, now_ns):
            for receiver in train.receivers:
                train.carrier.lost(train.token, receiver, "send_buffer_full")
            return
        trains = self._parts(train)
        if node not in self._waiting:
            while trains and self.used_bytes < self._limit_bytes:
                self._transmit(*trains.popleft()[:8])
        if trains:
            self._waiting.setdefault(node, deque()).extend([(now_ns, one) for one in trains])
            self._sockets.block(node, len(trains))
        self._book()

    def _parts(self, train: Datagrams) -> deque[Datagrams]:
        """The parts in which ``train`` goes out. Equal ones have one carrier in common."""
        medium, sends, receivers, size_bytes, packets, broadcast, carrier, token, each, node = train
        parts = parts_of(size_bytes, packets, each, 1 if self._slow else PART_PACKETS)
        tokens: list[object] = [token]
        if len(parts) > 1:
            carrier = CutTrain(carrier, token, receivers, packets, len(parts))
            tokens = [numbers for numbers, _ in parts]
        carriers: dict[tuple[int, int], AnyCarrier] = {}  # by bytes and packets of a part
        out: deque[Datagrams] = deque()
        for part, (numbers, part_bytes) in zip(tokens, parts, strict=True):
            size = part_bytes, len(numbers)
            if size not in carriers:
                carriers[size] = ReceivedTrain(self._graph, carrier, *size, each) \
                    if each > 1 or self._slow else carrier
            out.append(_new(Datagrams, (medium, sends, receivers, *size, broadcast,
                                        carriers[size], part, each, node)))
        return out

    def _resume(self, _: object) -> None:
        """Send what waits while there is room, a datagram of each node in turn. Those that have
        waited least come first: ``prepare_to_wait`` puts them at the head."""
        self._resumption.due_ns = NEVER_NS
        waiting, passages = self._waiting, self._graph.passages
        self._forget_left()
        turns = deque(reversed(waiting))
        sent = dict.fromkeys(waiting, 0)
        while turns and self.used_bytes < self._limit_bytes:
            node = turns.popleft()
            since_ns, train = waiting[node].popleft()
            sent[node] += 1
            if waiting[node]:
                turns.append(node)
            else:
                del waiting[node]
            if passages is not None:
                passages.waited(TimePart.SENDER, since_ns)
            self._transmit(*train[:8])
            if node not in waiting:
                self._sockets.unblock(node, sent.pop(node))
        for node, count in sent.items():
            self._sockets.unblock(node, count)
        self._book()
        while self._when_free and not self._waiting:
            self._when_free.pop(0)()

    def _left(self, taken: int) -> None:
        """Packets that took so many bytes have left."""
        self.used_bytes -= taken
        if self._waiting and (self._leaving or HALF * self.used_bytes < self._limit_bytes):
            self._book()

    def _forget_left(self) -> None:
        """Take out of the account what has left by now."""
        leaving, now_ns = self._leaving, self._kernel.now_ns
        while leaving and leaving[0][0] <= now_ns:
            self.used_bytes -= heappop(leaving)[1]

    def _book(self) -> None:
        """Go on when less than half of the buffer will be taken, as far as that is known."""
        if not self._waiting:
            return
        used, due_ns = self.used_bytes, self._kernel.now_ns
        for leaves_ns, taken in sorted(self._leaving):
            if HALF * used < self._limit_bytes:
                break
            used, due_ns = used - taken, leaves_ns
        due_ns = max(due_ns, self._kernel.now_ns)
        if HALF * used < self._limit_bytes:
            self._resumption.by(due_ns)
