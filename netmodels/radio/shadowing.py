"""Log-normal shadowing: the loss by obstacles that the terrain does not have.

It belongs to places, not to robots: links whose ends are near to each other share it. In dB it is
normal, and two links have exp(-(way between their beginnings + way between their ends) /
``correlation``) in common (Gudmundson 1991, "Correlation model for shadow fading in mobile radio
systems", for one end that moves; Wang, Tameh and Nix 2008 for two: the product).

It is a fixed function of two places, a sum of plane waves over the place of each end: f(x, y) =
sigma sqrt(2 / n) sum cos(k_j . x + q_j . y + phase_j), whose wave numbers have the spectrum of that
correlation in the plane. Both directions are alike by (f(x, y) + f(y, x)) / sqrt(2 + 2 exp(-2 |x -
y| / correlation)), whose variance is that of f: so much do the two have in common. So a place that
is visited again is as it was, no matter which hosts there are or in which order they ask. """

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Decibels, Length

# Tuned: the distribution is 0.004 off the normal one; +-20 % changes that by 0.0015 at most.
_WAVES = 128
_CHUNK = 128  # links at a time, whose cosines and sines (262 kB an end) stay in a cache
_POINTS = 4096  # places at a time, of many: at most 17 MB
_FAR_M = 1e6  # distance of hosts without a place from all others, and from each other
LIMIT = 3  # sigmas; so that there is a distance beyond which no signal is heard


class Shadowing(ports.Params):
    """Parameters of shadowing, a gain or loss of at most three sigma beside path loss and walls."""

    sigma_db: Decibels = Field("4.3 dB", description="standard deviation (Gudmundson 1991, urban)")
    correlation_m: Length = Field("8.3 m", gt=0, description=(
        "distance that takes the correlation to 1/e (Gudmundson 1991, urban: 0.3 at 10 m)"))

    @property
    def best_db(self) -> float:
        """The most that a link gains by it."""
        return LIMIT * self.sigma_db


class Shadows:
    """The shadowing between ``hosts``. Its random numbers, and those of hosts without a place, come
    from ``stream`` by name."""

    def __init__(self, params: Shadowing, hosts: tuple[str, ...],
                 stream: Callable[..., np.random.Generator]) -> None:
        self._sigma_db, self.best_db = params.sigma_db, params.best_db
        self._correlation_m = params.correlation_m
        draw = stream("shadowing")
        self._waves = [_wave_numbers(draw) / params.correlation_m for _ in range(2)]
        self._phases = draw.uniform(0, 2 * np.pi, _WAVES)
        self._hosts, self._stream = hosts, stream

    @cached_property
    def _somewhere(self) -> np.ndarray:
        """[hosts, 2] m, for those who have no place."""
        return np.array([self._stream("shadowing", host).uniform(-_FAR_M, _FAR_M, 2)
                         for host in self._hosts]).reshape(-1, 2)

    def loss_db(self, places: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """[k] dB between hosts ``one`` and ``other`` [k] (indices) at ``places`` [hosts, 2] m.
        Those without a place are somewhere else each."""
        unknown = np.isnan(places)
        if unknown.any():
            places = np.where(unknown, self._somewhere, places)
        return self._loss_db(places, one, other)

    def between_db(self, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
        """[n] dB between places ``from_m`` [2] m and ``to_m`` [n, 2] m."""
        loss_db = np.empty(len(to_m))
        for k in range(0, len(to_m), _POINTS):
            places = np.vstack([from_m, to_m[k:k + _POINTS]])
            other = np.arange(1, len(places))
            loss_db[k:k + _POINTS] = self._loss_db(places, np.zeros_like(other), other)
        return loss_db

    def _loss_db(self, places: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        near, far = self._at(places, 0, 0.0), self._at(places, 1, self._phases)
        near[:, _WAVES:] *= -1  # cos(a + b) = cos a cos b - sin a sin b
        total = np.empty(len(one))
        for k in range(0, len(one), _CHUNK):
            a, b = one[k:k + _CHUNK], other[k:k + _CHUNK]
            total[k:k + _CHUNK] = (np.einsum("ij,ij->i", near[a], far[b])
                                   + np.einsum("ij,ij->i", near[b], far[a]))
        apart_m = np.hypot(*(places[one] - places[other]).T)
        alike = np.exp(-2 * apart_m / self._correlation_m)  # of one direction and the other
        total *= self._sigma_db * np.sqrt(2 / _WAVES) / np.sqrt(2 + 2 * alike)
        return np.clip(total, -self.best_db, self.best_db)

    def _at(self, places: np.ndarray, end: int, phases: np.ndarray | float) -> np.ndarray:
        """[places, 2 waves] cosines and sines of one end's share of the waves."""
        wave_x, wave_y = self._waves[end]
        angle = places[:, :1] * wave_x + places[:, 1:] * wave_y + phases
        return np.hstack([np.cos(angle), np.sin(angle)])


def _wave_numbers(draw: np.random.Generator) -> np.ndarray:
    """[2, waves] x, y for a correlation distance of 1. The share up to k is 1 - 1 / sqrt(1 + k^2),
    the spectrum of exp(-distance) in the plane; lengths and directions are spread evenly."""
    share, turn = (draw.permuted(np.tile(np.arange(_WAVES), (2, 1)), axis=1)
                   + draw.uniform(size=(2, _WAVES))) / _WAVES
    wave, angle = np.sqrt((1 - share) ** -2 - 1), 2 * np.pi * turn
    return np.array([wave * np.cos(angle), wave * np.sin(angle)])
