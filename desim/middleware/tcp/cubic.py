"""CUBIC: how a window grows that was too large once (RFC 9438, as Linux net/ipv4/tcp_cubic.c)."""

from __future__ import annotations

from desim.middleware.transports import MSS_BYTES

_BETA = 717  # of 1024: what is left of a window after a loss (Linux tcp_cubic.c, beta)
_SCALE = 1024
_C_TENTHS = 4  # C = 0.4 segments / s^3 (bic_scale 41 / 1024 * 10)
_MS = 10**6  # ns


class Cubic:
    """What a window remembers of its last loss. Windows are in bytes; times in milliseconds, as
    finely as Linux looks at them."""

    __slots__ = ("_last_most", "_epoch_ms", "_origin", "_k_ms", "_reno", "_credit")

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """After a timeout (bictcp_reset)."""
        self._last_most = 0  # the window at the last loss
        self._epoch_ms = -1  # when it began to grow after it
        self._origin = self._k_ms = self._reno = self._credit = 0

    def less(self, window: int) -> int:
        """What is left of ``window`` after a loss; who lost before it had what it had leaves room
        for others (fast convergence)."""
        self._epoch_ms = -1
        self._last_most = (window * (_SCALE + _BETA) // (2 * _SCALE)
                           if window < self._last_most else window)
        return max(window * _BETA // _SCALE, 2 * MSS_BYTES)

    def rested(self, idle_ns: int) -> None:
        """Time in which nothing was sent does not count."""
        if self._epoch_ms >= 0:
            self._epoch_ms += idle_ns // _MS

    def more(self, window: int, acked: int, now_ns: int, rtt_ns: int) -> int:
        """By how much ``window`` grows as ``acked`` bytes of it have arrived."""
        now_ms = now_ns // _MS
        if self._epoch_ms < 0:
            self._epoch_ms = now_ms
            self._reno, self._credit = window, 0
            self._origin = max(self._last_most, window)
            self._k_ms = _root(max(self._last_most - window, 0) * 10**10
                               // (_C_TENTHS * MSS_BYTES))
        off_ms = now_ms - self._epoch_ms + rtt_ns // _MS - self._k_ms
        target = self._origin + _C_TENTHS * off_ms**3 * MSS_BYTES // 10**10
        # As much as Reno would have by now, with the same mean (RFC 9438, 4.3): 8 / 15 segments a
        # round trip.
        self._credit += acked
        gain = self._credit * 8 * MSS_BYTES // (15 * window)
        if gain:
            self._reno += gain
            self._credit -= gain * 15 * window // (8 * MSS_BYTES)
        target = max(target, self._reno)
        if target <= window:
            return acked // 100  # a hundredth of a segment for each
        if not self._last_most:
            target = max(target, window + window // 20)
        return min((target - window) * acked // window, acked // 2)


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
