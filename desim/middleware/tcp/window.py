"""How much may be on its way, and how long to wait for an answer."""

from __future__ import annotations

from desim.middleware.tcp.parameters import TcpParams
from desim.middleware.transports import MSS_BYTES


class Window:
    """Congestion control of RFC 5681, in bytes, and the timeout of RFC 6298; Linux adds that only a
    window that is used grows. ``room_bytes``: the send buffer, which grows with the window."""

    __slots__ = ("params", "cwnd", "ssthresh", "rto_ns", "room_bytes", "initial", "srtt_ns",
                 "rttvar_ns", "_least_ns", "_most_ns", "near")

    def __init__(self, params: TcpParams) -> None:
        self.params = params
        self.cwnd = self.initial = params.initial_window * MSS_BYTES
        self.ssthresh = params.window_bytes
        self.rto_ns = params.first_rto_ns
        self.room_bytes = 2 * self.cwnd
        self.srtt_ns = -1  # no round trip has been measured
        self.rttvar_ns = 0
        self._least_ns, self._most_ns = params.rto_min_ns, params.rto_max_ns
        self.near = False  # the first round trip was below ``near_ns``, and nothing was lost since

    def sample(self, rtt_ns: int) -> None:
        """A measured round trip moves the timeout: SRTT + 4 RTTVAR, within its bounds."""
        srtt_ns, rttvar_ns = self.srtt_ns, self.rttvar_ns
        if srtt_ns < 0:
            self.near = rtt_ns < self.params.near_ns
            srtt_ns = rtt_ns
            rttvar_ns = rtt_ns >> 1
        else:
            off_ns = rtt_ns - srtt_ns
            srtt_ns += off_ns >> 3
            rttvar_ns += ((off_ns if off_ns > 0 else -off_ns) - rttvar_ns) >> 2
        self.srtt_ns = srtt_ns
        self.rttvar_ns = rttvar_ns
        rto_ns = srtt_ns + 4 * rttvar_ns
        if rto_ns < self._least_ns:
            rto_ns = self._least_ns
        elif rto_ns > self._most_ns:
            rto_ns = self._most_ns
        self.rto_ns = rto_ns

    def grow(self, acked: int, flying: int) -> None:
        """``acked`` bytes of ``flying`` arrived: in slow start the window grows by as many, later
        by a segment a round trip, if it was used but for what waits to be worth a train."""
        if self.cwnd < self.ssthresh:
            self.cwnd += acked
        elif flying + max(MSS_BYTES, min(self.burst_bytes(), self.cwnd // 3)) > self.cwnd:
            self.cwnd += max(MSS_BYTES * acked // self.cwnd, 1)
        self.room_bytes = min(max(self.room_bytes, 2 * self.cwnd), self.params.buffer_bytes)

    def burst_bytes(self) -> int:
        """What goes as one train: as much as ``burst_ns`` brings at twice the window a round trip,
        two full segments at least."""
        params = self.params
        segments = 2 * self.cwnd * params.burst_ns // (max(self.srtt_ns, 1) * MSS_BYTES)
        return min(max(segments, 2), params.train) * MSS_BYTES

    def halve(self, flying: int) -> None:
        """A loss shows that ``flying`` bytes were too many."""
        self.near = False
        self.cwnd = self.ssthresh = max(flying // 2, 2 * MSS_BYTES)

    def rest(self, idle_ns: int) -> None:
        """Nothing was sent for longer than a timeout: it halves for each (RFC 2861)."""
        self.ssthresh = max(self.ssthresh, self.cwnd * 3 // 4)
        self.cwnd = max(self.cwnd >> min(idle_ns // self.rto_ns, 40), self.initial)
