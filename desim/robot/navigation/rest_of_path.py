"""The rest of a path: where a robot is on it, and what lies ahead."""

from __future__ import annotations

import numpy as np

_LEGS = 4  # that are looked at, the present one and the next ones, as the dynamic window does


class RestOfPath:
    """A path [n, 2] in m that a robot follows; it does not go back to a leg that it has left."""

    def __init__(self, path: np.ndarray) -> None:
        self._path, self._leg = path, 0

    def after(self, x_m: float, y_m: float) -> np.ndarray:
        """[k, 2] m, k at least 2: from the point nearest to (``x_m``, ``y_m``) to the end."""
        path, last = self._path, len(self._path) - 1
        if last < 1:
            return np.repeat(path, 2, axis=0)
        starts = path[self._leg:min(self._leg + _LEGS, last)]
        along = path[self._leg + 1:self._leg + 1 + len(starts)] - starts
        length2 = (along * along).sum(axis=1)
        to = ((x_m, y_m) - starts) * along
        share = np.clip(to.sum(axis=1) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
        share[length2 == 0.0] = 1.0
        nearest = starts + share[:, None] * along
        away = nearest - (x_m, y_m)
        k = int(np.argmin((away * away).sum(axis=1)))
        self._leg += k
        return np.concatenate([nearest[k:k + 1], path[self._leg + 1:]])
