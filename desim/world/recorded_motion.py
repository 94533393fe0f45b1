"""The motion of robots along recorded paths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.units import NEVER_NS, NS_PER_S
from desim.world.recorded_paths import RecordedPath, wrapped


class RecordedMotion:
    """The motion along some paths, at constant velocity from pose to pose. A robot stands at its
    last one."""

    def __init__(self, paths: Sequence[RecordedPath]) -> None:
        self._at = np.cumsum([0, *(len(path.times_ns) for path in paths[:-1])])  # of each path
        self._times_ns = np.concatenate([path.times_ns for path in paths])
        self._until_ns = np.concatenate([np.append(path.times_ns[1:], NEVER_NS) for path in paths])
        places, speeds = [], []
        for path in paths:  # with the way that it has gone since the run began, as fourth column
            steps = path.steps()
            steps = np.column_stack([steps, np.hypot(steps[:, 0], steps[:, 1])])
            ways_m = np.append(0.0, np.cumsum(steps[:, 3]))
            ways_m -= np.interp(0, path.times_ns, ways_m)
            places.append(np.column_stack([path.poses, ways_m]))
            speeds += [steps / (np.diff(path.times_ns)[:, None] / NS_PER_S), np.zeros((1, 4))]
        self._places, self._speeds = np.concatenate(places), np.concatenate(speeds)

    def at(self, time_ns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """[n, 3] poses, [n] m gone so far, and [n, 3] velocities: forward, left m/s, turn rad/s, at
        ``time_ns``, which is not before that of the last ``go_on``."""
        row = self._row(time_ns)
        speeds, since_s = self._speeds[row], (time_ns - self._times_ns[row]) / NS_PER_S
        places = self._places[row] + speeds * since_s[:, None]
        poses = np.column_stack([places[:, :2], wrapped(places[:, 2])])
        c, s, (x, y, turn, _) = np.cos(poses[:, 2]), np.sin(poses[:, 2]), speeds.T
        return poses, places[:, 3], np.column_stack([c * x + s * y, c * y - s * x, turn])

    def go_on(self, time_ns: int) -> None:
        """Forget what was before ``time_ns``."""
        self._at = self._row(time_ns)

    def _row(self, time_ns: int) -> np.ndarray:
        """The row of the last pose of each robot at ``time_ns`` or before it."""
        row = self._at
        while (is_over := self._until_ns[row] <= time_ns).any():
            row = row + is_over
        return row
