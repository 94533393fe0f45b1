"""Who hears whom, and how well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim import ports
from netmodels.radio.pathloss import PathLoss
from netmodels.radio.walls import Walls


class Links(NamedTuple):
    """Station i is heard by ``hearer[first[i]:first[i + 1]]`` with ``mw``. ``audible`` [hosts,
    hosts] bool: whether a frame of one can be found by another."""

    first: np.ndarray
    hearer: np.ndarray
    mw: np.ndarray
    audible: list[list[bool]]


class Budget(NamedTuple):
    """What is sent, what is lost on the way, and from which power on it is heard and found."""

    power_dbm: float
    path_loss: PathLoss
    walls: Walls | None
    heard_dbm: float
    found_dbm: float

    def links(self, places: np.ndarray, obstacles: ports.Obstacles) -> Links:
        """``places`` [hosts, 2] m. A host without a place hears nobody, and nobody hears it, unless
        the loss does not depend on places."""
        n = len(places)
        one, other = np.triu_indices(n, 1)
        apart = places[one] - places[other]
        loss_db = self.path_loss.loss_db(np.sqrt(np.einsum("ij,ij->i", apart, apart)))
        near = np.flatnonzero(self.power_dbm - loss_db > self.heard_dbm)  # NaN is not
        one, other, loss_db = one[near], other[near], loss_db[near]
        if self.walls is not None:
            loss_db += self._walls_db(places[one], places[other], obstacles)
        dbm = np.full((n, n), -np.inf)
        dbm[one, other] = dbm[other, one] = self.power_dbm - loss_db
        source, hearer = np.nonzero(dbm > self.heard_dbm)
        first = np.searchsorted(source, np.arange(n + 1))
        return Links(first, hearer, 10 ** (dbm[source, hearer] / 10),
                     (dbm >= self.found_dbm).tolist())

    def _walls_db(self, starts: np.ndarray, ends: np.ndarray,
                  obstacles: ports.Obstacles) -> np.ndarray:
        """NaN, of hosts without a place, is in nobody's way."""
        placed = np.isfinite(starts).all(axis=1) & np.isfinite(ends).all(axis=1)
        loss_db = np.zeros(len(starts))
        loss_db[placed] = self.walls.loss_db(obstacles, np.hstack([starts, ends])[placed])
        return loss_db
