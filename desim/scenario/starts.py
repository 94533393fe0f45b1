"""Start poses from a CSV file, written out as a list."""

from __future__ import annotations

import csv
import io
import os

from desim.errors import InputError, did_you_mean
from desim.files import content
from desim.scenario.schema.fleet import StartFile, StartList, StartPose
from desim.units import ANGLE, POSITION

_MOST_BYTES = 10_000_000
_REQUIRED, _COLUMNS = ("x_m", "y_m"), ("x_m", "y_m", "heading_rad", "name")


def listed(start: StartFile, folder: str) -> StartList:
    """The poses in ``start.file``, a path relative to ``folder``. Raises ``InputError``."""
    path = os.path.normpath(os.path.join(folder, start.file))
    try:
        text = content(path, _MOST_BYTES).decode("utf-8-sig")
        reader = csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True)
        columns = reader.fieldnames or []
        rows = [(reader.line_num, row) for row in reader]
    except FileNotFoundError:
        raise InputError(f"no such file: {path}") from None
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path} cannot be read as CSV: {error}") from None
    for column in columns:
        if column not in _COLUMNS:
            raise InputError(f"{path}:1: unknown column {column!r}{did_you_mean(column, _COLUMNS)}"
                             f"; allowed: {', '.join(_COLUMNS)}")
    for column in _REQUIRED:
        if column not in columns:
            raise InputError(f"{path}:1: the column {column!r} is missing; allowed: "
                             f"{', '.join(_COLUMNS)}")
    if not rows:
        raise InputError(f"{path}: has no poses")
    return StartList(poses=tuple(_pose(path, line, row) for line, row in rows), snap=start.snap)


def _pose(path: str, line: int, row: dict[str, str]) -> StartPose:
    try:
        x, y = (POSITION.parse(f"{row[column]} m") for column in _REQUIRED)
        heading = ANGLE.parse(f"{row.get('heading_rad') or 0} rad")
        return StartPose(x=POSITION.format(x), y=POSITION.format(y),
                         heading=ANGLE.format(heading), name=row.get("name") or None)
    except ValueError:
        raise InputError(f"{path}:{line}: x_m, y_m and heading_rad must be finite numbers and name "
                         f"a name, got {', '.join(str(value) for value in row.values())}") from None
