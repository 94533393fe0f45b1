"""A tree of coordinate frames that move in the plane, as ROS's tf has them."""

from __future__ import annotations

import numpy as np

from desim.robot.transforms import compose

_DEEPEST = 32  # frames from a robot to the root: more are a loop


class FrameTree:
    """The transforms of a recording: x m, y m, yaw rad of each frame in its parent, by time."""

    def __init__(self) -> None:
        self._parent: dict[str, str] = {}
        self._rows: dict[str, list[tuple[int, float, float, float]]] = {}

    def add(self, time_ns: int, parent: str, child: str, x_m: float, y_m: float, yaw_rad: float
            ) -> None:
        """The pose of frame ``child`` in ``parent`` from ``time_ns`` on."""
        self._parent[child] = parent
        self._rows.setdefault(child, []).append((time_ns, x_m, y_m, yaw_rad))

    def children(self) -> list[str]:
        """The frames that have a parent, in the order in which they came."""
        return list(self._parent)

    def times_ns(self, child: str) -> np.ndarray:
        """[n] when the pose of ``child`` is given, ascending."""
        return np.array(sorted(row[0] for row in self._rows[child]), np.int64)

    def in_root(self, frame: str, poses: np.ndarray, times_ns: np.ndarray) -> np.ndarray:
        """[n, 3] ``poses`` at ``times_ns`` [n], which are in ``frame``, in the root of its tree."""
        for _ in range(_DEEPEST):
            if frame not in self._parent:
                break
            poses = compose(self._at(frame, times_ns), poses)
            frame = self._parent[frame]
        return poses

    def _at(self, child: str, times_ns: np.ndarray) -> np.ndarray:
        """[n, 3] the last pose of ``child`` that was given by each time, or the first one."""
        rows = np.array(sorted(self._rows[child]), float)
        at = np.searchsorted(self.times_ns(child), times_ns, side="right") - 1
        return rows[np.clip(at, 0, None), 1:]
