"""The link budget of radios: who hears whom, at which power."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from desim import ports
from netmodels.radio.body_loss import BodyLoss
from netmodels.radio.path_loss import PathLoss, reach_m
from netmodels.radio.shadowing import Shadows
from netmodels.radio.walls import Walls

_LIGHT_M_PER_NS = 0.299792458
_SLACK_DB = 1e-6  # far above rounding


class RadioLinks(NamedTuple):
    """The links between stations. Station i is heard by ``hearer[first[i]:first[i + 1]]``
    (ascending) with ``mw``; its frames can be received by ``finder[begin[i]:begin[i + 1]]``."""

    first: np.ndarray
    hearer: np.ndarray
    mw: np.ndarray
    begin: list[int]
    finder: np.ndarray

    @classmethod
    def of(cls, source: np.ndarray, hearer: np.ndarray, mw: np.ndarray, clear: np.ndarray,
           hosts: int) -> RadioLinks:
        """Links from ``source`` [k], ascending, to ``hearer`` [k]; frames can be received where
        ``clear`` [k] is true."""
        first, begin = (np.searchsorted(those, np.arange(hosts + 1))
                        for those in (source, source[clear]))
        return cls(first, hearer, mw, begin.tolist(), hearer[clear])

    def source(self) -> np.ndarray:
        """[k] the station that is heard, for each of ``hearer``."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    def finders(self, station: int) -> list[int]:
        """The stations that can receive a frame of ``station``, ascending."""
        return self.finder[self.begin[station]:self.begin[station + 1]].tolist()

    def delays_ns(self, places: np.ndarray) -> np.ndarray:
        """[k] the propagation delay of each signal; 0 where places are not known."""
        apart_m = np.hypot(*(places[self.source()] - places[self.hearer])[:, :2].T)
        return np.nan_to_num(np.rint(apart_m / _LIGHT_M_PER_NS)).astype(np.int32)


class PairLosses(NamedTuple):
    """The losses between pairs of stations: ``one`` and ``other`` [k] indices, ``loss_db`` [k]."""

    one: np.ndarray
    other: np.ndarray
    loss_db: np.ndarray


class Signals(NamedTuple):
    """The signals of stations ``source`` [k], ascending, at ``hearer`` [k]: ``mw`` [k], and whether
    they are strong enough to be received, ``clear`` [k]."""

    source: np.ndarray
    hearer: np.ndarray
    mw: np.ndarray
    clear: np.ndarray


