"""The timing of a reader's requests for the same samples."""

from __future__ import annotations

Place = tuple[int, int]  # number of a sample, and of a fragment of it


class NackTiming:
    """The last request of a reader: its end and its time.

    As Cyclone DDS does it (src/core/ddsi/src/ddsi_acknack.c, get_acknack_info): new losses are
    requested at once; the same samples after NackDelay, or when a heartbeat for this reader alone
    shows that they were sent again, unless the last request was due to the delay.
    """

    def __init__(self) -> None:
        self._end: Place = (0, 0)
        self._asked_ns = 0
        self._by_delay = False
        self.directed = False  # since the last request there was a heartbeat for this reader alone

    def wait_ns(self, first: Place, now_ns: int, delay_ns: int) -> int:
        """The time until the reader may request samples from ``first`` on; 0: now."""
        if first >= self._end or (self.directed and not self._by_delay):
            return 0
        return max(0, self._asked_ns + delay_ns - now_ns)

    def asks(self, first: Place, end: Place, now_ns: int) -> None:
        """The reader requests samples from ``first`` up to before ``end``."""
        self._by_delay = first < self._end and not self.directed
        self._end, self._asked_ns, self.directed = end, now_ns, False
