"""A finite queue in front of a line, counted in packets."""

from __future__ import annotations

from collections import deque

from desim import ports


class DropTailQueue:
    """A finite queue: packets leave it one by one as they are sent."""

    def __init__(self, limit: int) -> None:
        self._begins: deque[int] = deque()
        self._limit = limit

    def join(self, now_ns: int, begin_ns: int, each_ns: int, packets: int) -> int:
        """Let in as many of ``packets`` as fit, and return how many. They would be sent from
        ``begin_ns`` on, one each ``each_ns``; one that is sent at once takes no place."""
        begins = self._begins
        while begins and begins[0] <= now_ns:
            begins.popleft()
        at_once = begin_ns <= now_ns
        fit = min(packets, self._limit - len(begins) + at_once)
        begins.extend(begin_ns + k * each_ns for k in range(at_once, fit))
        return fit


def refuse(context: ports.Context, frame: ports.Frame, fit: int) -> None:
    """Drop all but the first ``fit`` packets of ``frame``: the queue is full."""
    if fit < frame.segments:
        lost = None if fit == 0 else tuple(range(fit, frame.segments))
        context.settle_many(frame, frame.receivers, ports.Drop("queue_full", lost))
