"""The maps of all robots as one: who knew a cell first, and what all knew at an instant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from desim.monitor.map_growth import NEVER, TENTH_NS, MapGrowth

UNKNOWN_TO_ALL = np.iinfo(np.int32).max  # as an instant


class MergedMap(NamedTuple):
    """By cell [height, width], row 0 at the bottom: the tenths of a second from the start of the
    run until some robot knew it (int32, ``UNKNOWN_TO_ALL``: never), the index of that robot
    (int32), and whether it believed in the end that the cell is occupied (bool)."""

    known_since: np.ndarray
    discoverer: np.ndarray
    occupied: np.ndarray


def merged(growths: Sequence[MapGrowth], robots: Sequence[str]) -> MergedMap:
    """The merged map of at least one of ``growths``, which have one raster. Of robots that knew a
    cell in the same tenth of a second, it is the first in ``growths``."""
    shape = growths[0].known_since.shape
    first = MergedMap(np.full(shape, UNKNOWN_TO_ALL, np.int32), np.zeros(shape, np.int32),
                      np.zeros(shape, bool))
    number = {robot: i for i, robot in enumerate(robots)}
    for growth in growths:
        # Software that starts again with its host begins later than the run.
        since = growth.known_since.astype(np.int32) + growth.started_ns // TENTH_NS
        sooner = (growth.known_since != NEVER) & (since < first.known_since)
        first.known_since[sooner] = since[sooner]
        first.discoverer[sooner] = number[growth.robot]
        first.occupied[sooner] = growth.occupied[sooner]
    return first


def known_at(growths: Sequence[MapGrowth], time_ns: int) -> np.ndarray | None:
    """int8 [height, width] of what the maps that exist at ``time_ns`` know together: 0 free, 100
    occupied (as most of them believed at their ends), -1 unknown; None: there is no map."""
    votes: np.ndarray | None = None
    for growth in growths:
        if not growth.started_ns <= time_ns <= growth.until_ns:
            continue
        if votes is None:
            votes = np.zeros((2, *growth.occupied.shape), np.int32)
        known = growth.known_since <= min((time_ns - growth.started_ns) // TENTH_NS, NEVER - 1)
        votes[0] += known & ~growth.occupied
        votes[1] += known & growth.occupied
    if votes is None:
        return None
    free, occupied = votes
    return np.where(free + occupied == 0, -1, np.where(occupied >= free, 100, 0)).astype(np.int8)
