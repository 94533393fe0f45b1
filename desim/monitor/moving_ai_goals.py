"""Goals from scenarios of the MovingAI benchmarks (Sturtevant 2012): ``.scen`` files.

After the line ``version 1`` each has nine columns: bucket, map, its width and height, column and
row of the start, column and row of the goal, length of the way. Rows count from the top.
"""

from __future__ import annotations

from pathlib import Path

from desim.errors import InputError
from desim.files import content
from desim.ports import Place
from desim.ports.tasks import Ground

_MOST_BYTES = 50_000_000
_CELL_M = 1.0  # the default cell of an imported map


def goals_of(path: str, count: int, ground: Ground) -> tuple[Place, ...]:
    """The goals of the first ``count`` lines. Raises ``InputError`` for a file that is none, with
    the line, and for a goal in a wall."""
    lines = content(Path(path), _MOST_BYTES).decode("utf-8", "replace").splitlines()
    if not lines or lines[0].split() not in (["version", "1"], ["version", "1.0"]):
        raise InputError(f"{path}:1: must be 'version 1'")
    if len(lines) <= count:
        raise InputError(f"{path}: {len(lines) - 1} lines of starts and goals; {count} are needed")
    grid, found = ground.grid, []
    for number, line in enumerate(lines[1:count + 1], 2):
        try:
            _, _, _, height, _, _, x, y, _ = line.split()
            column, row = int(x), int(height) - 1 - int(y)
        except ValueError:
            raise InputError(f"{path}:{number}: {line!r}; allowed: bucket, map, width, height, "
                             "start x, start y, goal x, goal y, length") from None
        place = Place((column + 0.5) * _CELL_M, (row + 0.5) * _CELL_M)
        at = grid.cell(*place)
        if not (0 <= at[0] < grid.width and 0 <= at[1] < grid.height) or ground.solid[at[::-1]]:
            raise InputError(f"{path}:{number}: the goal {x}, {y} is in no free cell of this "
                             "terrain")
        found.append(place)
    return tuple(found)
