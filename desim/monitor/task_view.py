"""The ``TaskContext`` of a run: what its task sees of the truth, through the monitor."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.kernel import Phase
from desim.engine.streams import Streams
from desim.errors import ModelError
from desim.ports import natural_key
from desim.ports.arguments import check_callback, check_period
from desim.ports.tasks import TaskContext
from desim.scenario.robot_types import used_types
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
        self.desks = tuple(sorted((name for name, host in truth.scenario.hosts.items()
                                   if host.strategy is not None), key=natural_key))

    now_ns = property(attrgetter("_kernel.now_ns"))

    @property
    def started_ns(self) -> int:
        return self._monitor.started_ns

    @property
    def radius_m(self) -> float:
        fleet = self._monitor.truth.scenario.fleet
        return min(fleet.types[name].inscribed_radius_m for name in used_types(fleet))

    def every(self, period_ns: int, callback: Callable[[TaskContext], object]) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._kernel.ticker(Fraction(NS_PER_S, period_ns), Phase.OBSERVE,
                            self._trace.names.id("task"), lambda _: callback(self),
                            self.now_ns + period_ns)

    def after(self, delay_ns: int, callback: Callable[[TaskContext], object]) -> None:
        check_callback(callback, "context")
        self._kernel.after(delay_ns, Phase.OBSERVE, self._trace.names.id("task"),
                           lambda _: callback(self))

    def notify(self, host: str, content: object) -> None:
        self._monitor.truth.link.notify(host, content)

    def hold(self, robot: str) -> None:
        self._monitor.truth.hold(robot)

    def energy_j(self) -> np.ndarray:
        return self._monitor.energy.joules(self.now_ns).sum(axis=1)

    def battery_j(self) -> np.ndarray:
        powers = self._monitor.truth.powers
        return np.array([np.nan if power is None else power.battery_j for power in powers])

    def record(self, kind: str, robot: str | None, a: int = 0, b: int = 0) -> None:
        names = self._trace.names
        if robot is not None and robot not in self.robots:
            raise ModelError(f"a task's row is about a robot, or None, not {robot!r}")
        if type(a) is not int or type(b) is not int:
            raise ModelError(f"a task's row has ints, not {a!r} and {b!r}")
        self._trace.row(self.now_ns, names.id(kind), names.id(robot or "task"), a, b)

    def end(self, reason: str) -> None:
        if not isinstance(reason, str) or not reason:
            raise ModelError(f"a run ends for a reason, a text, not {reason!r}")
        self._monitor.end(reason)

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._streams("task", *name)
