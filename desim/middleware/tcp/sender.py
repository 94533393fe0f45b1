"""The sending half of one direction of a connection: what may go when, and what goes again."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from desim.kernel import Phase
from desim.middleware.tcp.params import on_wire
from desim.middleware.transports import MSS_BYTES, SEGMENT_HEADER_BYTES
from desim.trace import pack

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection, End
    from desim.middleware.tcp.receiver import Receiver

_NETWORK = Phase.NETWORK

# What an acknowledgement says: all before this byte is here; when the segment was sent that it
# answers; where the first gap ends (0: there is none) and how many bytes beyond it are here; how
# many duplicates it stands for.
Ack = tuple[int, int, int, int, int]
FIN = "fin"  # the kind of a FIN

Entry = tuple[int, Callable[[Any], Any], Any, "str | None"]  # end, arrived, token, kind


class Sender:
    """Bytes ``una`` to ``nxt`` are on their way, up to ``top`` they were sent before, up to
    ``written`` they are to be sent. ``peer`` is the receiver at the other end, ``back`` the one at
    this end. ``messages`` are those not acknowledged, of which the first ``heard`` have arrived.

    Congestion control is that of RFC 5681 in bytes, with what Linux adds: only a window that is
    used grows; it shrinks back after idleness; a lost part is sent again as soon as the receiver's
    selective acknowledgements show it.
    """

    __slots__ = ("connection", "end", "peer", "back", "open", "nodelay", "messages", "heard", "una",
                 "nxt", "top", "written", "cwnd", "ssthresh", "rto_ns", "waiters", "finishing",
                 "heard_ns", "room_bytes", "_small", "_srtt_ns", "_rttvar_ns", "_expiries",
                 "_duplicates", "_recover", "_recovering", "_resent", "_hole_end", "_beyond",
                 "_timer", "_deadline_ns", "_sent_ns", "_params", "_graph", "_kernel", "_transmit",
                 "_host", "_to", "_host_id", "_to_id", "_entity", "_initial")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        params = connection.tcp.params
        graph = connection.tcp.context.graph
        self.connection = connection
        self.end = end
        self.peer: Receiver
        self.back: Receiver
        self.open = False
        self.nodelay = connection.nodelay
        self.messages: deque[Entry] = deque()
        self.heard = 0
        self.una = self.nxt = self.top = self.written = 0
        self.cwnd = self._initial = params.initial_window * MSS_BYTES
        self.ssthresh = params.window_bytes
        self.rto_ns = params.first_rto_ns
        self.room_bytes = 2 * self.cwnd
        self.waiters: list[Callable[[], Any]] = []
        self.finishing = False
        self.heard_ns = 0
        self._small = 0  # end of the last segment that was not full
        self._srtt_ns = self._rttvar_ns = -1
        self._expiries = 0  # of the timer, one after another
        self._duplicates = 0
        self._recover = 0  # what was sent when a loss was noticed
        self._recovering = False
        self._resent = 0  # meanwhile, up to there
        self._hole_end = self._beyond = 0  # as acknowledgements say
        self._timer: Any = None
        self._deadline_ns = 0
        self._sent_ns = 0
        self._params = params
        self._graph, self._kernel = graph, graph.kernel
        self._transmit = connection.medium.transmit
        self._host, self._to = end.host, (end.peer,)
        self._host_id, self._to_id = graph.hosts[end.host].id, graph.hosts[end.peer].id
        self._entity = entity

    def send(self, size_bytes: int, arrived: Callable[[Any], Any], token: Any,
             kind: str | None) -> None:
        start = self.written
        self.written = end = start + size_bytes
        self.messages.append((end, arrived, token, kind))
        if self.una < start or size_bytes > MSS_BYTES or kind is not None or not self.open:
            self.push()
            return
        # Nothing is on its way and it fits a segment: the message of every day.
        now_ns = self._kernel.now_ns
        rto_ns = self.rto_ns
        if self.cwnd > self._initial and now_ns - self._sent_ns > rto_ns:
            self._restart(now_ns)
        self.nxt = self.top = end
        if size_bytes < MSS_BYTES:
            self._small = end
        self._sent_ns = now_ns
        self._deadline_ns = now_ns + rto_ns
        if self._timer is None:
            self._timer = self._kernel.after(rto_ns, _NETWORK, self._entity, self._expired)
        size_bytes += SEGMENT_HEADER_BYTES
        graph, back = self._graph, self.back
        graph.put(pack(now_ns, graph.FRAME, self._host_id, self._to_id, token.seq, size_bytes))
        self._transmit(self._host, self._to, size_bytes, 1, False, self.peer,
                       (start, end, back.told(), now_ns, back.echo_ns))

    def arrived(self, ack: Ack, receiver: int) -> None:
        """An acknowledgement without data."""
        if not self.open:
            self.end.stray(self, ack)
            return
        self.heard_ns = self._kernel.now_ns
        number, echo_ns, self._hole_end, self._beyond, duplicates = ack
        if number > self.una:
            self.acked(number, echo_ns)
        elif duplicates and number == self.una < self.top:
            self._duplicate(duplicates)

    def lost(self, ack: Ack, receiver: int, reason: str) -> None:
        """Nobody is told of a lost acknowledgement."""

    def repeated(self, ack: Ack, receiver: int) -> None:
        """A copy of an acknowledgement that is known."""

    def acked(self, number: int, echo_ns: int) -> None:
        """All before byte ``number`` is there; more than was known before."""
        una, now_ns = self.una, self._kernel.now_ns
        if (self.nxt - una) * 2 > self.cwnd and not self._recovering:
            self._grow(number - una)
        self.una = number
        if number > self.nxt:
            self.nxt = number
        self._expiries = self._duplicates = 0
        self.sample(now_ns - echo_ns)
        self._deadline_ns = now_ns + self.rto_ns
        messages = self.messages
        while messages and messages[0][0] <= number:
            messages.popleft()
            self.heard -= 1
        if self._recovering:
            self._recovered(now_ns)
        if number < self.written:
            self.push()
        elif self.finishing:
            self.end.finished()
            return
        if self.waiters:
            self._tell_waiters()

    def sample(self, rtt_ns: int) -> None:
        """A measured round trip moves the retransmission timeout (RFC 6298)."""
        if self._srtt_ns < 0:
            self._srtt_ns = rtt_ns
            self._rttvar_ns = rtt_ns >> 1
        else:
            off_ns = rtt_ns - self._srtt_ns
            self._srtt_ns += off_ns >> 3
            self._rttvar_ns += (abs(off_ns) - self._rttvar_ns) >> 2
        rto_ns = self._srtt_ns + 4 * self._rttvar_ns
        params = self._params
        self.rto_ns = min(max(rto_ns, params.rto_min_ns), params.rto_max_ns)

    def push(self) -> None:
        """Send what may go now, if the connection is open."""
        if not self.open:
            return
        params = self._params
        if self.una == self.top and self.cwnd > self._initial:
            now_ns = self._kernel.now_ns
            if now_ns - self._sent_ns > self.rto_ns:
                self._restart(now_ns)
        third = self.cwnd // (3 * MSS_BYTES)
        most = min(params.train, max(third, 2)) * MSS_BYTES
        limit = self.una + min(self.cwnd, params.window_bytes)
        if self._recovering:
            limit += self._beyond
        while True:
            start = self.nxt
            goal = self.top if start < self.top else self.written  # what went before goes alone
            size = min(goal, limit, start + most) - start
            if size <= 0:
                return
            part = size % MSS_BYTES
            if part and (start + size < goal or start >= self.top and not self._small_may_go()):
                size -= part
                if not size:
                    return
            self._train(start, start + size)

    def lost_train(self, start: int, end: int, reason: str) -> None:
        """The medium lost a train, unknown to this end: a row for each of its messages of data."""
        graph = self._graph
        for message, kind, _ in self._parts(start, end):
            if kind is None:
                graph.trace.row(self._kernel.now_ns, graph.LOST, self._to_id, self._host_id,
                                message.seq, graph.names.id(reason))

    def finish(self, finishes: Callable[[Any], Any]) -> None:
        """Send all that was written, without delay, and a FIN behind it: one byte of the sequence,
        which the network carries as one byte too."""
        self.finishing = True
        self.send(1, finishes, None, FIN)

    def shut(self) -> None:
        """Send nothing more. What was not heard will not be."""
        self.open = False
        self.messages.clear()
        self.waiters.clear()
        self.heard = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    @property
    def room(self) -> bool:
        return self.written - self.una < self.room_bytes

    def _small_may_go(self) -> bool:
        """Nagle as Linux has it: no two segments that are not full are on their way."""
        return self.nodelay or self.finishing or self._small <= self.una

    def _restart(self, now_ns: int) -> None:
        """Idle for more than a timeout: the window halves for each (RFC 2861)."""
        self.ssthresh = max(self.ssthresh, self.cwnd * 3 // 4)
        halvings = min((now_ns - self._sent_ns) // self.rto_ns, 40)
        self.cwnd = max(self.cwnd >> halvings, self._initial)

    def _grow(self, acked: int) -> None:
        if self.cwnd < self.ssthresh:
            self.cwnd += acked
        elif self.nxt - self.una + MSS_BYTES > self.cwnd:
            self.cwnd += max(MSS_BYTES * acked // self.cwnd, 1)
        self.room_bytes = min(max(self.room_bytes, 2 * self.cwnd), self._params.buffer_bytes)

    def _tell_waiters(self) -> None:
        while self.waiters and self.room:
            self.waiters.pop(0)()

    def _duplicate(self, duplicates: int) -> None:
        """Something behind the first missing segment has arrived."""
        self._duplicates += duplicates
        if self._recovering:
            self.push()
        elif self._duplicates >= self._params.duplicate_acks and self.una >= self._recover:
            self._recovering = True
            self._recover = self.top
            self.ssthresh = max((self.nxt - self.una) // 2, 2 * MSS_BYTES)
            self.cwnd = self.ssthresh
            self._resent = self.una
            self._mend()

    def _recovered(self, now_ns: int) -> None:
        """An acknowledgement during fast recovery: of all, or up to the next gap."""
        if self.una >= self._recover:
            self._recovering = False
            self._beyond = 0
        elif self._hole_end > self.una >= self._resent:
            self._mend()

    def _mend(self) -> None:
        """Send the first gap again."""
        end = min(self._hole_end or self._recover, self._recover,
                  self.una + self._params.train * MSS_BYTES)
        nxt = self.nxt
        self._train(self.una, end)
        self._resent, self.nxt = end, nxt

    def _expired(self, _: Any) -> None:
        """The retransmission timer, which is moved only when it goes off."""
        self._timer = None
        if self.una == self.top:
            return
        now_ns = self._kernel.now_ns
        if self._deadline_ns > now_ns:
            self._timer = self._kernel.after(self._deadline_ns - now_ns, _NETWORK, self._entity,
                                             self._expired)
            return
        self._expiries += 1
        if self._expiries > self._params.retries:
            self.end.fail("timeout")
            return
        if self._expiries == 1:
            self.ssthresh = max((self.nxt - self.una) // 2, 2 * MSS_BYTES)
        self.cwnd = MSS_BYTES
        self.nxt = self.una
        self._recovering = False
        self._recover = self.top
        self._duplicates = 0
        self.push()

    def _train(self, start: int, end: int) -> None:
        """Bytes ``start`` to ``end`` as one train."""
        now_ns = self._kernel.now_ns
        size_bytes, segments = on_wire(end - start)
        headers = size_bytes - (end - start)
        for message, kind, payload_bytes in self._parts(start, end):
            self._note(now_ns, message, kind, payload_bytes + headers)
            headers = 0
        if start == self.una:
            self._deadline_ns = now_ns + min(self.rto_ns << self._expiries,
                                             self._params.rto_max_ns)
            if self._timer is None:
                self._timer = self._kernel.after(self._deadline_ns - now_ns, _NETWORK,
                                                 self._entity, self._expired)
        self.nxt = end
        if end > self.top:
            self.top = end
            if (end - start) % MSS_BYTES:
                self._small = end
        self._sent_ns = now_ns
        back = self.back
        self._transmit(self._host, self._to, size_bytes, segments, False, self.peer,
                       (start, end, back.told(), now_ns, back.echo_ns))

    def _note(self, now_ns: int, message: Any, kind: str | None, size_bytes: int) -> None:
        graph = self._graph
        if kind is None:
            graph.trace.row(now_ns, graph.FRAME, self._host_id, self._to_id, message.seq,
                            size_bytes)
        else:
            connection = self.connection
            kind = connection.kind if kind is FIN else kind
            connection.tcp.context.book(kind, self._host, self._to_id, size_bytes)

    def _parts(self, start: int, end: int) -> list[tuple[Any, str | None, int]]:
        """Token, kind and bytes of each message in these bytes, of those not acknowledged."""
        parts = []
        begin = self.una
        for ends, _, token, kind in self.messages:
            if begin >= end:
                break
            if ends > start:
                parts.append((token, kind, min(ends, end) - max(begin, start)))
            begin = ends
        return parts
