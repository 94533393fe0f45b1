"""CUBIC's window growth after a loss (RFC 9438, as in Linux net/ipv4/tcp_cubic.c)."""

from __future__ import annotations

_BETA = 717  # of 1024: what is left of a window after a loss
_SCALE = 1024
_C_TENTHS = 4  # C = 0.4 segments / s^3 (bic_scale)
_FRIENDLY_EIGHTHS = 8 * (_SCALE + _BETA) // 3 // (_SCALE - _BETA)  # beta_scale: 15
_MS = 10**6  # ns
_TICK_MS = 4  # Linux CONFIG_HZ=250
_FRESH_TICKS = 7  # HZ / 32: as long as the window stays, its pace does


class Cubic:
    """The decrease and growth of a window after its last loss, in segments. Its pace is the
    number of acknowledged segments for which it grows by one. Linux computes the pace anew at most
    every 28 ms while the window does not grow, which limits growth at short round trips."""

    __slots__ = ("_pace", "_most", "_seen", "_seen_tick", "_epoch_ms", "_origin", "_k_ms",
                 "_acked", "_reno", "_credit")

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Start anew after a timeout (bictcp_reset)."""
        self._pace = self._most = self._seen = self._credit = 0
        self._seen_tick = self._epoch_ms = -1
        self._origin = self._k_ms = self._acked = self._reno = 0

    def less(self, window: int) -> int:
        """The window after a loss at ``window``. If that was below the last maximum, the next one
        is lower still, which leaves room for other connections (fast convergence)."""
        self._epoch_ms = -1
        self._most = window * (_SCALE + _BETA) // (2 * _SCALE) if window < self._most else window
        return max(window * _BETA // _SCALE, 2)

    def rested(self, idle_ns: int) -> None:
        """Do not count a time in which nothing was sent."""
        if self._epoch_ms >= 0:
            self._epoch_ms += idle_ns // _MS

    def more(self, window: int, acked: int, now_ns: int, rtt_ns: int) -> int:
        """The segments that ``window`` grows by as ``acked`` segments of it have arrived."""
        self._acked += acked
        tick = now_ns // _MS // _TICK_MS
        if window != self._seen or tick - self._seen_tick > _FRESH_TICKS:
            if self._epoch_ms < 0 or tick != self._seen_tick:
                self._seen, self._seen_tick = window, tick
                self._set_pace(window, acked, now_ns // _MS, rtt_ns)
            self._befriend(window)
        pace = self._pace
        if self._credit >= pace:
            self._credit = 0
            more = 1
        else:
            more = 0
        self._credit += acked
        if self._credit >= pace:
            more += self._credit // pace
            self._credit %= pace
        return more

    def _set_pace(self, window: int, acked: int, now_ms: int, rtt_ns: int) -> None:
        """Compute the pace from the curve (Linux bictcp_update)."""
        if self._epoch_ms < 0:
            self._epoch_ms = now_ms
            self._acked, self._reno = acked, window
            self._origin = max(self._most, window)
            self._k_ms = _root((self._origin - window) * 10**10 // _C_TENTHS)
        rtt_ms = -(-rtt_ns // (_TICK_MS * _MS)) * _TICK_MS
        off_ms = now_ms - self._epoch_ms + rtt_ms - self._k_ms
        away = _C_TENTHS * abs(off_ms)**3 // 10**10  # in whole segments, below the origin as above
        target = self._origin + (away if off_ms > 0 else -away)
        self._pace = window // (target - window) if target > window else 100 * window
        if not self._most:
            self._pace = min(self._pace, 20)

    def _befriend(self, window: int) -> None:
        """Grow as fast as Reno would."""
        pace = self._pace
        each = window * _FRIENDLY_EIGHTHS >> 3  # as much as Reno's mean (RFC 9438, 4.3)
        if self._acked > each:
            grown = (self._acked - 1) // each
            self._acked -= grown * each
            self._reno += grown
        if self._reno > window:
            pace = min(pace, window // (self._reno - window))
        self._pace = max(pace, 2)


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
