"""A fleet without a simulator: a ``TaskContext`` whose robots go where a test puts them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from desim import ports
from desim.engine.streams import Streams
from desim.monitor.coverage import Coverage
from desim.ports.arguments import check_callback, check_period
from desim.ports.tasks import FollowsKnowledge, Ground, Task, TaskContext
from desim.robot.mapping.tiles import FREE, tiles_of

_CELLS, _CELL_M = 64, 0.5


class TaskBench:
    """Two robots in a hall of 32 m x 32 m with a wall around it, and one without software.

    What the task does is kept: ``rows``, the ``reason`` of the end. ``run`` lets time pass,
    ``at_m`` says where robots are.
    """

    def __init__(self, task: Task) -> None:
        self.task = task
        self.robots, self.explorers = ("robot_1", "robot_2", "robot_10"), ("robot_1", "robot_10")
        self.now_ns = self.started_ns = 0
        self.stop_explored = 0.99
        self.stop_by: Literal["any", "union", "all", "none"] = "any"
        solid = np.ones((_CELLS, _CELLS), np.uint8)
        solid[1:-1, 1:-1] = 0
        self.ground = Ground(ports.GridSpec(_CELL_M, _CELLS, _CELLS, 0.0, 0.0), solid, solid == 0)
        self.knowledge = Coverage(self.ground, self.explorers, self._learned)
        self.at_m = np.array([[4.0, 4.0], [16.0, 2.0], [28.0, 28.0]])
        self.rows: list[tuple[int, str, str, int, int]] = []
        self.reason: str | None = None
        self._way_m = np.zeros(3)
        self._timers: list[tuple[int, int, Callable[[TaskContext], object]]] = []
        task.start(self)

    def poses(self) -> np.ndarray:
        return np.column_stack((self.at_m, np.zeros(3)))

    def travelled_m(self) -> np.ndarray:
        return self._way_m

    def every(self, period_ns: int, callback: Callable[[TaskContext], object]) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._timers.append((self.now_ns, period_ns, callback))

    def record(self, kind: str, robot: str, a: int = 0, b: int = 0) -> None:
        assert robot in self.robots, f"a row about {robot!r}, who is no robot"
        assert type(a) is int and type(b) is int, f"a row {kind!r} of {a!r} and {b!r}, no ints"
        self.rows.append((self.now_ns, kind, robot, a, b))

    def end(self, reason: str) -> None:
        assert isinstance(reason, str) and reason, f"an end for the reason {reason!r}"
        self.reason = self.reason or reason

    def stream(self, *name: str | int) -> np.random.Generator:
        return Streams(0)("task", *name)

    # --------------------------------------------------------------------------- what a test does

    def run(self, until_ns: int) -> None:
        """Let time pass."""
        while True:
            due = [(start_ns + ((self.now_ns - start_ns) // period_ns + 1) * period_ns, i)
                   for i, (start_ns, period_ns, _) in enumerate(self._timers)]
            at_ns = min((one for one, _ in due), default=until_ns + 1)
            if at_ns > until_ns:
                break
            self.now_ns = at_ns
            for i in [i for one, i in due if one == at_ns]:
                self._timers[i][2](self)
        self.now_ns = until_ns

    def move(self, robot: int, x_m: float, y_m: float) -> None:
        """Put a robot elsewhere."""
        self._way_m = self._way_m.copy()
        self._way_m[robot] += float(np.hypot(*(self.at_m[robot] - (x_m, y_m))))
        self.at_m = self.at_m.copy()
        self.at_m[robot] = x_m, y_m

    def learn(self, explorer: int, rows: int) -> None:
        """From now on a robot's map knows the lowest ``rows`` rows of cells as free."""
        known = np.zeros((_CELLS, _CELLS), np.int16)
        known[:rows] = FREE
        fused = tiles_of(self.ground.grid, known)
        self.knowledge.update(explorer, fused, np.arange(len(fused), dtype=np.int32))

    def _learned(self, explorer: int) -> None:
        if isinstance(self.task, FollowsKnowledge):
            self.task.on_knowledge(self, explorer)
