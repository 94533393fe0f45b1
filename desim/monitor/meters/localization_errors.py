"""Errors of the poses that robots found by SLAM, and of the walls in maps, against the truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from desim.engine.trace import Names, real
from desim.monitor.coverage import states
from desim.monitor.meters.meter import Meter
from desim.monitor.samples import Sample
from desim.ports.tasks import Ground
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.transforms import motion_between, wrapped

# A closure is false if it is farther off (ours): two cells of the paper's maps, and the turn that
# makes as much 20 m away.
FALSE_CLOSURE_M, FALSE_CLOSURE_RAD = 0.4, 0.02


class _Sums:
    """Sums of the squared errors of poses, their count, and the largest error."""

    def __init__(self) -> None:
        self.count = 0
        self.square_m2 = self.square_rad2 = self.most_m = 0.0

    def add(self, off_m: float, off_rad: float) -> None:
        """Add the errors of one more pose."""
        self.count += 1
        self.square_m2 += off_m * off_m
        self.square_rad2 += off_rad * off_rad
        self.most_m = max(self.most_m, off_m)

    def root(self, squares: float) -> float | None:
        """The root of the mean of ``squares``; None if there were no poses."""
        return math.sqrt(squares / self.count) if self.count else None


class LocalizationErrors(Meter):
    """The errors of all poses of a run. ``true_poses()`` [robots, 3] are those of now."""

    def __init__(self, robots: tuple[str, ...], true_poses: Callable[[], np.ndarray]) -> None:
        self._index = {name: i for i, name in enumerate(robots)}
        self._true_poses = true_poses
        self._processed, self._online = _Sums(), _Sums()
        # The pose from which a robot enters the scan of this instant in its map; and the one that
        # it estimates for this instant: the bits of x m, y m and yaw rad.
        self.listeners = {"localized": partial(self._note, self._processed),
                          "believed": partial(self._note, self._online)}

    def _note(self, sums: _Sums, robot: str, x: int, y: int, yaw: int) -> None:
        x_m, y_m, yaw_rad = self._true_poses()[self._index[robot]].tolist()
        sums.add(math.hypot(real(x) - x_m, real(y) - y_m),
                 math.remainder(real(yaw) - yaw_rad, math.tau))

    def summary(self, now_ns: int) -> Sample:
        """Of processed scans ``ate_m``: absolute trajectory error, the root of the mean square
        (Sturm et al. 2012, without alignment: the start is known); ``ate_max_m``;
        ``heading_rms_rad``. The same of the poses that robots go by, once a second:
        ``online_ate_m``, ``online_heading_rms_rad``. None without SLAM."""
        processed, online = self._processed, self._online
        return {"ate_m": processed.root(processed.square_m2),
                "ate_max_m": processed.most_m if processed.count else None,
                "heading_rms_rad": processed.root(processed.square_rad2),
                "online_ate_m": online.root(online.square_m2),
                "online_heading_rms_rad": online.root(online.square_rad2)}


class ClosureErrors(Meter):
    """The loop closures that robots have accepted, against the truth: the true motions between the
    instants of both scans."""

    def __init__(self, robots: tuple[str, ...], true_poses: Callable[[], np.ndarray],
                 names: Names) -> None:
        self._index, self._names = {name: i for i, name in enumerate(robots)}, names
        self._true_poses = true_poses
        self._drawn: dict[str, list[np.ndarray]] = {name: [] for name in robots}
        self._first: dict[str, list[np.ndarray]] = {}  # of those that have stopped, what was drawn
        self._about: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self._closures = self._false = 0
        self.listeners = {"localized": self._draws, "closed": self._closes,
                          "closed_at": self._closed_at}

    def watch(self, robot: str, robot_map: RobotMap | None, now_ns: int) -> None:
        """Scans count from the start of a robot's software. Teammates have those of its first start
        alone: after another one it does not know where it is."""
        if self._drawn[robot]:
            self._first.setdefault(robot, self._drawn[robot])
        self._drawn[robot] = []

    def _draws(self, robot: str, *_: int) -> None:
        self._drawn[robot].append(self._true_poses()[self._index[robot]].copy())

    def _closes(self, robot: str, source: int, theirs: int, own: int) -> None:
        """Note which scans the next row of a robot is about."""
        mine, now = self._drawn[robot], self._true_poses()[self._index[robot]].copy()
        name = self._names[source]
        known = mine if name == robot else self._first.get(name, self._drawn[name])
        # The scan that is being processed is drawn a moment later.
        self._about[robot] = known[theirs], mine[own] if own < len(mine) else now

    def _closed_at(self, robot: str, x: int, y: int, yaw: int) -> None:
        off = motion_between(*self._about[robot]) - (real(x), real(y), real(yaw))
        self._closures += 1
        self._false += bool(math.hypot(off[0], off[1]) > FALSE_CLOSURE_M
                            or abs(wrapped(off[2])) > FALSE_CLOSURE_RAD)

    def summary(self, now_ns: int) -> Sample:
        """``closures``, and how many of them are ``false_closures``: None without a graph."""
        return {"closures": self._closures or None,
                "false_closures": self._false if self._closures else None}


class WallErrors(Meter):
    """The errors of walls in the map that is judged, int16 log-odds [height, width]."""

    def __init__(self, ground: Ground, judged_map: Callable[[], np.ndarray]) -> None:
        self._ground, self._judged_map = ground, judged_map

    def summary(self, now_ns: int) -> Sample:
        return wall_errors(self._ground, self._judged_map())


def wall_errors(ground: Ground, log_odds: np.ndarray) -> Sample:
    """Distances of the wall cells of a map, int16 ``log_odds`` [height, width], from the nearest
    true ones, centre to centre: median and 95th percentile. None without walls."""
    believed = states(log_odds) > 0
    if not believed.any() or not ground.solid.any():
        return {"wall_error_median_m": None, "wall_error_p95_m": None}
    away_m = np.zeros(believed.shape)
    walls = np.argwhere(ground.solid)
    for wrong in np.argwhere(believed & (ground.solid == 0)):
        cells = np.sqrt(((walls - wrong) ** 2).sum(axis=1).min())
        away_m[tuple(wrong)] = cells * ground.grid.resolution_m
    median_m, most_m = np.percentile(away_m[believed], (50, 95), method="inverted_cdf").tolist()
    return {"wall_error_median_m": median_m, "wall_error_p95_m": most_m}
