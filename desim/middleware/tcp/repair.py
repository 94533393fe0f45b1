"""How a sender repairs what the network has lost, from the first sign of it until all is well."""

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

    __slots__ = ("board", "state", "_sender", "_end", "_news", "_window", "_arrived", "_sent",
                 "_began_ns", "_before")

    def __init__(self, sender: Sender, board: Scoreboard) -> None:
        self._sender = sender
        self.board = board
        self.state = DISORDER
        self._end = 0  # what had been sent when a loss was noticed
        self._news = 0  # bytes that the last acknowledgement told of
        self._window = 0  # when recovery began, and since then:
        self._arrived = self._sent = 0
        self._began_ns = 0
        self._before = 0, 0  # window and threshold

    def hear(self, una: int, ranges: tuple[tuple[int, int], ...], now_ns: int) -> None:
        """An acknowledgement has come."""
        self._news = self.board.hear(una, ranges, now_ns, self._sender.least_rtt_ns)

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

    def look_again(self, now_ns: int) -> None:
        """The wait for late ranges is over: those that have not come are lost."""
        self._news = 0
        if self._notice(now_ns) and self.state == RECOVERY and not self._sent:
            self._sender.cwnd = self.board.flying + MSS_BYTES
        self._sender.push()

    def time_out(self, now_ns: int) -> None:
        """All that is on its way is lost, but for what was sent just now."""
        sender, board = self._sender, self.board
        if self.state == DISORDER or sender.una >= self._end:
            self._begin(now_ns)
        sender.forget()
        self.state = LOSS
        self._end = sender.nxt
        board.lose(now_ns - max(board.newest_rtt_ns, sender.srtt_ns))
        sender.cwnd = board.flying + MSS_BYTES

    def push(self) -> None:
        """Send again what is lost and the window has room for."""
        sender, board = self._sender, self.board
        most = sender.params.train * MSS_BYTES
        while (run := board.first_lost()) is not None:
            room = sender.cwnd - board.flying
            if room <= 0 or room < MSS_BYTES and board.flying:
                return
            end = min(run.end, run.start + min(max(room - room % MSS_BYTES, MSS_BYTES), most))
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
        """Find what is lost; wait for what may only be late. Returns the bytes lost."""
        sender, board = self._sender, self.board
        patience_ns = 0
        if self.state == DISORDER \
                and board.bytes[ARRIVED] < sender.params.duplicate_acks * MSS_BYTES:
            patience_ns = min(sender.least_rtt_ns >> 2, sender.srtt_ns)
        lost, wait_ns = board.overtaken(patience_ns, now_ns)
        if wait_ns:
            sender.watch.await_late(wait_ns + _LATE_TICKS * sender.params.tick_ns)
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
        room = sender.ssthresh - flying
        if room < 0:
            count = -(-sender.ssthresh * self._arrived // self._window) - self._sent
        else:
            count = max(self._arrived - self._sent, self._news)
            if advanced and not lost:
                count += MSS_BYTES
            count = min(room, count)
        sender.cwnd = flying + max(count, 0 if self._sent else MSS_BYTES)

    def _over(self) -> None:
        """All that had been sent when the loss was noticed is there."""
        if self.state == RECOVERY:
            self._sender.cwnd = self._sender.ssthresh
        self.state = DISORDER

    def _undone(self) -> None:
        """The timeout was false: the original arrived (Eifel, RFC 3522). Restore the window."""
        sender = self._sender
        window, threshold = self._before
        self.state = DISORDER
        self.board.find()
        sender.cwnd = max(sender.cwnd, window)
        sender.ssthresh = max(sender.ssthresh, threshold)
