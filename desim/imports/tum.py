"""Trajectories of the TUM RGB-D benchmark: lines of ``timestamp tx ty tz qx qy qz qw``, in s and m.

https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats. A file has one robot.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np

from desim.errors import InputError
from desim.files import reading
from desim.imports.recording_content import RecordingContent
from desim.imports.slam_logs.number_words import finite
from desim.imports.trajectories import Trajectory, in_order, plain_name
from desim.ports import natural_key
from desim.scenario import file_kinds
from desim.units import NS_PER_S
from desim.unpacking import lines

_COLUMNS = "timestamp tx ty tz qx qy qz qw"
_LATEST_S = 4_000_000_000  # of a stamp: more is not in s
_FLAT_M = 0.5  # a robot that climbs more is not driving on a floor


def read_tum(paths: Sequence[Path]) -> RecordingContent:
    """The robots of some files, each called like its file. Raises ``InputError``."""
    content = RecordingContent()
    for path in paths:
        name = plain_name(path.stem)
        if name in content.tracks:
            raise InputError(f"{path}: its robot would be {name}, as of "
                             f"{content.tracks[name].source}; wanted: files of different names")
        table, times_ns = _read(path)
        _, aside_m, climbed_m = np.ptp(table[:, :3], axis=0).tolist()
        if climbed_m > 2.0 * aside_m:
            content.notes.append(f"{path.name}: z changes by {climbed_m:.2g} m and y by "
                                 f"{aside_m:.2g} m; x and y are taken, so if z points ahead, as in "
                                 "a camera's frame, turn the poses first")
        elif climbed_m > _FLAT_M:
            content.notes.append(f"{path.name}: heights are left out; they differ by up to "
                                 f"{round(climbed_m, 1):g} m")
        x, y, z, w = table[:, 3:].T
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))
        content.tracks[name] = Trajectory(path.name, *in_order(
            times_ns, np.column_stack([table[:, :2], yaw])))
    content.tracks = dict(sorted(content.tracks.items(), key=lambda item: natural_key(item[0])))
    return content


def _read(path: Path) -> tuple[np.ndarray, list[int]]:
    """[n, 7] the values behind the stamps, and the stamps in ns."""
    rows, times_ns = [], []
    try:
        with reading(path):
            for number, line in lines(path):
                words = line.decode("ascii", "replace").split()
                if not words or words[0].startswith("#"):
                    continue
                where = f"{path}:{number}"
                if len(words) != len(_COLUMNS.split()):
                    raise InputError(f"{where}: has {len(words)} values; wanted: {_COLUMNS}")
                time_s, *row = finite(words, where, "a pose")
                if not 0 <= time_s < _LATEST_S:
                    raise InputError(f"{where}: the timestamp is {time_s:.10g}; wanted: seconds, 0 "
                                     f"to {_LATEST_S}")
                if not any(row[3:]):
                    raise InputError(f"{where}: the quaternion is 0 0 0 0; wanted: an "
                                     "orientation, 0 0 0 1 for none")
                rows.append(row)
                times_ns.append(int(Decimal(words[0]) * NS_PER_S))
    except (EOFError, zlib.error) as error:
        raise InputError(f"{path}: damaged: {error}") from error
    if not rows:
        raise InputError(f"{path}: has no pose; wanted: lines of {_COLUMNS}")
    return np.array(rows), times_ns


def all_tum(paths: Sequence[Path]) -> bool:
    """Whether all ``paths`` are such trajectories. Raises ``InputError`` if only some are."""
    kinds = [None if path.is_dir() else _kind(path) for path in paths]
    if len(paths) > 1 and (others := [path for path, kind in zip(paths, kinds, strict=True)
                                      if kind != file_kinds.TUM]):
        raise InputError(f"{others[0]}: is no TUM trajectory; several files are allowed of those "
                         "alone")
    return kinds[0] == file_kinds.TUM


def _kind(path: Path) -> file_kinds.FileKind | None:
    try:
        return file_kinds.kind_of(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
