"""CUBIC's window growth after a loss (RFC 9438, as in Linux net/ipv4/tcp_cubic.c)."""

from __future__ import annotations

_BETA = 717  # of 1024: what is left of a window after a loss
_SCALE = 1024
_C_TENTHS = 4  # C = 0.4 segments / s^3 (bic_scale)
_FRIENDLY_EIGHTHS = 8 * (_SCALE + _BETA) // 3 // (_SCALE - _BETA)  # beta_scale: 15
_MS = 10**6  # ns
_TICK_MS = 4  # Linux CONFIG_HZ=250
_FRESH_TICKS = 7  # HZ / 32: as long as the window stays, ``cnt`` does


class Cubic:
    """The decrease and growth of a window after its last loss, in segments. After each ``cnt``
    acknowledged segments it grows by one. Linux computes ``cnt`` anew at most every 28 ms while the
    window does not grow, which limits growth at short round trips. W_max and W_est are those of the
    RFC."""

    __slots__ = ("_cnt", "_w_max", "_last_cwnd", "_last_tick", "_epoch_ms", "_origin", "_k_ms",
                 "_ack_cnt", "_w_est", "_cwnd_cnt")

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start anew after a timeout (bictcp_reset)."""
        self._cnt = self._w_max = self._last_cwnd = self._cwnd_cnt = 0
        self._last_tick = self._epoch_ms = -1
        self._origin = self._k_ms = self._ack_cnt = self._w_est = 0

    def recalc_ssthresh(self, window: int) -> int:
        """The window after a loss at ``window``. If that was below the last maximum, the next one
        is lower still, which leaves room for other connections (fast convergence)."""
        self._epoch_ms = -1
        self._w_max = window * (_SCALE + _BETA) // (2 * _SCALE) if window < self._w_max else window
        return max(window * _BETA // _SCALE, 2)

    def shift_epoch(self, idle_ns: int) -> None:
        """Do not count a time in which nothing was sent."""
        if self._epoch_ms >= 0:
            self._epoch_ms += idle_ns // _MS

    def growth(self, window: int, acked: int, now_ns: int, rtt_ns: int) -> int:
        """The segments that ``window`` grows by as ``acked`` segments of it have arrived."""
        self._ack_cnt += acked
        tick = now_ns // _MS // _TICK_MS
        if window != self._last_cwnd or tick - self._last_tick > _FRESH_TICKS:
            if self._epoch_ms < 0 or tick != self._last_tick:
                self._last_cwnd, self._last_tick = window, tick
                self._update_cnt(window, acked, now_ns // _MS, rtt_ns)
            self._reno_friendly(window)
        cnt = self._cnt
        if self._cwnd_cnt >= cnt:
            self._cwnd_cnt = 0
            more = 1
        else:
            more = 0
        self._cwnd_cnt += acked
        if self._cwnd_cnt >= cnt:
            more += self._cwnd_cnt // cnt
            self._cwnd_cnt %= cnt
        return more

    def _update_cnt(self, window: int, acked: int, now_ms: int, rtt_ns: int) -> None:
        """Compute ``cnt`` from the curve (Linux bictcp_update)."""
        if self._epoch_ms < 0:
            self._epoch_ms = now_ms
            self._ack_cnt, self._w_est = acked, window
            self._origin = max(self._w_max, window)
            self._k_ms = _root((self._origin - window) * 10**10 // _C_TENTHS)
        rtt_ms = -(-rtt_ns // (_TICK_MS * _MS)) * _TICK_MS
        off_ms = now_ms - self._epoch_ms + rtt_ms - self._k_ms
        away = _C_TENTHS * abs(off_ms)**3 // 10**10  # in whole segments, below the origin as above
        target = self._origin + (away if off_ms > 0 else -away)
        self._cnt = window // (target - window) if target > window else 100 * window
        if not self._w_max:
            self._cnt = min(self._cnt, 20)

    def _reno_friendly(self, window: int) -> None:
        """Grow as fast as Reno would."""
        cnt = self._cnt
        each = window * _FRIENDLY_EIGHTHS >> 3  # as much as Reno's mean (RFC 9438, 4.3)
        if self._ack_cnt > each:
            grown = (self._ack_cnt - 1) // each
            self._ack_cnt -= grown * each
            self._w_est += grown
        if self._w_est > window:
            cnt = min(cnt, window // (self._w_est - window))
        self._cnt = max(cnt, 2)


def _root(cube: int) -> int:
    """The whole part of the cube root."""
    if cube <= 0:
        return 0
    root = 1 << -(-cube.bit_length() // 3)
    while True:
        better = (2 * root + cube // (root * root)) // 3
        if better >= root:
            return root
        root = better
