"""A tree of coordinate frames that move in the plane, as ROS's tf has them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from desim.robot.transforms import compose

_DEEPEST = 32  # frames from a robot to the root: more are a loop
ALWAYS_NS = -(1 << 62)  # since when a static transform holds


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

    def ancestors(self, frame: str) -> Iterator[str]:
        """The frames above ``frame``, the root last."""
        for _ in range(_DEEPEST):
            if frame not in self._parent:
                return
            frame = self._parent[frame]
            yield frame

    def times_ns(self, child: str) -> np.ndarray:
        """[n] when ``child`` is known to move, ascending: by its own transforms, or by those of the
        nearest frame above it whose transform is not static."""
        for frame in (child, *self.ancestors(child)):
            times_ns = sorted(row[0] for row in self._rows.get(frame, ()) if row[0] != ALWAYS_NS)
            if times_ns:
                return np.array(times_ns, np.int64)
        return np.empty(0, np.int64)

    def within(self, frame: str, poses: np.ndarray, times_ns: np.ndarray, top: str | None = None
               ) -> np.ndarray:
        """[n, 3] ``poses`` at ``times_ns`` [n], which are in ``frame``, in the root of its tree, or
        in the frame ``top`` above it."""
        for above in self.ancestors(frame):
            if frame == top:
                break
            poses = compose(self._at(frame, times_ns), poses)
            frame = above
        return poses

    def _at(self, child: str, times_ns: np.ndarray) -> np.ndarray:
        """[n, 3] the last pose of ``child`` that was given by each time, or the first one."""
        rows = sorted(self._rows[child])
        given_ns = np.array([row[0] for row in rows], np.int64)
        at = np.searchsorted(given_ns, times_ns, side="right") - 1
        return np.array(rows, float)[np.clip(at, 0, None), 1:]
