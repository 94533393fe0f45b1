"""Batteries that empty as ``robot.power`` says, and are filled at charging stations."""

from __future__ import annotations

import math

from desim.ports.delivery import Charge
from desim.ports.tasks import TaskContext
from desim.units import NS_PER_S

_STEPS = 20  # in which robots feel their charge


class Batteries:
    """The charge of each robot that has ``robot.power``. One whose battery is empty stands for
    good."""

    def __init__(self, context: TaskContext) -> None:
        self._battery_j = dict(zip(context.robots, context.battery_j().tolist(), strict=True))
        self._metered = [name for name in context.explorers if self._battery_j[name] > 0.0]
        self._filled_j = dict.fromkeys(self._metered, 0.0)  # what was used when it was last full
        self._noticed = dict.fromkeys(self._metered, _STEPS)
        self._empty: set[str] = set()
        if self._metered:
            context.every(NS_PER_S, self._sample)

    @property
    def empty(self) -> int:
        """The number of robots that stand for it."""
        return len(self._empty)

    def share(self, context: TaskContext, robot: str) -> float:
        """The charge of ``robot``, 0 to 1; 1 of one without a battery."""
        return self._shares(context).get(robot, 1.0)

    def fill(self, context: TaskContext, robot: str) -> None:
        """Its battery is full."""
        if robot in self._filled_j:
            self._filled_j[robot] = float(context.energy_j()[context.robots.index(robot)])
            self._notify(context, robot, 1.0)

    def _shares(self, context: TaskContext) -> dict[str, float]:
        used_j = dict(zip(context.robots, context.energy_j().tolist(), strict=True))
        return {name: max(0.0, 1.0 - (used_j[name] - self._filled_j[name]) / self._battery_j[name])
                for name in self._metered}

    def _sample(self, context: TaskContext) -> None:
        for robot, share in self._shares(context).items():
            if math.ceil(_STEPS * share) != self._noticed[robot]:
                self._notify(context, robot, share)
            if share == 0.0:
                if robot not in self._empty:
                    self._empty.add(robot)
                    context.record("battery_empty", robot)
                context.hold(robot)

    def _notify(self, context: TaskContext, robot: str, share: float) -> None:
        self._noticed[robot] = math.ceil(_STEPS * share)
        context.notify(robot, Charge(share))
