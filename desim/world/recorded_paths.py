"""Recorded paths: the poses of robots over time, from a CSV.

Its columns are those of ``poses.csv`` and ``robots.csv`` of ``desim export RUN --csv FOLDER``;
others are passed over. Rows may stand in any order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Decimal
from functools import partial
from math import degrees
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError, below
from desim.ports import RecordedPaths, natural_key
from desim.ports.files import CsvTable, number
from desim.scenario.file_kinds import kind_of
from desim.scenario.names import unknown
from desim.units import MM_PER_M, MRAD_PER_RAD, NS_PER_S

_TIMES = {"time_ns": 1, "time_s": NS_PER_S}  # ns
_LONGEST_S, _FARTHEST_M, _LARGEST_RAD = 4e9, 1e6, 1e4  # more is in another unit


class RecordedPath(NamedTuple):
    """The poses of one robot.

    ``times_ns`` [n] ascending, the first at most 0, where the run begins | ``poses`` [n, 3] x m,
    y m, yaw rad from -pi to pi | ``lines`` [n] of ``file`` | ``until_ns``: the end of the run, at
    the latest | ``passed_over``: the robots of the file that nobody follows.
    """

    file: str
    until_ns: int
    times_ns: np.ndarray
    poses: np.ndarray
    lines: np.ndarray
    passed_over: tuple[str, ...]

    def steps(self) -> np.ndarray:
        """[n - 1, 3] from each pose to the next, the short way round."""
        steps = np.diff(self.poses, axis=0)
        return np.column_stack([steps[:, :2], wrapped(steps[:, 2])])


def wrapped(yaw_rad: np.ndarray) -> np.ndarray:
    """Angles from -pi to pi; those that are there already stay what they are."""
    return yaw_rad - 2.0 * np.pi * np.floor((yaw_rad + np.pi) / (2.0 * np.pi))


class _Quantity(NamedTuple):
    """A number in rows: the columns that may have it, with what of their unit makes a m or a rad,
    and the largest number in those."""

    per: dict[str, float]
    most: float
    wanted: str

    def of(self, table: CsvTable) -> Callable[[dict[str, str]], float]:
        """Reads it from a row of ``table``."""
        column = table.first_of(self.per)
        per, most = self.per[column], self.most * self.per[column]
        parse = partial(number, least=-most, most=most)
        return lambda row: table.value(row, column, parse, self.wanted) / per


_X = _Quantity({"x_mm": MM_PER_M, "x_m": 1.0}, _FARTHEST_M, "a place")
_Y = _Quantity({"y_mm": MM_PER_M, "y_m": 1.0}, _FARTHEST_M, "a place")
_YAW = _Quantity({"yaw_mrad": MRAD_PER_RAD, "yaw_rad": 1.0, "yaw_deg": degrees(1.0)},
                 _LARGEST_RAD, "an angle")


class _Rows(NamedTuple):
    """The rows of one robot, in the order of the file."""

    lines: list[int]
    times_ns: list[int]
    poses: list[tuple[float, float, float]]


def read_paths(params: RecordedPaths, robots: Sequence[str], until_ns: int
               ) -> dict[str, RecordedPath]:
    """The path of each of ``robots``. Raises ``InputError``; its keys begin with a dot."""
    for robot in params.names:
        if robot not in robots:
            raise InputError(f".names: {unknown('robot', robot, robots)}")
    paths = {}
    with below(".file"):
        if Path(params.file).is_file() and (kind := kind_of(params.file)) is not None:
            raise InputError(f"{params.file}: is {kind.name}; wanted: a CSV of poses, as desim "
                             "export RUN --csv FOLDER writes of what desim import makes of it")
        table = CsvTable(params.file)
        faces_ahead = not any(map(table.has, _YAW.per))
        rows = _read(table, faces_ahead)
        if not rows:
            raise InputError(f"{params.file}: has no poses")
        names = {robot: str(params.names.get(robot, robot)) for robot in robots}
        others = tuple(sorted(set(rows).difference(names.values()), key=natural_key))
        begin_ns = params.begin_ns
        if begin_ns is None:
            begin_ns = min(min(own.times_ns) for own in rows.values())
        for robot, name in names.items():
            if name not in rows:
                raise InputError(f"{params.file}: {unknown('robot', name, tuple(rows))}; names: "
                                 f"{{{robot}: NAME}} says who {robot} is there")
            times_ns, poses, lines = _ordered(rows[name], begin_ns, faces_ahead)
            paths[robot] = RecordedPath(params.file, until_ns, times_ns, poses, lines, others)
    return paths


def _read(table: CsvTable, faces_ahead: bool) -> dict[str, _Rows]:
    """The rows by the name of the robot; 0 for headings if robots face ahead."""
    robot, time = table.first_of(["robot"]), table.first_of(_TIMES)
    x, y = _X.of(table), _Y.of(table)
    yaw: Callable[[dict[str, str]], float] = (lambda row: 0.0) if faces_ahead else _YAW.of(table)
    parse = partial(_ns, unit_ns=_TIMES[time])
    rows: dict[str, _Rows] = {}
    for row in table.rows():
        if not row.get(robot):
            raise table.wrong("robot is missing")
        own = rows.setdefault(row[robot], _Rows([], [], []))
        own.lines.append(table.line)
        own.times_ns.append(table.value(row, time, parse, "a time, at least 0, at most 4e9 s"))
        own.poses.append((x(row), y(row), yaw(row)))
    return rows


def _ns(cell: str, unit_ns: int) -> int:
    number(cell, 0.0, _LONGEST_S * NS_PER_S / unit_ns)
    return round(Decimal(cell) * unit_ns)


def _ordered(rows: _Rows, begin_ns: int, faces_ahead: bool
             ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``times_ns`` from ``begin_ns`` on, ``poses`` and ``lines`` of a path. Of two poses at a time
    the later line counts."""
    times_ns, first = np.unique(np.array(rows.times_ns[::-1]), return_index=True)
    poses, lines = np.array(rows.poses[::-1])[first], np.array(rows.lines[::-1])[first]
    if faces_ahead:
        poses[:, 2] = _ahead(np.diff(poses[:, :2], axis=0))
    poses[:, 2] = wrapped(poses[:, 2])
    times_ns -= begin_ns
    if times_ns[0] > 0:  # it stands there until then
        times_ns, poses, lines = (np.concatenate([values[:1], values]) for values in (
            times_ns, poses, lines))
        times_ns[0] = 0
    return times_ns, poses, lines


def _ahead(steps: np.ndarray) -> np.ndarray:
    """[n + 1] the direction of each step [n, 2]; where there is none, that of the last one before,
    and at the start of the first."""
    moves = np.flatnonzero(steps.any(axis=1))
    if not len(moves):
        return np.zeros(len(steps) + 1)
    last = np.searchsorted(moves, np.arange(len(steps) + 1), side="right") - 1
    return np.arctan2(steps[:, 1], steps[:, 0])[moves[last.clip(0)]]