@dataclass(frozen=True)
class Budget:
    """The parameters of a link budget. A frame is heard (as interference) from ``heard_dbm`` on and
    can be received from ``found_dbm`` on, by hosts on the same of ``channels`` [hosts]. Hosts with
    ``antennas`` of their own send and receive with these; ``power_dbm`` is that of the others."""

    power_dbm: float
    path_loss: PathLoss
    walls: Walls | None
    shadows: Shadows | None
    heard_dbm: float
    found_dbm: float
    channels: np.ndarray
    antennas: ports.Antennas
    bodies: BodyLoss | None = None

    @cached_property
    def sent_dbm(self) -> np.ndarray:
        """[hosts] sent, antennas included."""
        own_dbm, gain_db = self.antennas.power_dbm, self.antennas.gain_db
        return np.where(np.isnan(own_dbm), self.power_dbm, own_dbm) + gain_db

    @cached_property
    def strongest_dbm(self) -> float:
        """Sent by any host, with the antenna of any receiver."""
        return float(self.sent_dbm.max(initial=-np.inf)
                     + self.antennas.gain_db.max(initial=0.0))

    def links(self, places: np.ndarray, obstacles: ports.Obstacles) -> RadioLinks:
        """The links between hosts at ``places`` [hosts, 2] m. A host without a place hears nobody,
        and nobody hears it, unless the loss does not depend on places. Hosts that are too far away
        cost nothing."""
        return self.on_channels(self.signals(self.losses(places, obstacles)))

    def losses(self, places: np.ndarray, obstacles: ports.Obstacles) -> PairLosses:
        """The losses between hosts at ``places`` [hosts, 2] m that can hear each other, on
        whatever channels they are."""
        best_db = self.shadows.best_db if self.shadows else 0.0
        one, other = self._pairs(places, best_db)
        height_m, gain_db = self.antennas.height_m, self.antennas.gain_db
        apart, above_m = places[one] - places[other], height_m[one] - height_m[other]
        loss_db = self.path_loss.loss_db(
            np.sqrt(np.einsum("ij,ij->i", apart, apart) + above_m ** 2))
        best_dbm = np.maximum(self.sent_dbm[one] + gain_db[other],
                              self.sent_dbm[other] + gain_db[one])
        near = np.flatnonzero(best_dbm + best_db - loss_db > self.heard_dbm)  # NaN is not near
        one, other, loss_db = one[near], other[near], loss_db[near]
        if self.shadows is not None:
            loss_db += self.shadows.loss_db(places, one, other)
        if self.walls is not None:
            # What is weaker than can be heard may be as weak as it likes.
            most_db = best_dbm[near] - self.heard_dbm - loss_db + _SLACK_DB
            loss_db += _walls_db(self.walls, places[one], places[other], obstacles, most_db,
                                 np.column_stack([height_m[one], height_m[other]]))
        if self.bodies is not None and obstacles.people is not None:
            loss_db += self.bodies.loss_db(
                obstacles.people, np.hstack([places[one], places[other]]),
                np.column_stack([height_m[one], height_m[other]]))
        return PairLosses(one, other, loss_db)

    def signals(self, losses: PairLosses) -> Signals:
        """The signals of ``losses`` that can be heard, on whatever channels hosts are."""
        one, other, loss_db = losses
        source, hearer = np.concatenate([one, other]), np.concatenate([other, one])
        dbm = (self.sent_dbm[source] + self.antennas.gain_db[hearer]
               - np.concatenate([loss_db, loss_db]))
        heard = np.flatnonzero(dbm > self.heard_dbm)
        heard = heard[np.argsort(source[heard] * len(self.channels) + hearer[heard])]
        source, hearer, dbm = source[heard], hearer[heard], dbm[heard]
        return Signals(source, hearer, 10 ** (dbm / 10), dbm >= self.found_dbm)

    def on_channels(self, signals: Signals) -> RadioLinks:
        """The links of ``signals`` between hosts that are on one channel now."""
        alike = self.channels[signals.source] == self.channels[signals.hearer]
        return RadioLinks.of(signals.source[alike], signals.hearer[alike], signals.mw[alike],
                             signals.clear[alike], len(self.channels))

    def link_dbm(self, sender: int, receiver: int, ends_m: np.ndarray,
                 obstacles: ports.Obstacles) -> np.ndarray:
        """[1] dBm of one host at another, at ``ends_m`` [2, 2] m."""
        heights_m = self.antennas.height_m[[sender, receiver]]
        return self.received_dbm(ends_m[0], ends_m[1:], obstacles, heights_m) + (
            self.sent_dbm[sender] + self.antennas.gain_db[receiver] - self.power_dbm)

    def powers_dbm(self, losses: PairLosses) -> np.ndarray:
        """[hosts, hosts] dBm of each host at each other one, on whatever channels they are; -inf
        where it cannot be heard, and at the host itself."""
        one, other, loss_db = losses
        power_dbm = np.full((len(self.channels), len(self.channels)), -np.inf)
        power_dbm[one, other] = self.sent_dbm[one] + self.antennas.gain_db[other] - loss_db
        power_dbm[other, one] = self.sent_dbm[other] + self.antennas.gain_db[one] - loss_db
        return power_dbm

    def received_dbm(self, from_m: np.ndarray, to_m: np.ndarray, obstacles: ports.Obstacles,
                     heights_m: np.ndarray | None = None) -> np.ndarray:
        """[n] dBm at ``to_m`` [n, 2] m of a sender at ``from_m`` [2] m, with the medium's antennas;
        ``heights_m`` [2] of sender and receivers: lower than all walls if they are not given."""
        starts = np.broadcast_to(from_m, to_m.shape)
        low_m, high_m = (0.0, 0.0) if heights_m is None else heights_m
        loss_db = self.path_loss.loss_db(
            np.hypot(np.hypot(*(to_m - starts).T), high_m - low_m))
        if self.shadows is not None:
            loss_db = loss_db + self.shadows.between_db(from_m, to_m)
        if self.walls is not None:
            loss_db = loss_db + _walls_db(
                self.walls, starts, to_m, obstacles,
                heights_m=None if heights_m is None else np.tile(heights_m, (len(to_m), 1)))
        if self.bodies is not None and obstacles.people is not None:
            loss_db = loss_db + self.bodies.loss_db(
                obstacles.people, np.hstack([starts, to_m]),
                np.tile((low_m, high_m), (len(to_m), 1)))
        return self.power_dbm - loss_db

    def _pairs(self, places: np.ndarray, best_db: float) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of hosts that may hear each other, the smaller index first."""
        heard_m = reach_m(self.path_loss, self.strongest_dbm + best_db - self.heard_dbm)
        if heard_m == math.inf:
            return np.triu_indices(len(places), 1)
        placed = np.flatnonzero(np.isfinite(places).all(axis=1))
        near = cKDTree(places[placed]).query_pairs(1.000001 * heard_m, output_type="ndarray")
        return placed[near[:, 0]], placed[near[:, 1]]


def _walls_db(walls: Walls, starts: np.ndarray, ends: np.ndarray,
              obstacles: ports.Obstacles, most_db: np.ndarray | None = None,
              heights_m: np.ndarray | None = None) -> np.ndarray:
    """[k] dB of the walls between ``starts`` and ``ends`` [k, 2] m; none where a place is NaN.
    ``most_db`` and ``heights_m`` as in ``Walls.loss_db``."""
    placed = np.isfinite(starts).all(axis=1) & np.isfinite(ends).all(axis=1)
    loss_db = np.zeros(len(starts))
    loss_db[placed] = walls.loss_db(obstacles, np.hstack([starts, ends])[placed],
                                    None if most_db is None else most_db[placed],
                                    None if heights_m is None else heights_m[placed])
    return loss_db
