"""Loss of a radio wave in walls: dB per wall that it crosses, and dB per metre inside of blocks.

Walls: the multi-wall model (COST 231 final report, 4.7.2). Metres inside of blocks (Sommer,
Eckhoff, German, Dressler 2011, "A computationally inexpensive empirical model of IEEE 802.11p radio
shadowing in urban environments": the obstacles of Veins)."""

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
    """Every wall that the straight line between two antennas goes through counts once, drawn or
    shown by a map, at any angle; a block, which is thicker than 1 m, where the line goes in and
    where it comes out.

    Veins' model, n times the loss of a face and so much for each metre in between, are
    ``crossing`` and ``inside`` of the blocks' material: what is between the first and the second
    face on a line, between the third and the fourth, ... A face without a partner, of the block in
    which an antenna is, has no inside; blocks must not share a face."""

    crossing: dict[str, Decibels] = Field({}, description="loss by material, at any thickness "
                                                          "(planning tables for 2.4 GHz, COST 231)")
    per_metre: dict[str, Decibels] = Field({}, description="loss by material that a metre of "
                                                           "thickness adds (none)")

    inside: dict[str, Decibels] = Field({}, description="loss by material of a metre of the way "
                                                        "inside its blocks (none; Veins: 0.4 dB)")

    def check(self, materials: tuple[str, ...]) -> None:
        """Raises ``InputError`` for a material that no wall can have."""
        for key, table in (("crossing", self.crossing), ("per_metre", self.per_metre),
                           ("inside", self.inside)):
            for name in table:
                if materials and name not in materials:
                    raise InputError(f".walls.{key}: unknown material {name!r}"
                                     f"{did_you_mean(name, materials)}; "
                                     f"allowed: {', '.join(materials)}")

    def loss_db(self, obstacles: ports.Obstacles, lines: np.ndarray,
                most_db: np.ndarray | None = None) -> np.ndarray:
        """[k] dB on straight lines: ``lines`` [k, 4] x1 y1 x2 y2 in m. Where it is above
        ``most_db`` [k] it may be any number above that."""
        if not len(obstacles.segments) or not len(lines):
            return np.zeros(len(lines))
        by_name = CROSSING_DB | self.crossing
        crossing_db = np.array([by_name.get(name, 0.0) for name in obstacles.materials])
        per_metre_db = np.array([self.per_metre.get(name, 0.0) for name in obstacles.materials])
        wall_db = (crossing_db[obstacles.material]
                   + per_metre_db[obstacles.material] * obstacles.thickness_m)
        if most_db is not None and not self.inside and (wall_db >= 0.0).all():
            return obstacles.tolls(lines, wall_db, most_db)
        line, wall = obstacles.crossings(lines).T
        loss_db = np.bincount(line, wall_db[wall], len(lines))
        for name, metre_db in sorted(self.inside.items()):
            if name in obstacles.materials:
                of_it = obstacles.material[wall] == obstacles.materials.index(name)
                if obstacles.block is not None:
                    of_it &= obstacles.block[wall]
                faces = obstacles.segments[wall[of_it]]
                loss_db = loss_db + metre_db * _inside_m(faces, lines, line[of_it])
        return loss_db


def _inside_m(faces: np.ndarray, lines: np.ndarray, line: np.ndarray) -> np.ndarray:
    """[k] m that ``lines`` [k, 4] are inside: ``faces`` [c, 4] are crossed by ``line`` [c]."""
    at_m = _crossed_at_m(faces, lines[line])
    order = np.lexsort((at_m, line))
    line, at_m = line[order], at_m[order]
    number = np.arange(len(line)) - np.searchsorted(line, line)  # of the crossing on its line
    out = np.flatnonzero(number % 2)
    return np.bincount(line[out], at_m[out] - at_m[out - 1], len(lines))


def _crossed_at_m(faces: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """[c] m from the beginning of ``lines`` [c, 4] to where they cross ``faces`` [c, 4]."""
    way, along = lines[:, 2:] - lines[:, :2], faces[:, 2:] - faces[:, :2]
    to = faces[:, :2] - lines[:, :2]
    share = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / (
        way[:, 0] * along[:, 1] - way[:, 1] * along[:, 0])  # not parallel, or there is no crossing
    return share * np.hypot(*way.T)
