"""The repair of losses by a sender, from the first sign of one until all has arrived."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.tcp.scoreboard import ARRIVED, LOST, Scoreboard
from desim.middleware.transports import MSS_BYTES

if TYPE_CHECKING:
    from desim.middleware.tcp.sender import Sender

# There are gaps, which may be disorder; they are losses and are repaired; the timer went off.
DISORDER, RECOVERY, LOSS = range(3)  # Linux tcp_ca_state

_LATE_TICKS = 2  # beside the reordering window (Linux TCP_TIMEOUT_MIN)


class Repair:
    """The loss recovery of one sender. Gaps are known by selective acknowledgements; a range is
    lost if a later one has arrived, at once if enough has arrived behind it, else a quarter of a
    round trip later (RACK, RFC 8985). During recovery the window shrinks in proportion to what
    arrives (PRR, RFC 6937); after a timeout it starts from one segment."""

    def __init__(self, sender: Sender, board: Scoreboard) -> None:
        self._sender = sender
        self.board = board
        self.state = DISORDER
        self._end = 0  # end of the bytes that had been sent when a loss was noticed
        self._news = 0  # bytes that the last acknowledgement was the first to cover
        self._window = 0  # when recovery began, and since then:
        self._arrived = self._sent = 0
        self._began_ns = 0
        self._before = 0, 0  # window and threshold

    def acknowledge(self, una: int, ranges: tuple[tuple[int, int], ...], now_ns: int) -> None:
        """Take an acknowledgement."""
        self._news = self.board.acknowledge(una, ranges, now_ns, self._sender.least_rtt_ns)

    def react(self, advanced: bool, echo_ns: int, now_ns: int) -> None:
        """Act on the acknowledgement, after the sender has taken its ``una``."""
        sender, board = self._sender, self.board
        if advanced and self.state == LOSS and 0 <= echo_ns < self._began_ns:
            self._undone()
        if self.state != DISORDER and sender.una >= self._end:
            self._over()
        lost = self._notice(now_ns)
        if self.state == RECOVERY:
            self._reduce(lost, advanced)
        elif advanced and self._news:
            sender.grow(self._news, max(board.flying + self._news, sender.cwnd), now_ns)
        if self.state == DISORDER and not board.bytes[ARRIVED] and not board.bytes[LOST]:
            sender.repair = None

    def give_up_late(self, now_ns: int) -> None:
        """The wait for late ranges is over: those that have not come are lost."""
        self._news = 0
        if self._notice(now_ns) and self.state == RECOVERY and not self._sent:
            self._sender.cwnd = self.board.flying + MSS_BYTES
        self._sender.push()

    def time_out(self, now_ns: int) -> None:
        """The timer went off: all bytes on their way are lost, but for the latest."""
        sender, board = self._sender, self.board
        if self.state == DISORDER or sender.una >= self._end:
            self._begin(now_ns)
        sender.forget()
        self.state = LOSS
        self._end = sender.nxt
        board.mark_lost(now_ns - max(board.newest_rtt_ns, sender.srtt_ns))
        sender.cwnd = board.flying + MSS_BYTES

    def push(self) -> None:
        """Send lost bytes again, as far as the window allows."""
        sender, board = self._sender, self.board
        most = sender.params.train * MSS_BYTES
        while (run := board.first_lost()) is not None:
            free = sender.cwnd - board.flying
            if free <= 0 or free < MSS_BYTES and board.flying:
                return
            end = min(run.end, run.start + min(max(free - free % MSS_BYTES, MSS_BYTES), most))
            board.send_again(run, end, sender.now_ns)
            self._sent += end - run.start
            sender.send_again(run.start, end)

    def sent(self, start: int, end: int, now_ns: int) -> None:
        """New bytes have left."""
        self.board.send(start, end, now_ns)
        self._sent += end - start

    def _begin(self, now_ns: int) -> None:
        """A loss was noticed."""
        sender = self._sender
        self._before = sender.cwnd, sender.ssthresh
        self._began_ns = now_ns
        flying = sender.nxt - sender.una
        self._window = max(sender.cwnd, flying) if sender.near else sender.cwnd
        sender.less(flying)
        self._end = sender.nxt
        self._arrived = self._sent = 0

    def _notice(self, now_ns: int) -> int:
        """Find lost bytes; wait for those that may be late. Returns the number of lost bytes.
        """
        sender, board = self._sender, self.board
        patience_ns = 0
        if self.state == DISORDER \
                and board.bytes[ARRIVED] < sender.params.duplicate_acks * MSS_BYTES:
            patience_ns = min(sender.least_rtt_ns >> 2, sender.srtt_ns)
        lost, wait_ns = board.overtaken(patience_ns, now_ns)
        if wait_ns:
            sender.retransmission.await_late(wait_ns + _LATE_TICKS * sender.params.tick_ns)
        if lost and self.state == DISORDER:
            self._begin(now_ns)
            self.state = RECOVERY
        return lost

    def _reduce(self, lost: int, advanced: bool) -> None:
        """Proportional rate reduction (RFC 6937, as Linux tcp_cwnd_reduction)."""
        if not self._news:
            return
        sender, flying = self._sender, self.board.flying
        self._arrived += self._news
        free = sender.ssthresh - flying
        if free < 0:
            count = -(-sender.ssthresh * self._arrived // self._window) - self._sent
        else:
            count = max(self._arrived - self._sent, self._news)
            if advanced and not lost:
                count += MSS_BYTES
            count = min(free, count)
        sender.cwnd = flying + max(count, 0 if self._sent else MSS_BYTES)

    def _over(self) -> None:
        """All bytes that had been sent when the loss was noticed have arrived."""
        if self.state == RECOVERY:
            self._sender.cwnd = self._sender.ssthresh
        self.state = DISORDER

    def _undone(self) -> None:
        """The timeout was false: the original arrived (Eifel, RFC 3522). Restore the window."""
        sender = self._sender
        window, threshold = self._before
        self.state = DISORDER
        self.board.unmark_lost()
        sender.cwnd = max(sender.cwnd, window)
        sender.ssthresh = max(sender.ssthresh, threshold)
