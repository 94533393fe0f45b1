"""The error of a path over relations: true poses of one instant as seen from another.

Burgard et al., "A comparison of SLAM algorithms based on a graph of relations" (IROS 2009), and
Kuemmerle et al., "On measuring the accuracy of SLAM algorithms" (Autonomous Robots 2009).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.files import content
from desim.imports.slam_logs.number_words import finite
from desim.robot.transforms import motion_between, wrapped

_MOST_BYTES = 200_000_000
_COLUMNS = 8  # t1 t2 x y z roll pitch yaw
_BESIDE_S = 0.5  # an instant is the log's that far before its first scan or after its last one


class Relations(NamedTuple):
    """``times_s`` [n, 2], and the pose [n, 3] of the second instant as seen from the first."""

    times_s: np.ndarray
    poses: np.ndarray


class PathErrors(NamedTuple):
    """The errors of a path, one for each of ``count`` relations within its time: in m and deg."""

    translation_m: np.ndarray
    rotation_deg: np.ndarray

    def summary(self) -> dict[str, dict[str, float]]:
        """Mean, standard deviation and maximum of both."""
        return {name: {"mean": float(values.mean()), "std": float(values.std()),
                       "max": float(values.max())}
                for name, values in self._asdict().items()}


def read_relations(path: Path) -> Relations:
    """Relations, a line each: t1 t2 x y z roll pitch yaw (s, m, rad). Raises ``InputError``."""
    try:
        lines = content(path, _MOST_BYTES).decode("ascii", "replace").splitlines()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    rows = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) != _COLUMNS:
            raise InputError(f"{path}:{number}: has {len(words)} values; wanted: t1 t2 x y z roll "
                             "pitch yaw")
        rows.append(finite(words, f"{path}:{number}", "a relation"))
    if not rows:
        raise InputError(f"{path}: has no relation; wanted: lines of t1 t2 x y z roll pitch yaw")
    table = np.array(rows)
    return Relations(table[:, :2], table[:, [2, 3, 7]])


def errors_of(times_s: np.ndarray, poses: np.ndarray, relations: Relations) -> PathErrors:
    """The errors of ``poses`` [n, 3] at ``times_s`` [n], on straight lines between them: lengths of
    the difference of places, and angles. Relations outside of these times are left out.

    Raises ``InputError`` if none is left.
    """
    order = np.argsort(times_s, kind="stable")
    times_s, poses = times_s[order], poses[order]
    inside = ((relations.times_s >= times_s[0] - _BESIDE_S)
              & (relations.times_s <= times_s[-1] + _BESIDE_S)).all(1)
    if not inside.any():
        raise InputError(f"--relations: none is within the log, which is from {times_s[0]:.13g} to "
                         f"{times_s[-1]:.13g} s")
    columns = (poses[:, 0], poses[:, 1], np.unwrap(poses[:, 2]))
    ends = [np.stack([np.interp(at, times_s, column) for column in columns], axis=-1)
            for at in relations.times_s[inside].T]
    found, true = motion_between(*ends), relations.poses[inside]
    return PathErrors(np.hypot(found[:, 0] - true[:, 0], found[:, 1] - true[:, 1]),
                      np.degrees(np.abs(wrapped(found[:, 2] - true[:, 2]))))
