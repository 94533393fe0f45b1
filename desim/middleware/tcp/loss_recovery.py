"""The loss recovery of a sender, from the first sign of a loss until all has arrived."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.headers import MSS_BYTES
from desim.middleware.tcp.parameters import TIMEOUT_MIN_NS
from desim.middleware.tcp.scoreboard import LOST, SACKED, Scoreboard

if TYPE_CHECKING:
    from desim.middleware.tcp.sender import Sender

# There are gaps, which may be disorder; they are losses and are repaired; the timer went off.
DISORDER, RECOVERY, LOSS = range(3)  # Linux tcp_ca_state


class LossRecovery:
    """The loss recovery of one sender. Gaps are known by selective acknowledgements; a range is
    lost if a later one has arrived, at once if enough has arrived behind it, else a quarter of a
    round trip later (RACK, RFC 8985). During recovery the window shrinks in proportion to what
    arrives (PRR, RFC 6937); after a timeout it starts from one segment."""

    def __init__(self, sender: Sender, board: Scoreboard) -> None:
        self._sender = sender
        self.board = board
        self.state = DISORDER
        self._recovery_point = 0  # what had been sent when a loss was noticed (Linux high_seq)
        self._newly_acked = 0  # bytes that the last acknowledgement was the first to cover
        self._prior_cwnd = 0  # when recovery began, and since then:
        self._prr_delivered = self._prr_out = 0
        self._retrans_stamp_ns = 0  # when the window was reduced
        self._undo = 0, 0  # cwnd and ssthresh before
        self._undo_retrans = -1  # of the bytes sent again, those without a copy seen
        self._frto = False  # the timeout may prove false (RFC 5682)
        self._frto_new_data = False  # F-RTO sends new data, to see what comes of it

    def acknowledge(self, una: int, ranges: tuple[tuple[int, int], ...], now_ns: int) -> int:
        """Take an acknowledgement. Returns when the bytes were sent that show the round trip (-1:
        none do)."""
        self._newly_acked = self.board.acknowledge(
            una, ranges, now_ns, self._sender.min_rtt_ns, self._recovery_point)
        return self.board.measured_ns

    def react(self, advanced: bool, echo_ns: int, now_ns: int) -> None:
        """Act on the acknowledgement, after the sender has taken its number."""
        sender, board = self._sender, self.board
        if self.state != DISORDER:
            if not self._undo_retrans or advanced and 0 <= echo_ns < self._retrans_stamp_ns:
                self._undo_reduction()
            elif self.state == LOSS and self._frto:
                self._process_frto(advanced)
            if sender.snd_una >= self._recovery_point:
                self._complete()
        lost = self._detect_losses(now_ns)
        if self.state == RECOVERY:
            self._reduce_cwnd(lost, advanced)
        elif advanced and self._newly_acked:
            sender.grow(self._newly_acked, True, now_ns)
        if self.state == DISORDER and not board.bytes[SACKED] and not board.bytes[LOST] \
                and not any(run.retransmitted for run in board.runs):
            sender.recovery = None

    def dsacked(self, size_bytes: int) -> None:
        """The peer has had so many bytes twice."""
        if self._undo_retrans > 0:
            self._undo_retrans = max(self._undo_retrans - size_bytes, 0)

    def reordering_timed_out(self, now_ns: int) -> None:
        """The wait for late ranges is over: those that have not come are lost."""
        self._newly_acked = 0
        if self._detect_losses(now_ns, True) and not self._prr_out:
            self._sender.cwnd = self.board.in_flight + MSS_BYTES
        self._sender.push()

    def enter_loss(self, now_ns: int, first: bool) -> None:
        """The timer went off, for the ``first`` time since something arrived or again: all bytes on
        their way are lost, but for the latest (Linux tcp_enter_loss)."""
        sender, board = self._sender, self.board
        self._frto = self.state == DISORDER or not first
        if self.state == DISORDER or sender.snd_una >= self._recovery_point \
                or self.state == LOSS and first:
            self._reduce_window(now_ns)
        sender.reset_growth()
        self.state = LOSS
        self._recovery_point = sender.snd_nxt
        board.mark_lost(now_ns - max(board.rack_rtt_ns, sender.srtt_ns))
        sender.cwnd = board.in_flight + MSS_BYTES

    def push(self) -> None:
        """Send lost bytes again, as far as the window allows."""
        sender, board = self._sender, self.board
        if self._frto_new_data:
            self._frto_new_data = False
            return
        most = sender.constants.train * MSS_BYTES
        while (run := board.first_lost()) is not None:
            free = sender.cwnd - board.in_flight
            if free <= 0 or free < MSS_BYTES and board.in_flight:
                return
            end = min(run.end, run.start + min(max(free - free % MSS_BYTES, MSS_BYTES), most))
            board.send_again(run, end, sender.now_ns)
            self._prr_out += end - run.start
            self._undo_retrans = max(self._undo_retrans, 0) + end - run.start
            sender.send_again(run.start, end)

    def sent(self, start: int, end: int, now_ns: int) -> None:
        """New bytes have left."""
        self.board.send(start, end, now_ns)
        self._prr_out += end - start

    def _reduce_window(self, now_ns: int) -> None:
        """A loss was noticed."""
        sender = self._sender
        self._undo = sender.cwnd, sender.ssthresh
        self._retrans_stamp_ns = now_ns
        in_flight = sender.snd_nxt - sender.snd_una
        self._prior_cwnd = max(sender.cwnd, in_flight) if sender.near else sender.cwnd
        sender.reduce_ssthresh(in_flight)
        self._recovery_point = sender.snd_nxt
        self._prr_delivered = self._prr_out = 0
        self._undo_retrans = -1

    def _process_frto(self, advanced: bool) -> None:
        """Find out whether the timeout was false (F-RTO, RFC 5682, 3.1; Linux tcp_process_loss)."""
        sender = self._sender
        if self.board.original:
            self._undo_reduction()
        elif sender.snd_nxt > self._recovery_point:
            if not advanced or self.board.newly_sacked:
                self._frto = False
        elif advanced and sender.snd_una < self._recovery_point:
            new = sender.write_seq - sender.snd_nxt
            self._frto = self._frto_new_data = new >= MSS_BYTES or new > 0 and sender.small_may_go()

    def _detect_losses(self, now_ns: int, late: bool = False) -> int:
        """Find lost bytes; wait for those that may be late. Returns the number of lost bytes.
        After a timeout recovery begins anew if they went again, or have been waited for."""
        sender, board = self._sender, self.board
        patience_ns = 0
        if self.state == DISORDER \
                and board.bytes[SACKED] < sender.constants.duplicate_acks * MSS_BYTES:
            patience_ns = min(sender.min_rtt_ns >> 2, sender.srtt_ns)
        lost, again, wait_ns = board.detect_losses(patience_ns, now_ns)
        if wait_ns:
            sender.retransmission.await_reordering(wait_ns + TIMEOUT_MIN_NS)
        if lost and (self.state == DISORDER or self.state == LOSS and (again or late)):
            self._reduce_window(now_ns)
            self.state = RECOVERY
        return lost

    def _reduce_cwnd(self, lost: int, advanced: bool) -> None:
        """Proportional rate reduction (RFC 6937, as Linux tcp_cwnd_reduction)."""
        if not self._newly_acked:
            return
        sender, in_flight = self._sender, self.board.in_flight
        self._prr_delivered += self._newly_acked
        free = sender.ssthresh - in_flight
        if free < 0:
            count = -(-sender.ssthresh * self._prr_delivered // self._prior_cwnd) - self._prr_out
        else:
            count = max(self._prr_delivered - self._prr_out, self._newly_acked)
            if advanced and not lost:
                count += MSS_BYTES
            count = min(free, count)
        sender.cwnd = in_flight + max(count, 0 if self._prr_out else MSS_BYTES)

    def _complete(self) -> None:
        """All bytes that had been sent when the loss was noticed have arrived."""
        if self.state == RECOVERY:
            self._sender.cwnd = self._sender.ssthresh
        self.state = DISORDER

    def _undo_reduction(self) -> None:
        """Nothing was lost: what went again has arrived twice (RFC 3708), or the originals have
        (Eifel, RFC 3522; F-RTO). Restore the window."""
        sender = self._sender
        cwnd, ssthresh = self._undo
        self.state = DISORDER
        self.board.unmark_lost()
        sender.cwnd = max(sender.cwnd, cwnd)
        sender.ssthresh = max(sender.ssthresh, ssthresh)
