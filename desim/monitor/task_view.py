"""The ``TaskContext`` of a run: what its task sees of the truth, through the monitor."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.kernel import Phase
from desim.engine.streams import Streams
from desim.errors import ModelError
from desim.ports.arguments import check_callback, check_period
from desim.ports.tasks import TaskContext
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.monitor.monitor import Monitor


class TaskView:
    """See ``TaskContext``."""

    def __init__(self, monitor: Monitor, streams: Streams) -> None:
        truth = monitor.truth
        self._monitor, self._kernel, self._trace = monitor, truth.kernel, truth.trace
        self._streams, stop = streams, truth.scenario.stop
        self.robots, self.explorers, self.ground = truth.robots, truth.explorers, truth.ground
        self.poses, self.travelled_m = truth.poses, truth.travelled_m
        self.knowledge = monitor.coverage
        self.stop_explored, self.stop_by = stop.explored, stop.by

    @property
    def now_ns(self) -> int:
        return self._kernel.now_ns

    @property
    def started_ns(self) -> int:
        return self._monitor.started_ns

    def every(self, period_ns: int, callback: Callable[[TaskContext], object]) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._kernel.ticker(Fraction(NS_PER_S, period_ns), Phase.OBSERVE,
                            self._trace.names.id("task"), lambda _: callback(self),
                            self.now_ns + period_ns)

    def record(self, kind: str, robot: str, a: int = 0, b: int = 0) -> None:
        names = self._trace.names
        if robot not in self.robots:
            raise ModelError(f"a task's row is about a robot, not {robot!r}")
        if type(a) is not int or type(b) is not int:
            raise ModelError(f"a task's row has ints, not {a!r} and {b!r}")
        self._trace.row(self.now_ns, names.id(kind), names.id(robot), a, b)

    def end(self, reason: str) -> None:
        if not isinstance(reason, str) or not reason:
            raise ModelError(f"a run ends for a reason, a text, not {reason!r}")
        self._monitor.end(reason)

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._streams("task", *name)
