"""The sending half of one direction of a connection: new data, and retransmissions."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.middleware.headers import MSS_BYTES, SEGMENT_HEADER_BYTES, on_wire
from desim.middleware.tcp.hystart import LOW_WINDOW_BYTES
from desim.middleware.tcp.loss_recovery import LossRecovery
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

# An acknowledgement: SEG.ACK, all before which has arrived; the time stamp that it echoes; the SACK
# blocks behind that byte (RFC 2018); bytes that have come twice (D-SACK, RFC 2883).
Ack = tuple[int, int, tuple[tuple[int, int], ...], "tuple[int, int] | None"]

_TSO_WIN_DIVISOR = 3  # of the window a train has at least this part (Linux tcp_tso_should_defer)
_PIECE_BYTES = 832  # of memory beside the bytes (SKB_TRUESIZE(0), measured)


class Sender(Carrier[Ack], CongestionWindow):
    """Bytes ``snd_una`` to ``snd_nxt`` are on their way; those up to ``write_seq`` wait to be sent
    (SND.UNA and SND.NXT of RFC 9293, Linux's write_seq). ``back`` is the receiver at this end.
    ``transit`` has the messages that are not yet acknowledged, or refused by the closed peer.
    ``recovery``: not None while bytes are believed lost.
    """

    back: Receiver
    protocol = "tcp"
    __slots__ = ("end", "back", "open", "nodelay", "transit", "_messages", "snd_una", "snd_nxt",
                 "write_seq", "finishing", "received_ns", "recovery", "retransmission", "timer",
                 "_waiters", "_snd_sml", "_cwnd_usage_seq", "_trains", "sent_ns", "_kernel", "_way",
                 "_transmit", "_host", "_to")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        super().__init__(connection.tcp.constants)
        self.end = end
        self.nodelay = connection.nodelay
        self.open = self.finishing = False
        self.transit = Transit(self)
        self._messages = self.transit.messages
        self.snd_una = self.snd_nxt = self.write_seq = 0
        self.recovery: LossRecovery | None = None
        self._waiters: list[Callable[[], object]] = []
        self.received_ns = self.sent_ns = 0
        self._snd_sml = 0  # end of the last segment that was not full
        self._cwnd_usage_seq = 0  # what had been sent when the window was full last
        self._trains: deque[tuple[int, int]] = deque()  # end, sent_ns of all but the last one
        self._kernel = connection.tcp.context.kernel
        self.retransmission = RetransmissionTimer(self, connection.tcp.timers, entity)
        self.timer = self.retransmission.timer
        self._way = end.way
        self._transmit = end.way.transmit
        self._host, self._to = end.host, (end.peer,)

    @property
    def conversation(self) -> Connection:
        return self.end.connection

    @property
    def now_ns(self) -> int:
        return self._kernel.now_ns

    @property
    def head_ns(self) -> int:
        """The time when the first bytes in flight were sent."""
        if self.recovery is None:
            return self._trains[0][1] if self._trains else self.sent_ns
        return self.recovery.board.runs[0].sent_ns

    # The socket.

    def send(self, size_bytes: int, arrived: Callable[..., object], token: Token,
             kind: str | None, writes: int = 1) -> None:
        """See ``Connection.send``. TCP cuts writes that may not go at once as usual."""
        start = self.write_seq
        self.write_seq = end = start + size_bytes
        self._messages.append((end, arrived, token, kind))
        small_may_go = self._snd_sml <= self.snd_una or self.nodelay or self.finishing
        if self.snd_nxt == start and small_may_go and size_bytes <= writes * MSS_BYTES \
                and kind is not FIN and end - self.snd_una <= self.cwnd and self.open \
                and self.recovery is None:
            self._send_message(start, end, token, kind, writes)
        elif small_may_go or end - self.snd_nxt >= MSS_BYTES:
            self.push()

    def finish(self, finishes: Callable[..., object]) -> None:
        """Send all that was written, without delay, and a FIN behind it: one byte of the sequence,
        which the network carries as one byte, too."""
        self.finishing = True
        self.send(1, finishes, None, FIN)

    def shut(self) -> None:
        """Send nothing more. Messages that have not arrived never will."""
        self.open = False
        self.transit.clear()
        self._waiters.clear()
        self.timer.stop()

    @property
    def pending(self) -> int:
        """The bytes that were written and may not have arrived."""
        return self.write_seq - self.snd_una

    @property
    def writable(self) -> bool:
        """Whether poll() reports the socket as writable: a third of the send buffer is free (Linux
        sk_stream_is_writeable). A writer that has waited for that may go on while it ``takes``."""
        pending = self.write_seq - self.snd_una
        return 3 * pending < self.sndbuf_bytes or 3 * (
            pending + _PIECE_BYTES * self._pieces()) <= 2 * self.sndbuf_bytes

    @property
    def takes(self) -> bool:
        """Whether write() takes data. Linux collects waiting data in pieces of so many segments,
        and begins another piece as long as memory is left (tcp_sendmsg, tcp_xmit_size_goal)."""
        if self.writable:
            return True
        in_flight = self.snd_nxt - self.snd_una
        left = self.sndbuf_bytes - in_flight - _PIECE_BYTES * self._pieces()
        piece_bytes = self.constants.piece_segments * MSS_BYTES
        pieces = max(-(-left // (piece_bytes + _PIECE_BYTES)), 0)
        return self.pending < in_flight + pieces * piece_bytes

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
            self.retransmission.dsacked(*copy)
        if number > self.snd_una or ranges and number == self.snd_una:
            self.acked(number, echo_ns, ranges)

    def arrived_in_part(self, ack: Ack, receiver: int, lost: dict[int, str]) -> None:
        """Acknowledgements are cumulative: those that arrive stand for those that do not."""
        self.arrived(ack, receiver)

    def lost(self, ack: Ack, receiver: int, reason: str) -> None:
        """A lost acknowledgement: nobody learns of it, but a probe or timeout may follow."""
        self.retransmission.lost_unnoticed(ack[0])

    def acked(self, number: int, echo_ns: int,
              ranges: tuple[tuple[int, int], ...] = ()) -> None:
        """All before byte ``number`` has arrived, and ``ranges``: more than was known before."""
        una, nxt = self.snd_una, self.snd_nxt
        now_ns = self._kernel.now_ns
        recovery = self.recovery
        if recovery is None:
            if ranges:
                recovery = self.begin_recovery()
            elif una < self._cwnd_usage_seq or (nxt - una) * 2 > self.cwnd:
                self.grow(number - una, una < self._cwnd_usage_seq, now_ns)
        since_ns = (self.head_ns if recovery is None
                    else recovery.acknowledge(number, ranges, now_ns))
        if since_ns < 0 and number > una:
            since_ns = echo_ns  # bytes that went twice do not tell (Linux tcp_ack_update_rtt)
        if since_ns >= 0:
            self.sample(now_ns - since_ns, now_ns)
            if LOW_WINDOW_BYTES <= self.cwnd < self.ssthresh:
                self.hystart_update(number, number - una, nxt, now_ns - since_ns, now_ns)
        if number > una:
            self._advance_una(number, now_ns)
        if recovery is not None:
            recovery.react(number > una, echo_ns, now_ns)
        messages, left = self._messages, self.write_seq - number
        if left:
            if left <= MSS_BYTES and number == nxt and len(messages) == 1 \
                    and messages[0][3] is not FIN and self.recovery is None:
                self._send_message(number, self.write_seq, messages[0][2], messages[0][3])
            else:
                self.push()
        elif self.finishing:
            self.transit.clear()
            self.end.finished()
        while self._waiters and self.writable:
            self._waiters.pop(0)()

    def _advance_una(self, number: int, now_ns: int) -> None:
        """All before ``number`` has arrived."""
        self.snd_una = number
        self._way.confirmed_ns = now_ns
        if number < self.snd_nxt:
            self.timer.expect(now_ns + self.rto_ns)
            trains = self._trains
            while trains and trains[0][0] <= number:
                trains.popleft()
        else:
            self.timer.deadline_ns = NEVER
            self._trains.clear()
        if self.retransmission.armed:
            self.retransmission.una_advanced(number, now_ns)
        messages, transit = self._messages, self.transit
        delivered = transit.delivered
        if number < self.write_seq or delivered < len(messages):
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
        constants, recovery = self.constants, self.recovery
        if self.snd_una == self.snd_nxt:
            self.restart_after_idle(self._kernel.now_ns - self.sent_ns)
        cwnd = self.cwnd
        if self.near and self.snd_una == self.snd_nxt:
            most = constants.train * MSS_BYTES
            cwnd = max(most, cwnd)
        else:
            most = self.burst_bytes()
        enough = self.cwnd // _TSO_WIN_DIVISOR
        if recovery is not None:
            recovery.push()
            enough = 0
        while True:
            start = self.snd_nxt
            in_flight = start - self.snd_una if recovery is None else recovery.board.in_flight
            size = min(self.write_seq - start, cwnd - in_flight,
                       self.snd_una + constants.window_bytes - start, most)
            if size <= 0 or size < most and size < enough and size < self.write_seq - start \
                    and start > self.snd_una:  # it is worth waiting for more acknowledgements
                break
            part = size % MSS_BYTES
            if part and (start + size < self.write_seq or not self.small_may_go()):
                size -= part
            if not size:
                break
            self._send_train(start, start + size)
        if size > 0 or in_flight + MSS_BYTES > cwnd:
            self._cwnd_usage_seq = start

    def send_again(self, start: int, end: int) -> None:
        """Send bytes again that seem to be lost."""
        if start == self.snd_una:
            self.retransmission.restart()
        self._transmit_train(start, end)

    def probe(self) -> bool:
        """Send one segment more, new data, even if Nagle's algorithm holds it, or the last one
        again. Returns whether it is new (Linux tcp_send_loss_probe)."""
        start = self.snd_nxt
        size = min(self.write_seq - start, MSS_BYTES,
                   self.snd_una + self.constants.window_bytes - start)
        if size > 0:
            self._send_train(start, start + size)
            return True
        recovery = self.recovery or self.begin_recovery()
        tail = recovery.board.tail(MSS_BYTES, self._kernel.now_ns)
        self._transmit_train(tail.start, tail.end)
        return False

    def begin_recovery(self) -> LossRecovery:
        """Some bytes seem to be lost."""
        trains = [*self._trains, (self.snd_nxt, self.sent_ns)]
        self.recovery = recovery = LossRecovery(self, Scoreboard(self.snd_una, trains))
        return recovery

    def small_may_go(self) -> bool:
        """Nagle's algorithm as Linux has it: one segment that is not full may be on its way."""
        return self._snd_sml <= self.snd_una or self.nodelay or self.finishing

    # Frames.

    def _send_message(self, start: int, end: int, message: Token, kind: str | None,
                      segments: int = 1) -> None:
        """Send one message in one segment, or one a write: the common case, without loops."""
        now_ns = self._kernel.now_ns
        if start == self.snd_una:
            if self.cwnd != self.initial_cwnd:
                self.restart_after_idle(now_ns - self.sent_ns)
        elif end - self.snd_una + MSS_BYTES > self.cwnd:
            self._cwnd_usage_seq = end
        size_bytes = end - start
        self._advance_nxt(start, end, now_ns, size_bytes >= segments * MSS_BYTES)
        size_bytes += segments * SEGMENT_HEADER_BYTES
        self.end.record_frame(message, kind, size_bytes)
        back = self.back
        self._transmit(self._host, self._to, size_bytes, segments, False, self.transit.receiver,
                       (start, end, back.rcv_nxt, now_ns, back.piggyback(now_ns), False, segments))

    def _send_train(self, start: int, end: int) -> None:
        """Send new bytes as one train."""
        now_ns = self._kernel.now_ns
        self._advance_nxt(start, end, now_ns, (end - start) % MSS_BYTES == 0)
        if self.recovery is not None:
            self.recovery.sent(start, end, now_ns)
        self._transmit_train(start, end)

    def _advance_nxt(self, start: int, end: int, now_ns: int, full: bool) -> None:
        """New bytes are being sent, in ``full`` segments or not."""
        if start == self.snd_una:
            self.timer.expect(now_ns + self.rto_ns)
        else:
            self._trains.append((start, self.sent_ns))
            if self.retransmission.armed:
                self.retransmission.rearm_probe()
        self.snd_nxt, self.sent_ns = end, now_ns
        if not full:
            self._snd_sml = end

    def _transmit_train(self, start: int, end: int) -> None:
        """Send bytes ``start`` to ``end`` as one train, whether new or not."""
        now_ns = self._kernel.now_ns
        size_bytes, segments = on_wire(end - start)
        headers = size_bytes - (end - start)
        for message, kind, payload_bytes in parts(self._messages, self.snd_una, start, end):
            self.end.record_frame(message, kind, payload_bytes + headers)
            headers = 0  # its first message bears them
        back = self.back
        fin = self.finishing and end == self.write_seq
        self._transmit(self._host, self._to, size_bytes, segments, False, self.transit.receiver,
                       (start, end, back.rcv_nxt, now_ns, back.piggyback(now_ns), fin, 0))
