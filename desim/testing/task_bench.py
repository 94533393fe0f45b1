"""A fleet without a simulator: a ``TaskContext`` whose robots go where a test puts them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from desim import ports
from desim.engine.streams import Streams
from desim.monitor.coverage import Coverage
from desim.ports.arguments import check_callback, check_period
from desim.ports.tasks import FollowsKnowledge, Ground, TakesActions, Task, TaskContext
from desim.robot.mapping.tiles import FREE, TILE, tiles_of

_CELLS, _CELL_M = 64, 0.5


class TaskBench:
    """Two robots in a hall of 32 m x 32 m with a wall around it, and one without software.

    What the task does is kept: ``rows``, the ``reason`` of the end, ``notified`` (whom, of
    what), whom it ``held``. ``run`` lets time pass, ``at_m`` says where robots are, ``used_j`` what
    they used of batteries of 1 kJ.
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
        self.rows: list[tuple[int, str, str | None, int, int]] = []
        self.reason: str | None = None
        self.notified: list[tuple[str, object]] = []
        self.held: list[str] = []
        self.used_j = np.array([0.0, np.nan, 0.0])
        self.radius_m, self.desks = 0.3, ()
        self._way_m = np.zeros(3)
        self._timers: list[tuple[int, int, Callable[[TaskContext], object]]] = []
        self._once: list[tuple[int, Callable[[TaskContext], object]]] = []
        task.start(self)

    def poses(self) -> np.ndarray:
        return np.column_stack((self.at_m, np.zeros(3)))

    def travelled_m(self) -> np.ndarray:
        return self._way_m

    def every(self, period_ns: int, callback: Callable[[TaskContext], object]) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._timers.append((self.now_ns, period_ns, callback))

    def after(self, delay_ns: int, callback: Callable[[TaskContext], object]) -> None:
        assert type(delay_ns) is int and delay_ns >= 0, f"a delay of {delay_ns!r} ns"
        check_callback(callback, "context")
        self._once.append((self.now_ns + delay_ns, callback))

    def notify(self, host: str, content: object) -> None:
        self.notified.append((host, content))

    def energy_j(self) -> np.ndarray:
        return self.used_j

    def battery_j(self) -> np.ndarray:
        return np.array([1000.0, np.nan, 1000.0])

    def hold(self, robot: str) -> None:
        self.held.append(robot)

    def record(self, kind: str, robot: str | None, a: int = 0, b: int = 0) -> None:
        assert robot is None or robot in self.robots, f"a row about {robot!r}, who is no robot"
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
            at_ns = min([one for one, _ in due] + [one for one, _ in self._once],
                        default=until_ns + 1)
            if at_ns > until_ns:
                break
            self.now_ns = at_ns
            for once in [once for once in self._once if once[0] == at_ns]:
                self._once.remove(once)
                once[1](self)
            for i in [i for one, i in due if one == at_ns]:
                self._timers[i][2](self)
        self.now_ns = until_ns

    def move(self, robot: int, x_m: float, y_m: float) -> None:
        """Put a robot elsewhere."""
        self._way_m = self._way_m.copy()
        self._way_m[robot] += float(np.hypot(*(self.at_m[robot] - (x_m, y_m))))
        self.at_m = self.at_m.copy()
        self.at_m[robot] = x_m, y_m

    def act(self, host: str, content: object) -> None:
        """A strategy does something."""
        assert isinstance(self.task, TakesActions)
        self.task.on_act(self, host, content)

    def learn(self, explorer: int, rows: int) -> None:
        """From now on a robot's map knows the lowest ``rows`` rows of cells as free."""
        known = np.zeros((_CELLS, _CELLS), np.int16)
        known[:rows] = FREE
        fused = tiles_of(self.ground.grid, known)
        self.knowledge.update(explorer, fused, np.zeros(len(fused), np.int64),
                              np.zeros((len(fused), TILE), np.int32),  # no older row
                              np.arange(len(fused), dtype=np.int32))

    def _learned(self, explorer: int) -> None:
        if isinstance(self.task, FollowsKnowledge):
            self.task.on_knowledge(self, explorer)
