"""A graph of poses, and the poses that fit its ties best: sparse nonlinear least squares.

Gauss-Newton on SE(2), as in Grisetti, Kuemmerle, Stachniss and Burgard, "A tutorial on graph-based
SLAM", IEEE Intelligent Transportation Systems Magazine 2 (2010). Ties that may be wrong get the
weights of dynamic covariance scaling (Agarwal, Tipaldi, Spinello, Stachniss and Burgard, "Robust
map optimization using dynamic covariance scaling", ICRA 2013, equation 15).
"""

from __future__ import annotations

import math

import numpy as np

from desim.robot.transforms import motion_between, wrapped

_PHI = 1.0  # of the weights: chi squared from which a tie counts less (the paper's)
_ANCHOR = np.diag((1e3, 1e3, 1e4))  # the root of the information on a start that is known: 1 mm
_RAD_PER_M = 0.1  # of drift (ours): headings are known far better than places
_STILL_M = 0.001  # iterations end when no node moves farther


class Table:
    """Rows of ``width`` floats, to which more are added."""

    def __init__(self, width: int) -> None:
        self._rows, self._count = np.zeros((16, width)), 0

    def add(self, row: np.ndarray) -> None:
        """Append a row."""
        if self._count == len(self._rows):
            self._rows = np.concatenate((self._rows, np.zeros_like(self._rows)))
        self._rows[self._count] = row
        self._count += 1

    @property
    def rows(self) -> np.ndarray:
        """[n, width] all of them, not a copy."""
        return self._rows[:self._count]


