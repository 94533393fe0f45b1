"""What a radio wave loses in the walls on its way: so many dB for each that it crosses
(multi-wall, COST 231 final report, 4.7.2)."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import Decibels

# dB of a wall: planning tables for 2.4 GHz (plasterboard, wood, glass, brick, concrete, metal; the
# middle of what they say), and COST 231's external wall (stone).
CROSSING_DB = {"brick": 9.0, "concrete": 15.0, "glass": 2.5, "metal": 20.0, "plasterboard": 3.0,
               "stone": 12.0, "wood": 4.0}


class Walls(ports.Params):
    """Every segment that the straight line between two antennas crosses counts: a solid block, of
    which a terrain has the faces only, counts twice. The angle does not matter."""

    crossing: dict[str, Decibels] = Field({}, description="loss by material, at any thickness "
                                                          "(planning tables for 2.4 GHz, COST 231)")
    per_metre: dict[str, Decibels] = Field({}, description="loss by material that a metre of "
                                                           "thickness adds (none)")

    def check(self, materials: tuple[str, ...]) -> None:
        """Raises ``InputError`` for a material that no wall can have."""
        for key, table in ("crossing", self.crossing), ("per_metre", self.per_metre):
            for name in table:
                if materials and name not in materials:
                    raise InputError(f".walls.{key}: unknown material {name!r}"
                                     f"{did_you_mean(name, materials)}; "
                                     f"allowed: {', '.join(materials)}")

    def loss_db(self, obstacles: ports.Obstacles, lines: np.ndarray) -> np.ndarray:
        """[k] dB on straight lines: ``lines`` [k, 4] x1 y1 x2 y2 in m."""
        if not len(obstacles.segments) or not len(lines):
            return np.zeros(len(lines))
        by_name = CROSSING_DB | self.crossing
        crossing_db = np.array([by_name.get(name, 0.0) for name in obstacles.materials])
        per_metre_db = np.array([self.per_metre.get(name, 0.0) for name in obstacles.materials])
        wall_db = (crossing_db[obstacles.material]
                   + per_metre_db[obstacles.material] * obstacles.thickness_m)
        line, wall = obstacles.crossings(lines).T
        return np.bincount(line, wall_db[wall], len(lines))
