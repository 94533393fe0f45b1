"""HyStart: slow start ends before a loss (Ha and Rhee 2011, as in Linux net/ipv4/tcp_cubic.c)."""

from __future__ import annotations

from desim.middleware.headers import MSS_BYTES

LOW_WINDOW_BYTES = 16 * MSS_BYTES  # hystart_low_window: below it slow start goes on
_SAMPLES = 8  # of a round (HYSTART_MIN_SAMPLES), before its least round trip tells
_LEAST_MORE_NS, _MOST_MORE_NS = 4_000_000, 16_000_000  # HYSTART_DELAY_MIN, HYSTART_DELAY_MAX
_GAP_NS = 2_000_000  # hystart_ack_delta_us: between the acknowledgements of one train
_SEND_NS = 1_000_000  # hystart_ack_delay, at most


class HyStart:
    """Watches round by round how long acknowledgements take while the window doubles: it is large
    enough when they take longer than in the best round, or arrive in one train for half of that."""

    __slots__ = ("_end", "_begin_ns", "_last_ns", "_least_ns", "_samples")

    def __init__(self) -> None:
        self._end = self._begin_ns = self._last_ns = self._least_ns = self._samples = 0

    def ends(self, una: int, acked: int, nxt: int, rtt_ns: int, min_rtt_ns: int, now_ns: int
             ) -> bool:
        """Whether the acknowledgement of ``acked`` bytes up to byte ``una`` with this round trip
        ends slow start; ``nxt`` is the next to be sent (hystart_update). That of a train stands for
        one for each two of its segments."""
        if una > self._end or not self._end:
            self._end, self._samples = nxt, 0
            self._begin_ns = self._last_ns = now_ns
            self._least_ns = rtt_ns
        if now_ns - self._last_ns <= _GAP_NS:
            self._last_ns = now_ns
            if 2 * (now_ns - self._begin_ns) > min_rtt_ns + _SEND_NS:
                return True
        self._least_ns = min(self._least_ns, rtt_ns)
        self._samples += acked // (2 * MSS_BYTES) or 1
        if self._samples <= _SAMPLES:
            return False
        more_ns = min(max(min_rtt_ns >> 3, _LEAST_MORE_NS), _MOST_MORE_NS)
        return self._least_ns > min_rtt_ns + more_ns
