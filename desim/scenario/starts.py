"""Start poses from a CSV file, written out as a list."""

from __future__ import annotations

import os
from itertools import islice

from desim.errors import InputError
from desim.ports.files import CsvTable
from desim.scenario.schema.fleet import MAX_ROBOTS, StartFile, StartList, StartPose
from desim.units import ANGLE, POSITION

_REQUIRED, _COLUMNS = ("x_m", "y_m"), ("x_m", "y_m", "heading_rad", "name")


def listed(start: StartFile, folder: str) -> StartList:
    """The poses in ``start.file``, a path relative to ``folder``. Raises ``InputError``."""
    table = CsvTable(os.path.normpath(os.path.join(folder, start.file)))
    table.named({column: column for column in _COLUMNS}, _REQUIRED)
    rows = islice(table.rows(), MAX_ROBOTS + 1)  # one more is too many
    poses = tuple(_pose(table, row) for row in rows)
    if not poses:
        raise InputError(f"{table.path}: has no poses")
    return StartList(poses=poses, snap=start.snap)


def _pose(table: CsvTable, row: dict[str, str]) -> StartPose:
    try:
        x, y = (POSITION.parse(f"{row.get(column)} m") for column in _REQUIRED)
        heading = ANGLE.parse(f"{row.get('heading_rad') or 0} rad")
        return StartPose(x=POSITION.format(x), y=POSITION.format(y),
                         heading=ANGLE.format(heading), name=row.get("name") or None)
    except ValueError:
        raise table.wrong("x_m, y_m and heading_rad must be finite numbers and name a name, got "
                          f"{', '.join(row.values())}") from None