class PoseGraph:
    """Poses of nodes (``poses`` [n, 3] x m, y m, yaw rad), tied to each other.

    A tie says where node j lies as seen from node i: ``motion`` [3], with the ``information``
    [3, 3] on it along i's axes, zeros for what is not known. One with a ``share`` is about the
    place at that share of the straight way from node j to j's next one.
    """

    def __init__(self) -> None:
        self._poses, self._anchors = Table(3), Table(4)
        self._ties = Table(4 + 3 + 9 + 1)  # i, j, j's next, share, motion, root, drift

    @property
    def poses(self) -> np.ndarray:
        """[n, 3] m, m, rad, not a copy."""
        return self._poses.rows

    def add_node(self, pose: np.ndarray) -> int:
        """Add a node at ``pose`` [3], which is a first guess. Returns its number."""
        self._poses.add(pose)
        return len(self.poses) - 1

    def anchor(self, node: int) -> None:
        """Hold ``node`` where it is."""
        self._anchors.add(np.array((node, *self.poses[node])))

    def tie(self, i: int, j: int, motion: np.ndarray, information: np.ndarray,
            drift_m: float = math.inf, way: tuple[int, float] | None = None) -> None:
        """Tie node ``j`` to node ``i``; with a ``way``, j's next node and a share, a place between
        these two. A tie that may be wrong has a ``drift_m``, the standard deviation of the place
        as it was known without it: by that its chi squared is measured, as a loop that closes is
        far off at first, however well it closes."""
        values, axes = np.linalg.eigh(information)
        root = np.sqrt(np.maximum(values, 0.0))[:, None] * axes.T
        after, share = way or (j, 0.0)
        self._ties.add(np.concatenate(((i, j, after, share), motion, root.ravel(), (drift_m,))))

    def way_m(self, i: int, j: int) -> float:
        """The length of the shortest way from node ``i`` to ``j`` by ties."""
        from scipy.sparse import csr_array  # as in ``_solved``
        from scipy.sparse.csgraph import dijkstra
        ties = self._ties.rows
        lengths = csr_array((np.hypot(ties[:, 4], ties[:, 5]) + _STILL_M,
                             (ties[:, 0].astype(np.int32), ties[:, 1].astype(np.int32))),
                            shape=(len(self.poses), len(self.poses)))
        return float(dijkstra(lengths, directed=False, indices=i)[j])

    def residuals(self) -> np.ndarray:
        """[ties] chi squared of each tie at the present poses."""
        return (self._whitened(np.s_[:])[0] ** 2).sum(axis=1)

    def optimize(self, steps: int, newest: int) -> None:
        """Move the newest ``newest`` nodes by at most ``steps`` steps of Gauss-Newton; the others
        stay where they are."""
        first = max(len(self.poses) - newest, 0)
        anchors = self._anchors.rows[self._anchors.rows[:, 0] >= first]
        held = anchors[:, 0].astype(np.int64)
        free = np.flatnonzero((self._ties.rows[:, :2] >= first).any(axis=1))
        for _ in range(steps):
            errors, blocks, ends, strayed = self._whitened(free)
            scale = np.minimum(1.0, 2.0 * _PHI / (_PHI + strayed))
            away = self.poses[held] - anchors[:, 1:]
            away[:, 2] = wrapped(away[:, 2])
            blocks = *(scale[:, None, None] * block for block in blocks), np.broadcast_to(
                _ANCHOR, (len(held), 3, 3))
            step = _solved(blocks, (*(end - first for end in ends), held - first),
                           np.concatenate((scale[:, None] * errors, away @ _ANCHOR)),
                           len(self.poses) - first)
            self.poses[first:] -= step
            if np.abs(step[:, :2]).max() < _STILL_M:
                break

    def _whitened(self, which: np.ndarray | slice) -> tuple[
            np.ndarray, tuple[np.ndarray, ...], tuple[np.ndarray, ...], np.ndarray]:
        """Of these ties: errors [n, 3] in standard deviations, their derivatives [n, 3, 3] by the
        poses of three nodes, the numbers [n] of these (-1: none), and chi squared [n] by
        ``drift_m``."""
        ties = self._ties.rows[which]
        i, j, after = ties[:, :3].astype(np.int64).T
        share, motion, root = ties[:, 3:4], ties[:, 4:7], ties[:, 7:16].reshape(-1, 3, 3)
        one, end = self.poses[i], self.poses[j]
        end[:, :2] += share * (self.poses[after, :2] - end[:, :2])
        seen = motion_between(one, end)
        error = seen - motion
        error[:, 2] = wrapped(error[:, 2])
        by_one, by_end = np.zeros((len(ties), 3, 3)), np.zeros((len(ties), 3, 3))
        c, s = np.cos(one[:, 2]), np.sin(one[:, 2])
        by_end[:, 0, 0], by_end[:, 0, 1], by_end[:, 1, 0], by_end[:, 1, 1] = c, s, -s, c
        by_one[:, :2, :2] = -by_end[:, :2, :2]
        by_one[:, 0, 2], by_one[:, 1, 2] = seen[:, 1], -seen[:, 0]
        by_one[:, 2, 2], by_end[:, 2, 2] = -1.0, 1.0
        turned_m = np.where(np.abs(root[:, :, 2]).max(axis=1) > 0.0, error[:, 2] / _RAD_PER_M, 0.0)
        strayed = (error[:, 0] ** 2 + error[:, 1] ** 2 + turned_m ** 2) / ties[:, 16] ** 2
        by_one, by_end, part = root @ by_one, root @ by_end, share[:, :, None]
        return (np.einsum("kab,kb->ka", root, error),
                (by_one, (1.0 - part) * by_end, part * by_end),
                (i, j, np.where(share[:, 0] > 0.0, after, -1)), strayed)


def _solved(blocks: tuple[np.ndarray, ...], ends: tuple[np.ndarray, ...], errors: np.ndarray,
            count: int) -> np.ndarray:
    """[count, 3] the least squares solution for ``errors`` [n, 3], whose derivatives by node
    ``ends[k]`` are ``blocks[k]``. The first three of ``blocks`` are of the same errors, the fourth
    of those after them; nodes below 0 do not move."""
    from scipy.sparse import csr_array  # slow to import, and few runs need it
    from scipy.sparse.linalg import splu
    values, lines, columns, many = [], [], [], len(ends[0])
    for block, end, begin in zip(blocks, ends, (0, 0, 0, many), strict=True):
        moves = np.flatnonzero(end >= 0)
        values.append(block[moves].ravel())
        lines.append(np.repeat(3 * (begin + moves)[:, None] + np.arange(3), 3, axis=1).ravel())
        columns.append(np.tile(3 * end[moves][:, None] + np.arange(3), 3).ravel())
    jacobian = csr_array((np.concatenate(values), (np.concatenate(lines), np.concatenate(columns))),
                         shape=(errors.size, 3 * count))
    normal = (jacobian.T @ jacobian).tocsc()
    factor = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                  options={"SymmetricMode": True})
    return factor.solve(jacobian.T @ errors.ravel()).reshape(count, 3)
