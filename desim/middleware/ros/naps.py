"""How idle threads of a rosmaster sleep."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Naps:
    """Each looks for work every ``period_ns`` since it fell asleep (rosmaster threadpool.py,
    threadSleepTime), of which ``asleep_ns`` has the instants. Without a period they never sleep.
    ``at(time_ns, fn)`` calls ``fn()`` then.
    """

    def __init__(self, period_ns: int, asleep_ns: list[int], now: Callable[[], int],
                 at: Callable[[int, Callable[[], Any]], Any]) -> None:
        self._period_ns = period_ns
        self._asleep_ns = asleep_ns
        self._now, self._at = now, at
        self._booked = False

    def begin(self) -> None:
        """One has nothing to do any more."""
        self._asleep_ns.append(self._now())

    def wake(self, works: Callable[[], bool]) -> None:
        """There is work: ``works()`` when one looks, as long as it says that there is more."""
        if not self._asleep_ns or self._booked:
            return
        if not self._period_ns:
            self._take(0, works)
            return
        now_ns, period_ns = self._now(), self._period_ns
        waits_ns = [(asleep_ns - now_ns) % period_ns for asleep_ns in self._asleep_ns]
        first = waits_ns.index(min(waits_ns))
        self._booked = True
        self._at(now_ns + waits_ns[first], lambda: self._look(first, works))

    def _look(self, thread: int, works: Callable[[], bool]) -> None:
        self._booked = False
        self._take(thread, works)

    def _take(self, thread: int, works: Callable[[], bool]) -> None:
        asleep_ns = self._asleep_ns.pop(thread)
        if works():
            self.wake(works)
        else:
            self._asleep_ns.insert(thread, asleep_ns)
