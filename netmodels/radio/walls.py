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

    A wall whose top is not higher than the straight line between the antennas, where the line
    crosses it, costs nothing: at the share t of the way, the line is h1 + t (h2 - h1) high. Waves
    are not bent over edges: just above one, ITU-R P.526's knife edge costs up to 6 dB (its 4.1),
    here 0 dB, and below it walls cost no less than elsewhere.

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
                most_db: np.ndarray | None = None, heights_m: np.ndarray | None = None
                ) -> np.ndarray:
        """[k] dB on straight lines: ``lines`` [k, 4] x1 y1 x2 y2 in m. Where it is above
        ``most_db`` [k] it may be any number above that. ``heights_m`` [k, 2] of both ends: None if
        no wall is lower."""
        if not len(obstacles.segments) or not len(lines):
            return np.zeros(len(lines))
        wall_db = self._of_each_db(obstacles)
        if heights_m is None:
            return self._level_db(obstacles, lines, wall_db, most_db)
        # It matters where a line crosses the walls whose tops are between its two antennas. All
        # others are level: with them lines of one band are below the tops of the same walls.
        tops_m = np.unique(obstacles.height_m)
        low, high = np.searchsorted(tops_m, np.sort(heights_m, axis=1), "right").T
        loss_db = np.empty(len(lines))
        for band in np.unique(low[low == high]).tolist():
            those = np.flatnonzero((low == band) & (high == band))
            higher = np.searchsorted(tops_m, obstacles.height_m) >= band
            loss_db[those] = self._level_db(
                obstacles, lines[those], np.where(higher, wall_db, 0.0),
                None if most_db is None else most_db[those], heights_m[those])
        those = np.flatnonzero(low != high)
        loss_db[those] = self._slanting_db(obstacles, lines[those], wall_db, heights_m[those])
        return loss_db

    def _of_each_db(self, obstacles: ports.Obstacles) -> np.ndarray:
        """[walls] dB of each wall that is crossed."""
        by_name = CROSSING_DB | self.crossing
        crossing_db = np.array([by_name.get(name, 0.0) for name in obstacles.materials])
        per_metre_db = np.array([self.per_metre.get(name, 0.0) for name in obstacles.materials])
        return (crossing_db[obstacles.material]
                + per_metre_db[obstacles.material] * obstacles.thickness_m)

    def _level_db(self, obstacles: ports.Obstacles, lines: np.ndarray, wall_db: np.ndarray,
                  most_db: np.ndarray | None, heights_m: np.ndarray | None = None) -> np.ndarray:
        """[k] dB on lines below the tops of the same walls; ``wall_db`` of all others is 0."""
        if most_db is not None and not self.inside and (wall_db >= 0.0).all():
            return obstacles.tolls(lines, wall_db, most_db)
        return self._slanting_db(obstacles, lines, wall_db, heights_m)

    def _slanting_db(self, obstacles: ports.Obstacles, lines: np.ndarray, wall_db: np.ndarray,
                     heights_m: np.ndarray | None) -> np.ndarray:
        """[k] dB on lines by where they cross walls."""
        tops_m = obstacles.height_m
        line, wall = obstacles.crossings(lines).T
        at = _crossed_at(obstacles.segments[wall], lines[line])
        line_m = np.full(len(at), -np.inf)  # high, where it crosses
        if heights_m is not None:
            low_m, high_m = heights_m[line].T
            line_m = low_m + at * (high_m - low_m)
        loss_db = np.bincount(line, np.where(tops_m[wall] > line_m, wall_db[wall], 0.0),
                              len(lines))
        long_m = np.hypot(*(lines[:, 2:] - lines[:, :2]).T)
        for name, metre_db in sorted(self.inside.items()):
            if name in obstacles.materials:
                of_it = obstacles.material[wall] == obstacles.materials.index(name)
                if obstacles.block is not None:
                    of_it &= obstacles.block[wall]
                loss_db = loss_db + metre_db * _inside_m(
                    line[of_it], at[of_it] * long_m[line[of_it]],
                    (tops_m[wall] - line_m)[of_it], len(lines))
        return loss_db


def _inside_m(line: np.ndarray, at_m: np.ndarray, under_m: np.ndarray, lines: int) -> np.ndarray:
    """[lines] m that lines are inside of blocks: ``line`` [c] crosses a face ``at_m`` [c] from its
    beginning, ``under_m`` [c] below the block's top (negative: above it)."""
    order = np.lexsort((at_m, line))
    line, at_m, under_m = line[order], at_m[order], under_m[order]
    number = np.arange(len(line)) - np.searchsorted(line, line)  # of the crossing on its line
    out = np.flatnonzero(number % 2)
    low_m, high_m = (pick(under_m[out - 1], under_m[out]) for pick in (np.minimum, np.maximum))
    with np.errstate(invalid="ignore", divide="ignore"):  # the share of the way below the top
        share = np.where(low_m >= 0.0, 1.0, np.clip(high_m / (high_m - low_m), 0.0, 1.0))
    share = np.where(high_m <= 0.0, 0.0, share)
    return np.bincount(line[out], share * (at_m[out] - at_m[out - 1]), lines)


def _crossed_at(faces: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """[c] the share of the way of ``lines`` [c, 4] at which they cross ``faces`` [c, 4]."""
    way, along = lines[:, 2:] - lines[:, :2], faces[:, 2:] - faces[:, :2]
    to = faces[:, :2] - lines[:, :2]
    return (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / (
        way[:, 0] * along[:, 1] - way[:, 1] * along[:, 0])  # not parallel, or there is no crossing
