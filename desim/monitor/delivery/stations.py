"""The queue of robots at a station, which are served one after another."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from desim.ports.delivery import ServiceEnd, Station
from desim.ports.tasks import TaskContext

# Of a robot at a station: what speaks against serving it, None if nothing does.
Objection = Callable[["Visit"], ServiceEnd | None]


class Visit:
    """A robot's wait for its turn at ``station``, since ``since_ns``."""

    def __init__(self, robot: str, station: Station, order: int | None, since_ns: int) -> None:
        self.robot, self.station, self.order, self.since_ns = robot, station, order, since_ns


class ServiceQueue:
    """One station: first come, first served, one robot at a time.

    ``lasts_ns(visit)`` is asked when a service begins, ``objects(visit)`` then and at its end, and
    ``ended(visit, outcome)`` is called with what came of it.
    """

    def __init__(self, station: Station, lasts_ns: Callable[[Visit], int], objects: Objection,
                 ended: Callable[[Visit, ServiceEnd], object]) -> None:
        self.station, self._lasts_ns, self._objects = station, lasts_ns, objects
        self._ended = ended
        self._queue: deque[Visit] = deque()  # the first one is being served
        self.busy_ns, self.waited_ns, self.begun, self.served = 0, 0, 0, 0
        self._begun_ns: int | None = None  # of a service

    def join(self, context: TaskContext, visit: Visit) -> None:
        """A robot wants to be served; one that waits here already does not wait twice."""
        if all(other.robot != visit.robot for other in self._queue):
            self._queue.append(visit)
            if len(self._queue) == 1:
                self._next(context)

    def busy_until_ns(self, now_ns: int) -> int:
        """The time for which it has been busy."""
        return self.busy_ns + (0 if self._begun_ns is None else now_ns - self._begun_ns)

    def _next(self, context: TaskContext) -> None:
        while self._queue:
            visit = self._queue[0]
            outcome = self._objects(visit)
            if outcome is None:
                self.begun += 1
                self.waited_ns += context.now_ns - visit.since_ns
                self._begun_ns = context.now_ns
                context.after(self._lasts_ns(visit), self._end)
                return
            self._queue.popleft()
            self._ended(visit, outcome)

    def _end(self, context: TaskContext) -> None:
        visit = self._queue.popleft()
        self.busy_ns, self._begun_ns = self.busy_until_ns(context.now_ns), None
        outcome = self._objects(visit) or ServiceEnd.DONE
        self.served += outcome is ServiceEnd.DONE
        self._ended(visit, outcome)
        self._next(context)
