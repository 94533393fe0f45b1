"""The repair of losses by a sender, from the first sign of one until all has arrived."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.headers import MSS_BYTES
from desim.middleware.tcp.parameters import TIMEOUT_MIN_NS
from desim.middleware.tcp.scoreboard import ARRIVED, LOST, Scoreboard

if TYPE_CHECKING:
    from desim.middleware.tcp.sender import Sender

# There are gaps, which may be disorder; they are losses and are repaired; the timer went off.
DISORDER, RECOVERY, LOSS = range(3)  # Linux tcp_ca_state



class Repair:
    """The loss recovery of one sender. Gaps are known by selective acknowledgements; a range is
    lost if a later one has arrived, at once if enough has arrived behind it, else a quarter of a
    round trip later (RACK, RFC 8985). During recovery the window shrinks in proportion to what
    arrives (PRR, RFC 6937); after a timeout it starts from one segment."""

    def __init__(self, sender: Sender, board: Scoreboard) -> None:
        self._sender = sender
        self.board = board
        self.state = DISORDER
        self._end = 0  # end of the bytes that had been sent when a loss was noticed (high_seq)
        self._news = 0  # bytes that the last acknowledgement was the first to cover
        self._window = 0  # when recovery began, and since then:
        self._arrived = self._sent = 0
        self._began_ns = 0
        self._before = 0, 0  # window and threshold
        self._unproven = -1  # of the bytes sent again, those without a copy seen (undo_retrans)
        self._frto = False  # the timeout may prove false (RFC 5682)
        self._new_first = False  # F-RTO sends new data, to see what comes of it

    def acknowledge(self, una: int, ranges: tuple[tuple[int, int], ...], now_ns: int) -> int:
        """Take an acknowledgement. Returns when the bytes were sent that show the round trip (-1:
        none do)."""
        self._news = self.board.acknowledge(una, ranges, now_ns, self._sender.least_rtt_ns,
                                            self._end)
        return self.board.measured_ns

    def react(self, advanced: bool, echo_ns: int, now_ns: int) -> None:
        """Act on the acknowledgement, after the sender has taken its ``una``."""
        sender, board = self._sender, self.board
        if self.state != DISORDER:
            if not self._unproven or advanced and 0 <= echo_ns < self._began_ns:
                self._undone()
            elif self.state == LOSS and self._frto:
                self._doubt(advanced)
            if sender.una >= self._end:
                self._over()
        lost = self._notice(now_ns)
        if self.state == RECOVERY:
            self._reduce(lost, advanced)
        elif advanced and self._news:
            sender.grow(self._news, True, now_ns)
        if self.state == DISORDER and not board.bytes[ARRIVED] and not board.bytes[LOST] \
                and not any(run.again for run in board.runs):
            sender.repair = None

    def copied(self, size_bytes: int) -> None:
        """The peer has had so many bytes twice."""
        if self._unproven > 0:
            self._unproven = max(self._unproven - size_bytes, 0)

    def give_up_late(self, now_ns: int) -> None:
        """The wait for late ranges is over: those that have not come are lost."""
        self._news = 0
        if self._notice(now_ns, True) and not self._sent:
            self._sender.cwnd = self.board.flying + MSS_BYTES
        self._sender.push()

    def time_out(self, now_ns: int, first: bool) -> None:
        """The timer went off, for the ``first`` time since something arrived or again: all bytes on
        their way are lost, but for the latest (Linux tcp_enter_loss)."""
        sender, board = self._sender, self.board
        self._frto = self.state == DISORDER or not first
        if self.state == DISORDER or sender.una >= self._end or self.state == LOSS and first:
            self._begin(now_ns)
        sender.forget()
        self.state = LOSS
        self._end = sender.nxt
        board.mark_lost(now_ns - max(board.newest_rtt_ns, sender.srtt_ns))
        sender.cwnd = board.flying + MSS_BYTES

    def push(self) -> None:
        """Send lost bytes again, as far as the window allows."""
        sender, board = self._sender, self.board
        if self._new_first:
            self._new_first = False
            return
        most = sender.constants.train * MSS_BYTES
        while (run := board.first_lost()) is not None:
            free = sender.cwnd - board.flying
            if free <= 0 or free < MSS_BYTES and board.flying:
                return
            end = min(run.end, run.start + min(max(free - free % MSS_BYTES, MSS_BYTES), most))
            board.send_again(run, end, sender.now_ns)
            self._sent += end - run.start
            self._unproven = max(self._unproven, 0) + end - run.start
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
        self._unproven = -1

    def _doubt(self, advanced: bool) -> None:
        """Find out whether the timeout was false (F-RTO, RFC 5682, 3.1; Linux tcp_process_loss)."""
        sender = self._sender
        if self.board.original:
            self._undone()
        elif sender.nxt > self._end:
            if not advanced or self.board.selected:
                self._frto = False
        elif advanced and sender.una < self._end:
            new = sender.written - sender.nxt
            self._frto = self._new_first = new >= MSS_BYTES or new > 0 and sender.small_may_go()

    def _notice(self, now_ns: int, late: bool = False) -> int:
        """Find lost bytes; wait for those that may be late. Returns the number of lost bytes.
        After a timeout recovery begins anew if they went again, or have been waited for."""
        sender, board = self._sender, self.board
        patience_ns = 0
        if self.state == DISORDER \
                and board.bytes[ARRIVED] < sender.constants.duplicate_acks * MSS_BYTES:
            patience_ns = min(sender.least_rtt_ns >> 2, sender.srtt_ns)
        lost, again, wait_ns = board.overtaken(patience_ns, now_ns)
        if wait_ns:
            sender.retransmission.await_late(wait_ns + TIMEOUT_MIN_NS)
        if lost and (self.state == DISORDER or self.state == LOSS and (again or late)):
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
        """Nothing was lost: what went again has arrived twice (RFC 3708), or the originals have
        (Eifel, RFC 3522; F-RTO). Restore the window."""
        sender = self._sender
        window, threshold = self._before
        self.state = DISORDER
        self.board.unmark_lost()
        sender.cwnd = max(sender.cwnd, window)
        sender.ssthresh = max(sender.ssthresh, threshold)
