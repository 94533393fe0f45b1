"""The clock of the programs: that of the system they run on, simulated or not."""

from __future__ import annotations

import select
import time

from desim.loop.alarm import Alarm
from desim.units import NS_PER_S


class ProgramClock:
    """The monotonic clock of the system since ``begin``, in ns. ``spare_ns``: how much earlier than
    asked it wakes from waiting, to look at the clock until the time has come."""

    def __init__(self, spare_ns: int) -> None:
        self._spare_ns = spare_ns
        self._alarm = Alarm()
        self._begin_ns = self._begin_unix_ns = 0

    def begin(self, every_ns: int) -> None:
        """Begin at the next whole multiple of ``every_ns`` on the system's clock, and wait for it:
        timers of Linux have ticks of their own, on which it would depend otherwise."""
        now_ns = time.monotonic_ns()
        self._begin_ns = -(-now_ns // every_ns) * every_ns
        time.sleep(max(-self.now_ns(), 0) / NS_PER_S)
        self._begin_unix_ns = time.time_ns() - self.now_ns()

    def now_ns(self) -> int:
        """The time since the beginning."""
        return time.monotonic_ns() - self._begin_ns

    def unix_ns(self, at_ns: int) -> int:
        """The time since 1970 at ``at_ns`` of this clock."""
        return self._begin_unix_ns + at_ns

    def wait(self, epoll: select.epoll, until_ns: int) -> None:
        """Wait until ``until_ns``, or until ``epoll`` has something."""
        early_ns = until_ns - self._spare_ns
        if early_ns > self.now_ns():
            self._alarm.set(self._begin_ns + early_ns)
            select.select([epoll, self._alarm.descriptor], [], [])
