"""The idle worker threads of a rosmaster: each polls for work at intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class IdleThreads:
    """Each thread polls for work every ``period_ns`` since it fell asleep (rosmaster threadpool.py,
    threadSleepTime), at the instants ``asleep_ns``. Without a period they never sleep.
    ``at(time_ns, fn)`` calls ``fn()`` then."""

    def __init__(self, period_ns: int, asleep_ns: list[int], now: Callable[[], int],
                 at: Callable[[int, Callable[[], object]], Any]) -> None:
        self._period_ns = period_ns
        self._asleep_ns = asleep_ns
        self._now, self._at = now, at
        self._booked = False

    def begin(self) -> None:
        """A thread becomes idle."""
        self._asleep_ns.append(self._now())

    def wake(self, works: Callable[[], bool]) -> None:
        """There is work: a thread that polls calls ``works()``, again and again while that returns
        that there was some."""
        if not self._asleep_ns or self._booked:
            return
        if not self._period_ns:
            self._take(0, works)
            return
        now_ns, period_ns = self._now(), self._period_ns
        waits_ns = [(asleep_ns - now_ns) % period_ns for asleep_ns in self._asleep_ns]
        first = waits_ns.index(min(waits_ns))
        self._booked = True
        self._at(now_ns + waits_ns[first], lambda: self._poll(first, works))

    def _poll(self, thread: int, works: Callable[[], bool]) -> None:
        self._booked = False
        self._take(thread, works)

    def _take(self, thread: int, works: Callable[[], bool]) -> None:
        asleep_ns = self._asleep_ns.pop(thread)
        if works():
            self.wake(works)
        else:
            self._asleep_ns.insert(thread, asleep_ns)
