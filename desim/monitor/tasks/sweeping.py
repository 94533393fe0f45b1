"""Coverage: every part of the ground is to be passed over, as a cleaning robot does."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.monitor.places import free_cells
from desim.ports.tasks import SweepingTool, TaskContext, TaskTraits
from desim.units import LENGTH, NS_PER_S, Length

_SAMPLE_NS = NS_PER_S // 10
_SHARE = 0.95  # of the ground, with which it is done


class Sweeping:
    """Cover the ground: a robot's tool is a disc around its centre. Done when 95 % of the ground
    that tools can get to is covered. Robots know the map."""

    class Params(ports.Params):
        width_m: Length = Field("1 m", gt=0, description="the diameter of a robot's tool")

    leads = ("coverage_time_s", "covered")
    traits = TaskTraits(gives=SweepingTool, quantities=("covered",))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: TaskContext) -> None:
        from scipy import ndimage  # most runs do without it

        self._context, self._grid = context, context.ground.grid
        self._robots = [context.robots.index(name) for name in context.explorers]
        at_m = context.poses()[self._robots, :2]
        centres = np.zeros(context.ground.solid.shape, bool)
        for x_m, y_m in free_cells(context.ground, at_m, context.radius_m).tolist():
            column, row = self._grid.cell(x_m, y_m)
            centres[row, column] = True
        reach_m = ndimage.distance_transform_edt(~centres) * self._grid.resolution_m
        self._target = context.ground.reachable & (reach_m <= self._params.width_m / 2)
        if self._params.width_m < self._grid.resolution_m:
            raise InputError(
                f".width: {LENGTH.format(self._params.width_m)} is less than a cell of the "
                f"terrain; allowed: from {LENGTH.format(self._grid.resolution_m)} on")
        if not self._target.any():
            raise InputError(": robots get nowhere from where they start")
        self._passes = np.zeros(self._target.shape, np.int32)  # of tools over each cell
        self._covered = 0
        self._done_ns: int | None = None
        self._own_cells = [0] * len(self._robots)  # that a robot covered first
        self._under = [np.zeros(0, np.intp) for _ in self._robots]  # tools at the last sample
        self._last_m = at_m
        context.every(_SAMPLE_NS, self._sample)

    def briefing(self) -> SweepingTool:
        return SweepingTool(self._params.width_m)

    def gives_map(self) -> bool:
        """Robots that cover a ground know it."""
        return True

    def measure(self) -> dict[str, float]:
        return {"covered": self._covered / int(self._target.sum())}

    def metrics(self) -> dict[str, object]:
        """``passes_mean``: how often a tool came over a covered cell, 1 where none did twice."""
        cell_m2, done_ns = self._context.ground.cell_m2, self._done_ns
        return {**self.measure(), "covered_m2": self._covered * cell_m2,
                "coverage_time_s": None if done_ns is None else
                (done_ns - self._context.started_ns) / NS_PER_S,
                "passes_mean": int(self._passes.sum()) / self._covered if self._covered else None,
                "covered_m2_by_robot": dict(zip(
                    self._context.explorers, (n * cell_m2 for n in self._own_cells), strict=True))}

    def _sample(self, context: TaskContext) -> None:
        at_m = context.poses()[self._robots, :2]
        for robot, (last, now) in enumerate(zip(self._last_m, at_m, strict=True)):
            cells = self._cells_under(last, now)
            new = cells[~np.isin(cells, self._under[robot])]
            passes = self._passes.ravel()
            first = int((passes[new] == 0).sum())
            passes[new] += 1
            self._covered += first
            self._own_cells[robot] += first
            self._under[robot] = cells
        self._last_m = at_m
        if self._done_ns is None and self.measure()["covered"] >= _SHARE:
            self._done_ns = context.now_ns
            context.record("covered", None, self._covered)
            context.end("covered")

    def _cells_under(self, last_m: np.ndarray, now_m: np.ndarray) -> np.ndarray:
        """[n] the flat indices of cells of the target that a tool on its way touched: those whose
        centre is within its radius of the segment."""
        grid, radius_m = self._grid, self._params.width_m / 2
        low, high = np.minimum(last_m, now_m) - radius_m, np.maximum(last_m, now_m) + radius_m
        columns, rows = (np.arange(max(0, math.floor((a - o) / grid.resolution_m)),
                                   min(n, math.ceil((b - o) / grid.resolution_m) + 1))
                         for a, b, o, n in zip(low, high, (grid.x_m, grid.y_m),
                                               (grid.width, grid.height), strict=True))
        x_m = (grid.x_m + (columns + 0.5) * grid.resolution_m)[None, :] - last_m[0]
        y_m = (grid.y_m + (rows + 0.5) * grid.resolution_m)[:, None] - last_m[1]
        way = now_m - last_m
        along = np.clip((x_m * way[0] + y_m * way[1]) / max(way @ way, 1e-12), 0.0, 1.0)
        near = np.hypot(x_m - along * way[0], y_m - along * way[1]) <= radius_m
        found_rows, found_columns = np.nonzero(near)
        cells = rows[found_rows] * grid.width + columns[found_columns]
        return cells[self._target.ravel()[cells]]
