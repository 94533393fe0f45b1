"""The congestion window, the round trip and the timeout of a sender."""

from __future__ import annotations

from desim.middleware.headers import MSS_BYTES
from desim.middleware.tcp.cubic import Cubic
from desim.middleware.tcp.hystart import HyStart
from desim.middleware.tcp.parameters import TcpConstants
from desim.units import NEVER_NS


class CongestionWindow:
    """Congestion control of RFC 5681 with CUBIC's growth, in bytes, and Linux's timeout; only a
    window that is used grows. ``sndbuf_bytes``: the send buffer, which grows with the window."""

    __slots__ = ("constants", "cwnd", "ssthresh", "rto_ns", "sndbuf_bytes", "initial_cwnd",
                 "srtt_ns", "min_rtt_ns", "near", "_cubic", "_hystart", "_hystart_ended",
                 "_mdev_ns", "_mdev_max_ns", "_rttvar_ns", "_rtt_round_ns", "_rto_min_ns",
                 "_rto_max_ns")

    def __init__(self, constants: TcpConstants) -> None:
        self.constants = constants
        self.cwnd = self.initial_cwnd = constants.initial_window * MSS_BYTES
        self.ssthresh = constants.window_bytes
        self.rto_ns: int = constants.first_rto_ns
        self.sndbuf_bytes: int = 2 * constants.initial_window * constants.segment_bytes
        self.srtt_ns = -1  # no round trip has been measured
        self.min_rtt_ns = NEVER_NS
        self.near = False  # the first round trip was below ``near_ns``, and nothing was lost since
        self._cubic = Cubic()
        self._hystart: HyStart | None = None
        self._hystart_ended = False  # it has ended slow start
        self._mdev_ns = 0  # four times the mean one
        self._mdev_max_ns = 0  # the greatest of it in this round trip, the least timeout at least
        self._rttvar_ns = 0  # smoothed: what the timeout adds to the round trip
        self._rtt_round_ns = 0  # what is sent from then on is of the next round trip
        self._rto_min_ns, self._rto_max_ns = constants.rto_min_ns, constants.rto_max_ns

    def sample(self, rtt_ns: int, now_ns: int) -> None:
        """A round trip was measured: SRTT + max(200 ms, 4 RTTVAR), where the variance rises at once
        and falls by a quarter of the way a round trip (Linux tcp_input.c tcp_rtt_estimator, tcp.h
        __tcp_set_rto)."""
        srtt_ns = self.srtt_ns
        if rtt_ns < self.min_rtt_ns:
            self.min_rtt_ns = rtt_ns
        if srtt_ns < 0:
            self.near = rtt_ns < self.constants.near_ns
            self.srtt_ns = srtt_ns = rtt_ns
            self._mdev_ns = 2 * rtt_ns
            self._mdev_max_ns = self._rttvar_ns = max(2 * rtt_ns, self._rto_min_ns)
            self._rtt_round_ns = now_ns
        else:
            off_ns = rtt_ns - srtt_ns
            self.srtt_ns = srtt_ns = srtt_ns + (off_ns >> 3)
            mdev_ns = self._mdev_ns
            if off_ns < 0:
                off_ns = -off_ns - (mdev_ns >> 2)
                if off_ns > 0:  # a shorter round trip is no reason to wait longer
                    off_ns >>= 3
            else:
                off_ns -= mdev_ns >> 2
            self._mdev_ns = mdev_ns = mdev_ns + off_ns
            if mdev_ns > self._mdev_max_ns:
                self._mdev_max_ns = mdev_ns
                if mdev_ns > self._rttvar_ns:
                    self._rttvar_ns = mdev_ns
            if now_ns - rtt_ns >= self._rtt_round_ns:
                if self._mdev_max_ns < self._rttvar_ns:
                    self._rttvar_ns -= (self._rttvar_ns - self._mdev_max_ns) >> 2
                self._rtt_round_ns = now_ns
                self._mdev_max_ns = self._rto_min_ns
        rto_ns = srtt_ns + self._rttvar_ns
        self.rto_ns = rto_ns if rto_ns < self._rto_max_ns else self._rto_max_ns

    def grow(self, acked: int, limited: bool, now_ns: int) -> None:
        """``acked`` bytes arrived. In slow start the window grows by their segments up to the
        threshold; beyond it, where the window has ``limited`` the sender, as CUBIC says (Linux
        cubictcp_cong_avoid)."""
        segments, cwnd = -(-acked // MSS_BYTES), self.cwnd
        if cwnd < self.ssthresh:
            self.cwnd = min(cwnd + segments * MSS_BYTES, self.ssthresh)
            segments -= (self.cwnd - cwnd) // MSS_BYTES
        if limited and segments:
            self.cwnd += MSS_BYTES * self._cubic.growth(
                self.cwnd // MSS_BYTES or 1, segments, now_ns, self.min_rtt_ns)
        constants = self.constants
        self.sndbuf_bytes = min(max(self.sndbuf_bytes, 2 * self.cwnd // MSS_BYTES
                                    * constants.segment_bytes), constants.buffer_bytes)

    def hystart_update(self, una: int, acked: int, nxt: int, rtt_ns: int, now_ns: int) -> None:
        """In slow start an acknowledgement came, as ``HyStart.ends`` takes it: that may end it."""
        if self._hystart_ended or self.near:
            return
        if self._hystart is None:
            self._hystart = HyStart()
        if self._hystart.ends(una, acked, nxt, rtt_ns, self.min_rtt_ns, now_ns):
            self.ssthresh, self._hystart_ended = self.cwnd, True

    def burst_bytes(self) -> int:
        """The size of one train: the bytes that ``burst_ns`` brings at twice the window per round
        trip, two full segments at least."""
        constants = self.constants
        segments: int = 2 * self.cwnd * constants.burst_ns // (max(self.srtt_ns, 1) * MSS_BYTES)
        return min(max(segments, 2), constants.train) * MSS_BYTES

    def reduce_ssthresh(self, in_flight: int) -> None:
        """A loss shows that the window was too large. A near host was sent ``in_flight`` bytes."""
        used = max(self.cwnd, in_flight) if self.near else self.cwnd
        self.near = False
        self.ssthresh = self._cubic.recalc_ssthresh(used // MSS_BYTES) * MSS_BYTES

    def reset_growth(self) -> None:
        """Forget the last loss, after a timeout."""
        self._cubic.reset()
        self._hystart, self._hystart_ended = None, False

    def restart_after_idle(self, idle_ns: int) -> None:
        """Nothing was sent for ``idle_ns``: the window halves for each timeout (RFC 2861)."""
        self._cubic.shift_epoch(idle_ns)
        if idle_ns > self.rto_ns and self.cwnd > self.initial_cwnd:
            self.ssthresh = max(self.ssthresh, self.cwnd * 3 // 4)
            self.cwnd = max(self.cwnd >> min(idle_ns // self.rto_ns, 40), self.initial_cwnd)
