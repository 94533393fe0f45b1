"""The clock of the programs: that of the system they run on, simulated or not."""

from __future__ import annotations

import select
import time

_US = 1000  # of select's timeout


class ProgramClock:
    """The monotonic clock since the first reading, in ns. ``spare_ns``: how much earlier than asked
    it wakes from waiting, to look at the clock until the time has come."""

    def __init__(self, spare_ns: int) -> None:
        self._spare_ns = spare_ns
        self._begin_ns = -1

    def now_ns(self) -> int:
        """The time since the first call."""
        if self._begin_ns < 0:
            self._begin_ns = time.monotonic_ns()
        return time.monotonic_ns() - self._begin_ns

    def wait(self, epoll: select.epoll, until_ns: int) -> None:
        """Wait until ``until_ns``, or until ``epoll`` has something."""
        wait_ns = until_ns - self.now_ns() - self._spare_ns
        if wait_ns > _US:
            select.select([epoll], [], [], wait_ns // _US / 1e6)
