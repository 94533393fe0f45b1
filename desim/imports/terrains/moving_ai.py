"""Grid maps of the MovingAI benchmarks (``.map``), as many planners for several robots have them.

Sturtevant, Benchmarks for Grid-Based Pathfinding, 2012: ``.`` and ``G`` are passable, ``S`` is
swamp, ``W`` water, ``T`` trees, ``@`` and ``O`` are out of bounds. In warehouses of the League of
Robot Runners, robots also stand on ``E`` and ``S``, places of tasks. Some files have no line
``type``.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from desim.errors import InputError
from desim.files import content
from desim.imports.terrains.found import Choices, FoundTerrain, material_of
from desim.imports.terrains.picture import HEIGHT_M, MATERIAL
from desim.world import map_images
from desim.world.terrain import MAX_CELLS, of_free_cells

_EDGE_M = 1.0
_HEADER = re.compile(rb"(?:type\s+\w+\s+)?height\s+(\d{1,9})\s+width\s+(\d{1,9})\s+map[ \t]*\r?\n")
_FREE, _BLOCKED, _SPECIAL = b".GSE", b"@OTW", {b"S": "swamp, or places of tasks",
                                               b"E": "places of tasks"}


def read(path: Path, choices: Choices) -> FoundTerrain:
    """The grid, in cells of 1 m unless ``choices`` has another width. Raises ``InputError``."""
    data = content(path, 2 * MAX_CELLS)
    header = _HEADER.match(data)
    if header is None:
        raise InputError(f"{path}:1: must begin with the lines type, height, width and map")
    height, width = map(int, header.groups())
    if not 0 < height * width <= MAX_CELLS:
        raise InputError(f"{path}: {width} x {height} cells; allowed: 1 to {MAX_CELLS}")
    first = data.count(b"\n", 0, header.end()) + 1
    rows = data[header.end():].splitlines()
    if len(rows) < height or any(map(bytes.strip, rows[height:])):
        raise InputError(f"{path}: {len(rows)} rows; height says {height}")
    for number, row in enumerate(rows[:height], first):
        if len(row.rstrip()) != width:
            raise InputError(f"{path}:{number}: {len(row.rstrip())} cells; width says {width}")
        if (rest := row.rstrip().translate(None, _FREE + _BLOCKED)):
            raise InputError(f"{path}:{number}:{row.index(rest[:1]) + 1}: {chr(rest[0])!r} is no "
                             "cell of such maps; allowed: . G S (free), @ O T W (blocked)")
    cells = np.frombuffer(b"".join(row.rstrip() for row in rows[:height]), np.uint8)
    free = np.isin(cells, np.frombuffer(_FREE, np.uint8)).reshape(height, width)
    if not free.any():
        raise InputError(f"{path}: no free cell")
    notes = [] if choices.resolution_m else [f"a cell is {_EDGE_M:g} m wide (--resolution)"]
    notes += [f"{count} cells {letter.decode()} ({meaning}) are free" for letter, meaning
              in _SPECIAL.items() if (count := int((cells == letter[0]).sum()))]
    terrain = of_free_cells(path, free[::-1], material_of(choices, MATERIAL),
                            choices.resolution_m or _EDGE_M, (0.0, 0.0),
                            choices.height_m or HEIGHT_M)
    return FoundTerrain(terrain, None, notes=(*notes, *map_images.open_edge(path, free)))
