"""The sending half of one direction of a connection: new data, and retransmissions."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.middleware.headers import MSS_BYTES, SEGMENT_HEADER_BYTES, on_wire
from desim.middleware.tcp.hystart import LOW_WINDOW_BYTES
from desim.middleware.tcp.repair import Repair
from desim.middleware.tcp.retransmission import RetransmissionTimer
from desim.middleware.tcp.scoreboard import Scoreboard
from desim.middleware.tcp.transit import FIN, Token, Transit, parts
from desim.middleware.tcp.window import CongestionWindow
from desim.middleware.timers import NEVER
from desim.network.carrier import Carrier

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.receiver import Receiver

# An acknowledgement: all before this byte has arrived; when the segment was sent that it answers;
# the ranges behind that byte that have arrived, too; bytes that have come twice (D-SACK).
Ack = tuple[int, int, tuple[tuple[int, int], ...], "tuple[int, int] | None"]

_WORTH = 3  # of the window at least this part (Linux tcp_tso_should_defer, tcp_tso_win_divisor)
_PIECE_BYTES = 832  # of memory beside the bytes (SKB_TRUESIZE(0), measured)


class Sender(Carrier[Ack], CongestionWindow):
    """Bytes ``una`` to ``nxt`` are on their way; those up to ``written`` wait to be sent. ``back``
    is the receiver at this end. ``transit`` has the messages that are not yet acknowledged, or
    refused by the closed peer. ``repair``: not None while bytes are believed lost.
    """

    back: Receiver
    protocol = "tcp"
    __slots__ = ("end", "back", "open", "nodelay", "transit", "_messages", "una", "nxt", "written",
                 "finishing", "received_ns", "repair", "retransmission", "timer", "_waiters",
                 "_small", "_full_end", "_trains", "sent_ns", "_context", "_kernel", "_way",
                 "_transmit", "_host", "_to", "_host_id", "_to_id", "_record_frame")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        super().__init__(connection.tcp.constants)
        self.end = end
        self.nodelay = connection.nodelay
        self.open = self.finishing = False
        self.transit = Transit(self)
        self._messages = self.transit.messages
        self.una = self.nxt = self.written = 0
        self.repair: Repair | None = None
        self._waiters: list[Callable[[], object]] = []
        self.received_ns = self.sent_ns = 0
        self._small = 0  # end of the last segment that was not full
        self._full_end = 0  # what had been sent when the window was full last (cwnd_usage_seq)
        self._trains: deque[tuple[int, int]] = deque()  # end, sent_ns of all but the last one
        self._context = context = connection.tcp.context
        self._kernel = context.kernel
        self._record_frame = context.record_frame
        self.retransmission = RetransmissionTimer(self, connection.tcp.timers, entity)
        self.timer = self.retransmission.timer
        self._way = end.way
        self._transmit = end.way.transmit
        self._host, self._to = end.host, (end.peer,)
        self._host_id, self._to_id = context.host_ids[end.host], context.host_ids[end.peer]

    @property
    def conversation(self) -> Connection:
        return self.end.connection

    @property
    def now_ns(self) -> int:
        return self._kernel.now_ns

    @property
    def head_ns(self) -> int:
        """The time when the first bytes in flight were sent."""
        if self.repair is None:
            return self._trains[0][1] if self._trains else self.sent_ns
        return self.repair.board.runs[0].sent_ns

    # The socket.

    def send(self, size_bytes: int, arrived: Callable[..., object], token: Token,
             kind: str | None, writes: int = 1) -> None:
        """See ``Connection.send``. TCP cuts writes that may not go at once as usual."""
        start = self.written
        self.written = end = start + size_bytes
        self._messages.append((end, arrived, token, kind))
        small_may_go = self._small <= self.una or self.nodelay
        if self.nxt == start and small_may_go and size_bytes <= writes * MSS_BYTES \
                and kind is not FIN and end - self.una <= self.cwnd and self.open \
                and self.repair is None:
            self._lone(start, end, token, kind, writes)
        elif small_may_go or end - self.nxt >= MSS_BYTES:
            self.push()

    def wake(self) -> None:
        """Sending begins after a rest: the window may have to shrink."""
        self.rest(self._kernel.now_ns - self.sent_ns)

    def finish(self, finishes: Callable[..., object]) -> None:
        """Send all that was written, without delay, and a FIN behind it: one byte of the sequence,
        which the network carries as one byte, too."""
        self.finishing = True
        self.send(1, finishes, None, FIN)
        self.push()

    def shut(self) -> None:
        """Send nothing more. Messages that have not arrived never will."""
        self.open = False
        self.transit.clear()
        self._waiters.clear()
        self.timer.stop()

    @property
    def pending(self) -> int:
        """The bytes that were written and may not have arrived."""
        return self.written - self.una

    @property
    def writable(self) -> bool:
        """Whether poll() reports the socket as writable: a third of the send buffer is free (Linux
        sk_stream_is_writeable). A writer that has waited for that may go on while it ``takes``."""
        pending = self.written - self.una
        return 3 * pending < self.memory_bytes or 3 * (
            pending + _PIECE_BYTES * self._pieces()) <= 2 * self.memory_bytes

    @property
    def takes(self) -> bool:
        """Whether write() takes data. Linux collects waiting data in pieces of so many segments,
        and begins another piece as long as memory is left (tcp_sendmsg, tcp_xmit_size_goal)."""
        if self.writable:
            return True
        flying = self.nxt - self.una
        left = self.memory_bytes - flying - _PIECE_BYTES * self._pieces()
        piece_bytes = self.constants.piece_segments * MSS_BYTES
        pieces = max(-(-left // (piece_bytes + _PIECE_BYTES)), 0)
        return self.pending < flying + pieces * piece_bytes

    def _pieces(self) -> int:
        """Roughly the number of pieces in flight."""
        return len(self._trains) + 1

    def when_writable(self, fn: Callable[[], object]) -> None:
        """Call ``fn()`` once, as soon as the socket is writable, maybe now."""
        if self.writable:
            fn()
        else:
            self._waiters.append(fn)

    # Acknowledgements.

    def arrived(self, ack: Ack, receiver: int) -> None:
        """An acknowledgement without data."""
        if not self.open:
            self.end.stray(self, ack)
            return
        self.received_ns = self._kernel.now_ns
        number, echo_ns, ranges, copy = ack
        if copy is not None:
            self.retransmission.copied(*copy)
        if number > self.una or ranges and number == self.una:
            self.acked(number, echo_ns, ranges)

    def arrived_in_part(self, ack: Ack, receiver: int, lost: dict[int, str]) -> None:
        """Acknowledgements are cumulative: those that arrive stand for those that do not."""
        self.arrived(ack, receiver)

    def lost(self, ack: Ack, receiver: int, reason: str) -> None:
        """A lost acknowledgement: nobody learns of it, but a probe or timeout may follow."""
        self.retransmission.hide(ack[0])

    def acked(self, number: int, echo_ns: int,
              ranges: tuple[tuple[int, int], ...] = ()) -> None:
        """All before byte ``number`` has arrived, and ``ranges``: more than was known before."""
        una, nxt = self.una, self.nxt
        now_ns = self._kernel.now_ns
        repair = self.repair
        if repair is None:
            if ranges:
                repair = self.begin_repair()
            elif una < self._full_end or (nxt - una) * 2 > self.cwnd:
                self.grow(number - una, una < self._full_end, now_ns)
        since_ns = self.head_ns if repair is None else repair.acknowledge(number, ranges, now_ns)
        if since_ns < 0 and number > una:
            since_ns = echo_ns  # bytes that went twice do not tell (Linux tcp_ack_update_rtt)
        if since_ns >= 0:
            self.sample(now_ns - since_ns, now_ns)
            if LOW_WINDOW_BYTES <= self.cwnd < self.ssthresh:
                self.watch(number, number - una, nxt, now_ns - since_ns, now_ns)
        if number > una:
            self._advance(number, now_ns)
        if repair is not None:
            repair.react(number > una, echo_ns, now_ns)
        messages, left = self._messages, self.written - number
        if left:
            if left <= MSS_BYTES and number == nxt and len(messages) == 1 \
                    and messages[0][3] is not FIN and self.repair is None:
                self._lone(number, self.written, messages[0][2], messages[0][3])
            else:
                self.push()
        elif self.finishing:
            self.transit.clear()
            self.end.finished()
        while self._waiters and self.writable:
            self._waiters.pop(0)()

    def _advance(self, number: int, now_ns: int) -> None:
        """All before ``number`` has arrived."""
        self.una = number
        self._way.confirmed_ns = now_ns
        if number < self.nxt:
            self.timer.expect(now_ns + self.rto_ns)
            trains = self._trains
            while trains and trains[0][0] <= number:
                trains.popleft()
        else:
            self.timer.deadline_ns = NEVER
            self._trains.clear()
        if self.retransmission.uneasy:
            self.retransmission.advanced(number, now_ns)
        messages, transit = self._messages, self.transit
        delivered = transit.delivered
        if number < self.written or delivered < len(messages):
            while delivered and messages[0][0] <= number:  # refused messages stay
                messages.popleft()
                delivered -= 1
            transit.delivered = delivered
        else:
            messages.clear()
            transit.delivered = 0

    # Data.

    def push(self) -> None:
        """Send all data that may go now, if the connection is open."""
        if not self.open:
            return
        constants, repair = self.constants, self.repair
        if self.una == self.nxt:
            self.wake()
        cwnd = self.cwnd
        if self.near and self.una == self.nxt:
            most = constants.train * MSS_BYTES
            cwnd = max(most, cwnd)
        else:
            most = self.burst_bytes()
        enough = self.cwnd // _WORTH
        if repair is not None:
            repair.push()
            enough = 0
        while True:
            start = self.nxt
            flying = start - self.una if repair is None else repair.board.flying
            size = min(self.written - start, cwnd - flying,
                       self.una + constants.window_bytes - start, most)
            if size <= 0 or size < most and size < enough and size < self.written - start \
                    and start > self.una:  # it is worth waiting for more acknowledgements
                break
            part = size % MSS_BYTES
            if part and (start + size < self.written or not self.small_may_go()):
                size -= part
            if not size:
                break
            self._train(start, start + size)
        if size > 0 or flying + MSS_BYTES > cwnd:
            self._full_end = start

    def send_again(self, start: int, end: int) -> None:
        """Send bytes again that seem to be lost."""
        if start == self.una:
            self.retransmission.restart()
        self._frame(start, end)

    def probe(self) -> bool:
        """Send one segment more, new data, even if Nagle's algorithm holds it, or the last one
        again. Returns whether it is new (Linux tcp_send_loss_probe)."""
        start = self.nxt
        size = min(self.written - start, MSS_BYTES, self.una + self.constants.window_bytes - start)
        if size > 0:
            self._train(start, start + size)
            return True
        repair = self.repair or self.begin_repair()
        tail = repair.board.tail(MSS_BYTES, self._kernel.now_ns)
        self._frame(tail.start, tail.end)
        return False

    def begin_repair(self) -> Repair:
        """Some bytes seem to be lost: repair them."""
        trains = [*self._trains, (self.nxt, self.sent_ns)]
        self.repair = repair = Repair(self, Scoreboard(self.una, trains))
        return repair

    def small_may_go(self) -> bool:
        """Nagle's algorithm as Linux has it: one segment that is not full may be on its way."""
        return self._small <= self.una or self.nodelay or self.finishing

    # Frames.

    def _lone(self, start: int, end: int, message: Token, kind: str | None,
              segments: int = 1) -> None:
        """Send one message in one segment, or one a write: the common case, without loops."""
        now_ns = self._kernel.now_ns
        if start == self.una:
            if self.cwnd != self.initial:
                self.wake()
            self.timer.expect(now_ns + self.rto_ns)
        else:
            self._trains.append((start, self.sent_ns))
            if end - self.una + MSS_BYTES > self.cwnd:
                self._full_end = end
            if self.retransmission.uneasy:
                self.retransmission.postpone()
        self.sent_ns = now_ns
        self.nxt = end
        size_bytes = end - start
        if size_bytes < segments * MSS_BYTES:
            self._small = end
        size_bytes += segments * SEGMENT_HEADER_BYTES
        back = self.back
        if kind is None:
            message.last_ns = now_ns
            if message.first_ns < 0:
                message.first_ns = now_ns
            self._record_frame(self._host_id, self._to_id, message.seq, size_bytes)
        else:
            self._context.record_control(kind, self._host, self._to_id, size_bytes)
        self._transmit(self._host, self._to, size_bytes, segments, False, self.transit.receiver,
                       (start, end, back.nxt, now_ns, back.answer(now_ns), False, segments))

    def _train(self, start: int, end: int) -> None:
        """Send new bytes as one train."""
        now_ns = self._kernel.now_ns
        if start == self.una:
            self.timer.expect(now_ns + self.rto_ns)
        else:
            self._trains.append((start, self.sent_ns))
            if self.retransmission.uneasy:
                self.retransmission.postpone()
        self.nxt = end
        if (end - start) % MSS_BYTES:
            self._small = end
        self.sent_ns = now_ns
        if self.repair is not None:
            self.repair.sent(start, end, now_ns)
        self._frame(start, end)

    def _frame(self, start: int, end: int) -> None:
        """Send bytes ``start`` to ``end`` as one train, whether new or not."""
        now_ns = self._kernel.now_ns
        size_bytes, segments = on_wire(end - start)
        headers = size_bytes - (end - start)
        for message, kind, payload_bytes in parts(self._messages, self.una, start, end):
            self.end.record_frame(message, kind, payload_bytes + headers)
            headers = 0  # its first message bears them
        back = self.back
        fin = self.finishing and end == self.written
        self._transmit(self._host, self._to, size_bytes, segments, False, self.transit.receiver,
                       (start, end, back.nxt, now_ns, back.answer(now_ns), fin, 0))
