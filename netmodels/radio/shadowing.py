"""Log-normal shadowing: the loss by obstacles that the terrain does not have, and by echoes.

It belongs to places, not to robots: links whose ends are near to each other share it. In dB it is
normal, and two links have exp(-(way between their beginnings + way between their ends) /
``correlation``) in common (Gudmundson 1991, "Correlation model for shadow fading in mobile radio
systems", for one end that moves; Wang, Tameh and Nix 2008 for two: the product).

``echoes`` are the fading of places: a robot that stands keeps its gain, and half a wavelength
farther there is another. Over a way d of one end their correlation is J0(2 pi d / wavelength)^2
(Clarke 1968, of the power of echoes from all around; Akki and Haber 1986 for two ends: the
product). In dB they are normal, too: a Wi-Fi signal is as wide as several independent fades.

Each part is a fixed function of two places, a sum of plane waves over the place of each end: f(x,
y) = sigma sqrt(2 / n) sum cos(k_j . x + q_j . y + phase_j), whose wave numbers have the spectrum of
its correlation r(d) in the plane. Both directions are alike by (f(x, y) + f(y, x)) / sqrt(2 + 2
r(|x - y|)^2), whose variance is that of f: so much do the two have in common. So a place that is
visited again is as it was, no matter which hosts there are or in which order they ask.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
from pydantic import Field
from scipy.special import j0

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
    echoes_db: Decibels = Field("0 dB", ge=0, description=(
        "standard deviation of what echoes add, another value every half wavelength (none; presets "
        "indoor: 3.1 dB, outdoor: 2.3 dB)"))

    @property
    def best_db(self) -> float:
        """The most that a link gains by it."""
        return LIMIT * math.hypot(self.sigma_db, self.echoes_db)


class PlaneWaves:
    """A standard normal function of two places, a sum of plane waves with ``numbers`` [2 ends][2,
    waves] rad/m and ``phases`` [waves], whose correlation over a way in m is ``correlation``."""

    def __init__(self, sigma_db: float, numbers: list[np.ndarray], phases: np.ndarray,
                 correlation: Callable[[np.ndarray], np.ndarray]) -> None:
        self._sigma_db, self._numbers, self._phases = sigma_db, numbers, phases
        self._correlation = correlation

    def ends(self, places: np.ndarray) -> np.ndarray:
        """[2 ends, places, 2 waves] the waves at ``places`` [n, 2] m."""
        near, far = self._at(places, 0, 0.0), self._at(places, 1, self._phases)
        near[:, _WAVES:] *= -1  # cos(a + b) = cos a cos b - sin a sin b
        return np.stack([near, far])

    def loss_db(self, ends: np.ndarray, one: np.ndarray, other: np.ndarray,
                apart_m: np.ndarray) -> np.ndarray:
        """[k] dB between the places ``one`` and ``other`` [k] of ``ends``, ``apart_m`` [k] m from
        each other."""
        near, far = ends
        total = np.empty(len(one))
        for k in range(0, len(one), _CHUNK):
            a, b = one[k:k + _CHUNK], other[k:k + _CHUNK]
            total[k:k + _CHUNK] = (np.einsum("ij,ij->i", near[a], far[b])
                                   + np.einsum("ij,ij->i", near[b], far[a]))
        alike = self._correlation(apart_m) ** 2  # of one direction and the other
        total *= self._sigma_db * np.sqrt(2 / _WAVES) / np.sqrt(2 + 2 * alike)
        return total

    def _at(self, places: np.ndarray, end: int, phases: np.ndarray | float) -> np.ndarray:
        """[places, 2 waves] cosines and sines of one end's share of the waves."""
        wave_x, wave_y = self._numbers[end]
        angle = places[:, :1] * wave_x + places[:, 1:] * wave_y + phases
        return np.hstack([np.cos(angle), np.sin(angle)])


class Shadows:
    """The shadowing between ``hosts``, whose waves are ``wave_m`` long. Its random numbers, and
    those of hosts without a place, come from ``stream`` by name."""

    def __init__(self, params: Shadowing, hosts: tuple[str, ...],
                 stream: Callable[..., np.random.Generator], wave_m: float) -> None:
        self.best_db = params.best_db
        self._parts = []
        if params.sigma_db:
            self._parts.append(_obstacles(params, stream("shadowing")))
        if params.echoes_db:
            self._parts.append(_echoes(params, stream("echoes"), 2 * np.pi / wave_m))
        self._hosts, self._stream = hosts, stream
        # The last places of the hosts, and the waves there: those of a host that stands remain.
        self._places = np.full((len(hosts), 2), np.nan)
        self._ends = [np.empty((2, len(hosts), 2 * _WAVES)) for _ in self._parts]

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
        moved = np.flatnonzero((places != self._places).any(axis=1))
        if len(moved):
            self._places[moved] = places[moved]
            for part, ends in zip(self._parts, self._ends, strict=True):
                ends[:, moved] = part.ends(places[moved])
        return self._loss_db(places, self._ends, one, other)

    def between_db(self, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
        """[n] dB between places ``from_m`` [2] m and ``to_m`` [n, 2] m."""
        loss_db = np.empty(len(to_m))
        for k in range(0, len(to_m), _POINTS):
            places = np.vstack([from_m, to_m[k:k + _POINTS]])
            other = np.arange(1, len(places))
            loss_db[k:k + _POINTS] = self._loss_db(
                places, [part.ends(places) for part in self._parts], np.zeros_like(other), other)
        return loss_db

    def _loss_db(self, places: np.ndarray, ends: list[np.ndarray], one: np.ndarray,
                 other: np.ndarray) -> np.ndarray:
        total, apart_m = np.zeros(len(one)), np.hypot(*(places[one] - places[other]).T)
        for part, waves in zip(self._parts, ends, strict=True):
            total += part.loss_db(waves, one, other, apart_m)
        return np.clip(total, -self.best_db, self.best_db)


def _obstacles(params: Shadowing, draw: np.random.Generator) -> PlaneWaves:
    """Of correlation exp(-d / ``correlation``). The share of wave numbers up to k is 1 - 1 / sqrt(1
    + (k correlation)^2), the spectrum of that in the plane."""
    numbers = []
    for _ in range(2):
        share, turn = _even(draw)
        wave, angle = np.sqrt((1 - share) ** -2 - 1), 2 * np.pi * turn
        numbers.append(np.array([wave * np.cos(angle), wave * np.sin(angle)])
                       / params.correlation_m)
    return PlaneWaves(params.sigma_db, numbers, draw.uniform(0, 2 * np.pi, _WAVES),
                      lambda apart_m: np.exp(-apart_m / params.correlation_m))


def _echoes(params: Shadowing, draw: np.random.Generator, number: float) -> PlaneWaves:
    """Of correlation J0(``number`` d)^2: sums of two waves of length ``number`` rad/m from
    directions that have nothing to do with each other."""
    numbers = []
    for _ in range(2):
        angles = 2 * np.pi * _even(draw)
        numbers.append(number * np.array([np.cos(angles).sum(axis=0), np.sin(angles).sum(axis=0)]))
    return PlaneWaves(params.echoes_db, numbers, draw.uniform(0, 2 * np.pi, _WAVES),
                      lambda apart_m: j0(number * apart_m) ** 2)


def _even(draw: np.random.Generator) -> np.ndarray:
    """[2, waves] numbers from 0 to 1 that are spread evenly, each row in an order of its own."""
    return (draw.permuted(np.tile(np.arange(_WAVES), (2, 1)), axis=1)
            + draw.uniform(size=(2, _WAVES))) / _WAVES
