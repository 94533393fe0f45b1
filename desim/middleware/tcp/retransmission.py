"""The retransmission timer of a sender: tail loss probe, timeout, giving up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.headers import MSS_BYTES
from desim.middleware.jiffies import fires_ns, whole_ticks
from desim.middleware.tcp.parameters import TIMEOUT_MIN_NS
from desim.middleware.tcp.repair import DISORDER
from desim.middleware.tcp.scoreboard import ARRIVED
from desim.middleware.timers import Timer, Timers

if TYPE_CHECKING:
    from desim.middleware.tcp.sender import Sender

# What the timer is for: to send again, to probe whether the end of what is on its way was lost, or
# to take for lost what may have been late.
AGAIN, PROBE, LATE = range(3)


class RetransmissionTimer:
    """One timer, as in Linux (icsk_retransmit_timer). First comes a probe (RFC 8985, tail loss
    probe), one a flight, then the timeout, which doubles.

    While nothing is lost, the timer is a plain timeout after the first unacknowledged byte was
    sent. Linux sets it for a probe instead, and each acknowledgement moves it on; but the model has
    one acknowledgement for a train. So the probe is set only after a loss in the network
    (``hide``): a false probe, where nothing was lost, is left out.

    ``uneasy``: a loss has happened (known or not) or a timer is aimed, and there was no progress
    since. Only then does the sender call this object with each message that it sends.
    """

    __slots__ = ("timer", "uneasy", "_sender", "_constants", "_backoff", "_silent_ns", "_probed",
                 "_doubtful", "_hidden", "_aim", "_aim_ns")

    def __init__(self, sender: Sender, timers: Timers, entity: int) -> None:
        self.timer = Timer(timers, entity, self._expired)
        self.uneasy = False
        self._sender = sender
        self._constants = sender.constants
        self._backoff = 0  # doublings of the timeout
        self._silent_ns = -1  # when it went off first, without an answer since
        self._probed = 0  # what had been sent when a probe went that was not answered (0: none)
        self._doubtful = False  # it was an old segment
        self._hidden = 0  # up to there the network has lost data, or their acknowledgement
        self._aim, self._aim_ns = AGAIN, -1  # of the timer, if it goes off then

    def hide(self, end: int) -> None:
        """The network has lost data before ``end``, or their acknowledgement. The sender does not
        know."""
        sender = self._sender
        if end > sender.una and sender.open:
            self.uneasy = True
            self._hidden = max(self._hidden, end)
            if not self._probed:
                self._probe_soon(sender.sent_ns)

    def advanced(self, number: int, now_ns: int) -> None:
        """All before ``number`` was acknowledged, for the first time."""
        self._backoff = 0
        self._silent_ns = -1
        if self._probed and number >= self._probed:
            self._end_probe(number)
        if self._hidden > number and not self._probed:
            self._probe_soon(now_ns)
        elif not self._probed:
            self.uneasy = False

    def postpone(self) -> None:
        """New bytes go behind a probe that was not answered: Linux then waits as if for another
        one, which it does not send."""
        if self._probed:
            self._probe_soon(self._sender.now_ns)

    def copied(self, start: int, end: int) -> None:
        """The peer has had these bytes twice (D-SACK, RFC 3708): where they were a probe, nothing
        had been lost (Linux FLAG_DSACK_TLP)."""
        if end == self._probed:
            self._probed = 0
        if self._sender.repair is not None:
            self._sender.repair.copied(end - start)

    def unresolved(self, start: int) -> None:
        """Data from ``start`` on could not leave for lack of an address. That is no sign of
        congestion: take one doubling of the timeout back (RFC 6069, Linux tcp_ld_RTO_revert)."""
        sender = self._sender
        if start != sender.una or not self._backoff or not sender.open:
            return
        self._backoff -= 1
        now_ns = sender.now_ns
        left_ns = sender.head_ns + self._patience_ns() - now_ns
        if left_ns > 0:
            self._aim_at(AGAIN, left_ns)
        else:
            self._time_out(now_ns)

    def restart(self) -> None:
        """The first bytes went again: the timeout runs from now on."""
        self._aim_at(AGAIN, self._patience_ns())

    def await_late(self, delay_ns: int) -> None:
        """Wait for late ranges before they count as lost."""
        self._aim_at(LATE, delay_ns)

    def _probe_soon(self, since_ns: int) -> None:
        """Linux tcp_schedule_loss_probe: two round trips after what was sent or heard last, and no
        later than the timeout."""
        sender, constants = self._sender, self._constants
        if sender.srtt_ns < 0 or not self._orderly():
            return
        delay_ns = 2 * sender.srtt_ns + (
            constants.rto_min_ns if sender.nxt - sender.una <= MSS_BYTES else TIMEOUT_MIN_NS)
        left_ns = self._left_ns(since_ns)
        self._aim_at(PROBE, left_ns if 0 < left_ns < delay_ns else delay_ns, since_ns)

    def _left_ns(self, since_ns: int) -> int:
        """The time until the timeout of the first bytes (Linux tcp_rto_delta_us)."""
        sender = self._sender
        return sender.head_ns + whole_ticks(sender.rto_ns, self._constants.tick_ns) - since_ns

    def _orderly(self) -> bool:
        """Whether nothing is known to be missing (Linux TCP_CA_Open)."""
        repair = self._sender.repair
        return repair is None or repair.state == DISORDER and not repair.board.bytes[ARRIVED]

    def _patience_ns(self) -> int:
        """The timeout, as often as it was doubled."""
        constants = self._constants
        most_ns: int = constants.rto_max_ns
        return min(whole_ticks(self._sender.rto_ns, constants.tick_ns) << self._backoff,
                   most_ns)

    def _aim_at(self, what: int, delay_ns: int, since_ns: int | None = None) -> None:
        """Set the timer."""
        now_ns = self._sender.now_ns
        self.uneasy = True
        self._aim = what
        self._aim_ns = max(now_ns, fires_ns(now_ns if since_ns is None else since_ns, delay_ns,
                                            self._constants.tick_ns))
        self.timer.expect(self._aim_ns)

    def _expired(self) -> None:
        """The timer. Where it was set in passing, it has yet to be seen when Linux's would go
        off."""
        sender = self._sender
        now_ns = sender.now_ns
        if now_ns != self._aim_ns:
            self._aim_at(AGAIN, sender.rto_ns, now_ns - sender.rto_ns)
            if self._aim_ns > now_ns:
                return
        if self._aim == LATE and sender.repair is not None:
            self.timer.expect(now_ns + sender.rto_ns)
            sender.repair.give_up_late(now_ns)
        elif self._aim == PROBE and self._probed:
            self._aim_at(AGAIN, max(self._left_ns(now_ns), 1))
        elif not self._probed and not self._backoff and sender.srtt_ns >= 0 and self._orderly():
            self._doubtful = not sender.probe()
            self._probed = sender.nxt
            self.restart()
        else:
            self._time_out(now_ns)

    def _end_probe(self, number: int) -> None:
        """The end of a probe (Linux tcp_process_tlp_ack). A segment that went again and was not
        answered twice had been lost, which is as if the window had been too large."""
        sender = self._sender
        if not self._doubtful:
            self._probed = 0
        elif number > self._probed:
            self._probed = 0
            sender.less(0)
            sender.cwnd = sender.ssthresh

    def _time_out(self, now_ns: int) -> None:
        """The retransmission timeout: double it, and send the first segment again."""
        sender = self._sender
        first = self._silent_ns < 0
        if first:
            self._silent_ns = now_ns
        elif now_ns - self._silent_ns >= self._constants.silence_ns:
            sender.end.fail("timeout")
            return
        repair = sender.repair or sender.begin_repair()
        repair.time_out(now_ns, first)
        self._backoff += 1
        sender.push()
