"""The sending half of one direction of a connection: what may go when, and what goes again."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from desim.middleware.tcp.entries import FIN, Entry, parts
from desim.middleware.tcp.express import Express
from desim.middleware.tcp.parameters import on_wire
from desim.middleware.tcp.window import Window
from desim.middleware.timers import NEVER, Timer
from desim.middleware.transports import MSS_BYTES, SEGMENT_HEADER_BYTES
from desim.trace import pack

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.receiver import Receiver

# What an acknowledgement says: all before this byte is here; when the segment was sent that it
# answers; where the first gap ends (0: there is none) and how many bytes beyond it are here; how
# many duplicates it stands for.
Ack = tuple[int, int, int, int, int]


class Sender(Window):
    """Bytes ``una`` to ``nxt`` are on their way, up to ``top`` they were sent before, up to
    ``written`` they are to be sent. ``peer`` is the receiver at the other end, ``back`` the one at
    this end. ``messages`` are those not acknowledged, or refused after that, of which the first
    ``heard`` have arrived.

    Acknowledgements tell where the first gap ends. Once enough duplicates have begun a recovery,
    each gap that comes to be the first one is sent again at once.
    """

    __slots__ = ("end", "peer", "back", "open", "nodelay", "messages", "heard", "una", "nxt", "top",
                 "written", "finishing", "heard_ns", "_waiters", "_small", "_expiries",
                 "_duplicates", "_recover", "_recovering", "_resent", "_hole_end", "_beyond",
                 "timer", "sent_ns", "_graph", "_kernel", "_transmit", "_host", "_to", "_host_id",
                 "_to_id", "express")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        super().__init__(connection.tcp.params)
        self.end = end
        self.peer: Receiver
        self.back: Receiver
        self.open = False
        self.nodelay = connection.nodelay
        self.express: Express | None = None
        self.messages: deque[Entry] = deque()
        self.heard = 0
        self.una = self.nxt = self.top = self.written = 0
        self._waiters: list[Callable[[], Any]] = []
        self.finishing = False
        self.heard_ns = 0
        self._small = 0  # end of the last segment that was not full
        self._expiries = 0  # of the timer, one after another
        self._duplicates = 0
        self._recover = 0  # what was sent when a loss was noticed
        self._recovering = False
        self._resent = 0  # meanwhile, up to there
        self._hole_end = self._beyond = 0  # as acknowledgements say
        self.sent_ns = 0
        self._graph = graph = connection.tcp.context.graph
        self._kernel = graph.kernel
        self.timer = Timer(connection.tcp.timers, entity, self._expired)
        self._transmit = connection.medium.transmit
        self._host, self._to = end.host, (end.peer,)
        self._host_id, self._to_id = graph.hosts[end.host].id, graph.hosts[end.peer].id

    def send(self, size_bytes: int, arrived: Callable[[Any], Any], token: Any,
             kind: str | None) -> None:
        """As ``Connection.send`` of this end."""
        express = self.express
        if express is not None and express.send(size_bytes, arrived, token, kind):
            return
        start = self.written
        self.written = end = start + size_bytes
        self.messages.append((end, arrived, token, kind))
        small_may_go = self._small <= self.una or self.nodelay
        if self.nxt == start and small_may_go and size_bytes <= MSS_BYTES and kind is not FIN \
                and end - self.una <= self.cwnd and self.open:
            self._lone(start, end, token, kind)
        elif small_may_go or end - self.nxt >= MSS_BYTES:
            self.push()

    def sent(self, size_bytes: int, arrived: Callable[[Any], Any], token: Any, kind: str | None,
             sent_ns: int) -> int:
        """A message was sent by express, and is on its way. Returns where it begins."""
        start = self.written
        self.written = self.nxt = self.top = end = start + size_bytes
        self.messages.append((end, arrived, token, kind))
        if size_bytes % MSS_BYTES:
            self._small = end
        self.sent_ns = sent_ns
        return start

    def wake(self) -> None:
        """Nothing is on its way, and something is to be sent."""
        idle_ns = self._kernel.now_ns - self.sent_ns
        if idle_ns > self.rto_ns and self.cwnd > self.initial:
            self.rest(idle_ns)

    def join(self) -> None:
        """What is on its way by express becomes a part of the stream."""
        if self.express is not None:
            self.express.join()

    def finish(self, finishes: Callable[[Any], Any]) -> None:
        """Send all that was written, without delay, and a FIN behind it: one byte of the sequence,
        which the network carries as one byte, too."""
        self.finishing = True
        self.send(1, finishes, None, FIN)
        self.push()

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

    def arrived_in_part(self, ack: Ack, receiver: int, lost: dict[int, str]) -> None:
        """Acknowledgements are cumulative: those that arrive stand for those that do not."""
        self.arrived(ack, receiver)

    def lost(self, ack: Ack, receiver: int, reason: str) -> None:
        """Nobody is told of a lost acknowledgement."""

    def repeated(self, ack: Ack, receiver: int) -> None:
        """A copy of an acknowledgement that is known."""

    def acked(self, number: int, echo_ns: int) -> None:
        """All before byte ``number`` is there; more than was known before."""
        una, nxt = self.una, self.nxt
        if (nxt - una) * 2 > self.cwnd and not self._recovering:
            self.grow(number - una, nxt - una)
        self.una = number
        if number > nxt:
            self.nxt = number
        self._expiries = self._duplicates = 0
        now_ns = self._kernel.now_ns
        if echo_ns >= 0:
            self.sample(now_ns - echo_ns)
        if number < self.top:
            self.timer.expect(now_ns + self.rto_ns)
        else:
            self.timer.deadline_ns = NEVER
        messages, left = self.messages, self.written - number
        heard = self.heard
        if left or heard < len(messages):
            while heard and messages[0][0] <= number:  # what was refused unheard stays
                messages.popleft()
                heard -= 1
            self.heard = heard
        else:
            messages.clear()
            self.heard = 0
        if self._recovering:
            self._recovered()
        if left:
            if left <= MSS_BYTES and number == self.top and len(messages) == 1 \
                    and messages[0][3] is not FIN:
                self._lone(number, self.written, messages[0][2], messages[0][3])
            else:
                self.push()
        elif self.finishing:
            messages.clear()
            self.heard = 0
            self.end.finished()
        elif self.express is not None:
            self.express.ready = self.near and self.peer.open
        if self._waiters:
            self._tell_waiters()

    def push(self) -> None:
        """Send what may go now, if the connection is open."""
        if not self.open:
            return
        params = self.params
        if self.una == self.top:
            self.wake()
        cwnd = self.cwnd
        if self.near and self.una == self.top:
            most = params.train * MSS_BYTES
            cwnd = max(most, cwnd)
        else:
            most = self.burst_bytes()
        enough = self.cwnd // 3
        limit = self.una + min(cwnd, params.window_bytes)
        if self._recovering:
            limit += self._beyond
        while True:
            start = self.nxt
            goal = self.top if start < self.top else self.written  # what went before goes alone
            size = min(goal, limit, start + most) - start
            if size <= 0 or size < most and size < enough and size < goal - start \
                    and start > self.una:  # it is worth waiting for more acknowledgements
                return
            part = size % MSS_BYTES
            if part and (start + size < goal or start >= self.top and not self._small_may_go()):
                size -= part
                if not size:
                    return
            self._train(start, start + size)

    def shut(self) -> None:
        """Send nothing more. What was not heard will not be."""
        self.join()
        self.open = False
        self.messages.clear()
        self._waiters.clear()
        self.heard = 0
        self.timer.stop()

    @property
    def express_ns(self) -> int:
        """When a message came to the peer by express last; 0: none did."""
        return 0 if self.express is None else self.express.heard_ns

    @property
    def pending(self) -> int:
        """Bytes that were written and may not be there."""
        express = self.express
        flying = 0 if express is None or express.flight is None else express.flying()
        return self.written + flying - self.una

    @property
    def room(self) -> bool:
        """Whether the send buffer takes another message now."""
        return self.pending < self.room_bytes

    def when_room(self, fn: Callable[[], Any]) -> None:
        """Call ``fn()`` once, when an acknowledgement has made room (now, if there is some)."""
        if self.room:
            fn()
        else:
            self.join()
            self._waiters.append(fn)

    def _small_may_go(self) -> bool:
        """Nagle's algorithm as Linux has it: one segment that is not full may be on its way."""
        return self._small <= self.una or self.nodelay or self.finishing

    def _tell_waiters(self) -> None:
        while self._waiters and self.room:
            self._waiters.pop(0)()

    def _duplicate(self, duplicates: int) -> None:
        """Something behind the first missing segment has arrived."""
        self._duplicates += duplicates
        if self._recovering:
            self.push()
        elif self._duplicates >= self.params.duplicate_acks and self.una >= self._recover:
            self._recovering = True
            self._recover = self.top
            self.halve(self.nxt - self.una)
            self._mend()

    def _recovered(self) -> None:
        """An acknowledgement during fast recovery: of all, or up to the next gap."""
        if self.una >= self._recover:
            self._recovering = False
            self._beyond = 0
        elif self._hole_end > self.una >= self._resent:
            self._mend()

    def _mend(self) -> None:
        """Send the first gap again."""
        end = min(self._hole_end, self._recover, self.una + self.params.train * MSS_BYTES)
        nxt = self.nxt
        self._train(self.una, end)
        self._resent, self.nxt = end, nxt

    def _expired(self) -> None:
        """The retransmission timer."""
        self.join()
        self._expiries += 1
        if self._expiries > self.params.retries:
            self.end.fail("timeout")
            return
        if self._expiries == 1:
            self.halve(self.nxt - self.una)
        self.cwnd = MSS_BYTES
        self.nxt = self.una
        self._recovering = False
        self._recover = self.top
        self._duplicates = 0
        self.push()

    def _lone(self, start: int, end: int, message: Any, kind: str | None) -> None:
        """The message of every day: one in one segment, behind all that was sent."""
        now_ns = self._kernel.now_ns
        rto_ns = self.rto_ns
        if start == self.una:
            if self.cwnd > self.initial:
                self.wake()
            self.timer.expect(now_ns + rto_ns)
        self.sent_ns = now_ns
        self.nxt = self.top = end
        size_bytes = end - start
        if size_bytes < MSS_BYTES:
            self._small = end
        size_bytes += SEGMENT_HEADER_BYTES
        graph, back = self._graph, self.back
        if kind is None:
            message.last_ns = now_ns
            if message.first_ns < 0:
                message.first_ns = now_ns
            graph.put(pack(now_ns, graph.FRAME, self._host_id, self._to_id, message.seq,
                           size_bytes))
        else:
            graph.context.book(kind, self._host, self._to_id, size_bytes)
        echo_ns = back.echo_ns if back.due_ns else -1
        back.due_ns = 0
        back.said = said = back.nxt
        self._transmit(self._host, self._to, size_bytes, 1, False, self.peer,
                       (start, end, said, now_ns, echo_ns))

    def _train(self, start: int, end: int) -> None:
        """Bytes ``start`` to ``end`` as one train, whatever they are."""
        now_ns = self._kernel.now_ns
        size_bytes, segments = on_wire(end - start)
        headers = size_bytes - (end - start)
        for message, kind, payload_bytes in parts(self.messages, self.una, start, end):
            self.end.account(message, kind, payload_bytes + headers)
            headers = 0  # its first message bears them
        if start == self.una:
            self.timer.expect(now_ns + min(self.rto_ns << self._expiries,
                                            self.params.rto_max_ns))
        self.nxt = end
        if end > self.top:
            self.top = end
            if (end - start) % MSS_BYTES:
                self._small = end
        self.sent_ns = now_ns
        back = self.back
        echo_ns = back.echo_ns if back.due_ns else -1
        back.due_ns = 0
        back.said = back.nxt
        self._transmit(self._host, self._to, size_bytes, segments, False, self.peer,
                       (start, end, back.nxt, now_ns, echo_ns))
