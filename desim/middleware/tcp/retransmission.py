"""The retransmission timer of a sender: tail loss probe, timeout, giving up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.headers import MSS_BYTES
from desim.middleware.jiffies import fires_ns, whole_ticks
from desim.middleware.tcp.loss_recovery import DISORDER
from desim.middleware.tcp.parameters import TIMEOUT_MIN_NS
from desim.middleware.tcp.scoreboard import SACKED
from desim.middleware.timers import Timer, Timers

if TYPE_CHECKING:
    from desim.middleware.tcp.sender import Sender

# What the timer is for: to send again, to probe whether the end of what is on its way was lost, or
# to take for lost what may have been late.
RETRANSMIT, LOSS_PROBE, REORDERING = range(3)


class RetransmissionTimer:
    """One timer, as in Linux (icsk_retransmit_timer). First comes a probe (RFC 8985, tail loss
    probe), one a flight, then the timeout, which doubles.

    While nothing is lost, the timer is a plain timeout after the first unacknowledged byte was
    sent. Linux sets it for a probe instead, and each acknowledgement moves it on; but the model has
    one acknowledgement for a train. So the probe is set only after a loss in the network
    (``lost_unnoticed``): a false probe, where nothing was lost, is left out.

    ``armed``: a loss has happened (known or not) or the timer was set by it, and there was no
    progress since. Only then does the sender call this object with each message that it sends.
    """

    __slots__ = ("timer", "armed", "_sender", "_constants", "_backoff", "_retrans_stamp_ns",
                 "_tlp_high_seq", "_tlp_retrans", "_unnoticed_end", "_pending", "_due_ns")

    def __init__(self, sender: Sender, timers: Timers, entity: int) -> None:
        self.timer = Timer(timers, entity, self._expired)
        self.armed = False
        self._sender = sender
        self._constants = sender.constants
        self._backoff = 0  # doublings of the timeout
        self._retrans_stamp_ns = -1  # when it went off first, without an answer since
        self._tlp_high_seq = 0  # what had been sent when an unanswered probe went (0: none)
        self._tlp_retrans = False  # the probe was an old segment
        self._unnoticed_end = 0  # up to there the network has lost data, or their acknowledgement
        self._pending, self._due_ns = RETRANSMIT, -1  # what it is for, if it goes off then

    def lost_unnoticed(self, end: int) -> None:
        """The network has lost data before ``end``, or their acknowledgement. The sender does not
        know."""
        sender = self._sender
        if end > sender.snd_una and sender.open:
            self.armed = True
            self._unnoticed_end = max(self._unnoticed_end, end)
            if not self._tlp_high_seq:
                self._schedule_probe(sender.sent_ns)

    def una_advanced(self, number: int, now_ns: int) -> None:
        """All before ``number`` was acknowledged, for the first time."""
        self._backoff = 0
        self._retrans_stamp_ns = -1
        if self._tlp_high_seq and number >= self._tlp_high_seq:
            self._process_tlp_ack(number)
        if self._unnoticed_end > number and not self._tlp_high_seq:
            self._schedule_probe(now_ns)
        elif not self._tlp_high_seq:
            self.armed = False

    def rearm_probe(self) -> None:
        """New bytes go behind a probe that was not answered: Linux then waits as if for another
        one, which it does not send."""
        if self._tlp_high_seq:
            self._schedule_probe(self._sender.now_ns)

    def dsacked(self, start: int, end: int) -> None:
        """The peer has had these bytes twice (D-SACK, RFC 3708): where they were a probe, nothing
        had been lost (Linux FLAG_DSACK_TLP)."""
        if end == self._tlp_high_seq:
            self._tlp_high_seq = 0
        if self._sender.recovery is not None:
            self._sender.recovery.dsacked(end - start)

    def unresolved(self, start: int) -> None:
        """Data from ``start`` on could not leave for lack of an address. That is no sign of
        congestion: take one doubling of the timeout back (RFC 6069, Linux tcp_ld_RTO_revert)."""
        sender = self._sender
        if start != sender.snd_una or not self._backoff or not sender.open:
            return
        self._backoff -= 1
        now_ns = sender.now_ns
        left_ns = sender.head_ns + self._backed_off_rto_ns() - now_ns
        if left_ns > 0:
            self._set(RETRANSMIT, left_ns)
        else:
            self._time_out(now_ns)

    def restart(self) -> None:
        """The first bytes went again: the timeout runs from now on."""
        self._set(RETRANSMIT, self._backed_off_rto_ns())

    def await_reordering(self, delay_ns: int) -> None:
        """Wait for late ranges before they count as lost."""
        self._set(REORDERING, delay_ns)

    def _schedule_probe(self, since_ns: int) -> None:
        """Linux tcp_schedule_loss_probe: two round trips after what was sent or heard last, and no
        later than the timeout."""
        sender, constants = self._sender, self._constants
        if sender.srtt_ns < 0 or not self._is_open():
            return
        in_flight = sender.snd_nxt - sender.snd_una
        delay_ns = 2 * sender.srtt_ns + (
            constants.rto_min_ns if in_flight <= MSS_BYTES else TIMEOUT_MIN_NS)
        left_ns = self._rto_delta_ns(since_ns)
        self._set(LOSS_PROBE, left_ns if 0 < left_ns < delay_ns else delay_ns, since_ns)

    def _rto_delta_ns(self, since_ns: int) -> int:
        """The time until the timeout of the first bytes (Linux tcp_rto_delta_us)."""
        sender = self._sender
        return sender.head_ns + whole_ticks(sender.rto_ns, self._constants.tick_ns) - since_ns

    def _is_open(self) -> bool:
        """Whether nothing is known to be missing (Linux TCP_CA_Open)."""
        recovery = self._sender.recovery
        return recovery is None or recovery.state == DISORDER and not recovery.board.bytes[SACKED]

    def _backed_off_rto_ns(self) -> int:
        """The timeout, as often as it was doubled."""
        constants = self._constants
        most_ns: int = constants.rto_max_ns
        return min(whole_ticks(self._sender.rto_ns, constants.tick_ns) << self._backoff,
                   most_ns)

    def _set(self, what: int, delay_ns: int, since_ns: int | None = None) -> None:
        """Set the timer."""
        now_ns = self._sender.now_ns
        self.armed = True
        self._pending = what
        self._due_ns = max(now_ns, fires_ns(now_ns if since_ns is None else since_ns, delay_ns,
                                            self._constants.tick_ns))
        self.timer.expect(self._due_ns)

    def _expired(self) -> None:
        """The timer. Where it was set in passing, it has yet to be seen when Linux's would go
        off."""
        sender = self._sender
        now_ns = sender.now_ns
        if now_ns != self._due_ns:
            self._set(RETRANSMIT, sender.rto_ns, now_ns - sender.rto_ns)
            if self._due_ns > now_ns:
                return
        if self._pending == REORDERING and sender.recovery is not None:
            self.timer.expect(now_ns + sender.rto_ns)
            sender.recovery.reordering_timed_out(now_ns)
        elif self._pending == LOSS_PROBE and self._tlp_high_seq:
            self._set(RETRANSMIT, max(self._rto_delta_ns(now_ns), 1))
        elif not self._tlp_high_seq and not self._backoff and sender.srtt_ns >= 0 \
                and self._is_open():
            self._tlp_retrans = not sender.probe()
            self._tlp_high_seq = sender.snd_nxt
            self.restart()
        else:
            self._time_out(now_ns)

    def _process_tlp_ack(self, number: int) -> None:
        """The end of a probe (Linux tcp_process_tlp_ack). A segment that went again and was not
        answered twice had been lost, which is as if the window had been too large."""
        sender = self._sender
        if not self._tlp_retrans:
            self._tlp_high_seq = 0
        elif number > self._tlp_high_seq:
            self._tlp_high_seq = 0
            sender.reduce_ssthresh(0)
            sender.cwnd = sender.ssthresh

    def _time_out(self, now_ns: int) -> None:
        """The retransmission timeout: double it, and send the first segment again."""
        sender = self._sender
        first = self._retrans_stamp_ns < 0
        if first:
            self._retrans_stamp_ns = now_ns
        elif now_ns - self._retrans_stamp_ns >= self._constants.silence_ns:
            sender.end.fail("timeout")
            return
        recovery = sender.recovery or sender.begin_recovery()
        recovery.enter_loss(now_ns, first)
        self._backoff += 1
        sender.push()
