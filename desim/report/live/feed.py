"""The feed of a running simulation: its stretches, as often as those that watch can use them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from desim.report.live.stretch import Stretch, Stretches

_EVERY_S = 0.5  # of the viewer's time
_MOST_SHARE = 0.1  # of the run's time, for its maps


class ViewersTime(NamedTuple):
    """The viewer's time: ``now_s()``, and ``wait(seconds)``."""

    now_s: Callable[[], float] = time.perf_counter
    wait: Callable[[float], object] = time.sleep


Sink = Callable[[Stretch], object]


class LiveFeed:
    """Gives a run to ``sinks``, stretch by stretch, at full simulated seconds, at most every half
    second of the viewer's time. Maps cost more: they come less often, so that they take a tenth of
    the time at most.

    ``pace``: at most so many simulated seconds a second of the viewer's; the run waits.
    """

    def __init__(self, stretches: Stretches, sinks: Sequence[Sink], pace: float = math.inf,
                 clock: ViewersTime = ViewersTime()) -> None:  # noqa: B008
        self._stretches, self._sinks, self._pace, self._clock = stretches, sinks, pace, clock
        self._begin_s = self._due_s = self._maps_due_s = clock.now_s()

    def sample(self, second: int) -> None:
        """Give a stretch, if one is due. Called at each full second of the run."""
        clock, now_s = self._clock, self._clock.now_s()
        if second > 0 and now_s >= self._due_s:
            with_maps = now_s >= self._maps_due_s
            self._give(self._stretches.next(with_maps))
            done_s = clock.now_s()
            self._due_s = done_s + _EVERY_S
            if with_maps:
                self._maps_due_s = done_s + (done_s - now_s) / _MOST_SHARE
        early_s = second / self._pace - (clock.now_s() - self._begin_s)
        if early_s > 0.0:
            clock.wait(early_s)

    def end(self) -> None:
        """Give the last stretch: the run has ended."""
        self._give(self._stretches.last())

    def _give(self, stretch: Stretch) -> None:
        for sink in self._sinks:
            sink(stretch)
