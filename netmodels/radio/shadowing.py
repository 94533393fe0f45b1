"""What things that nobody has drawn cost a link: log-normal shadowing.

In dB it is normal, and correlated along a robot's way by exp(-distance / ``correlation``)
(Gudmundson 1991, "Correlation model for shadow fading in mobile radio systems"); where both ends
move, by the product of the two (Wang, Tameh and Nix 2008 for links between mobiles).

It is a fixed function of two places, a sum of plane waves over the place of each end:
sigma sqrt(2 / n) sum cos(k_j . x + q_j . y + phase_j), whose wave numbers have the spectrum of that
correlation in the plane, and whose phases belong to the two hosts. So a place that is visited again
is as it was, both directions are alike, and it does not matter who else is there or who asks first.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Decibels, Length

_WAVES = 64
_CHUNK = 256  # links at a time: what is gathered for them stays in the cache
LIMIT = 3  # sigmas; so that there is a distance beyond which nobody is heard


class Shadowing(ports.Params):
    """Beside path loss and walls: at most three times sigma better or worse than they say."""

    sigma_db: Decibels = Field("4.3 dB", description="standard deviation (Gudmundson 1991, urban)")
    correlation_m: Length = Field("8.3 m", gt=0, description=(
        "distance that takes the correlation to 1/e (Gudmundson 1991, urban: 0.3 at 10 m)"))

    @property
    def best_db(self) -> float:
        """The most that a link gains by it."""
        return LIMIT * self.sigma_db


class Shadows:
    """The shadowing between ``hosts``, whose luck comes from ``stream`` by their names."""

    def __init__(self, params: Shadowing, hosts: tuple[str, ...],
                 stream: Callable[..., np.random.Generator]) -> None:
        self._sigma_db, self.best_db = params.sigma_db, params.best_db
        draw = stream("shadowing")
        self._waves = [_wave_numbers(draw) / params.correlation_m for _ in range(2)]
        self._phases = np.array([stream("shadowing", host).uniform(0, 2 * np.pi, (2, _WAVES))
                                 for host in hosts]).reshape(len(hosts), 2, _WAVES)

    def loss_db(self, places: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """[k] dB between hosts ``one`` and ``other`` [k] (indices, ``one`` the smaller) at
        ``places`` [hosts, 2] m; those without a place stand at the origin."""
        near, far = (self._at(np.nan_to_num(places), end) for end in (0, 1))
        near[:, _WAVES:] *= -1  # cos(a + b) = cos a cos b - sin a sin b
        total = np.empty(len(one))
        for k in range(0, len(one), _CHUNK):
            those = slice(k, k + _CHUNK)
            np.einsum("ij,ij->i", near[one[those]], far[other[those]], out=total[those])
        return np.clip(self._sigma_db * np.sqrt(2 / _WAVES) * total, -self.best_db, self.best_db)

    def _at(self, places: np.ndarray, end: int) -> np.ndarray:
        """[hosts, 2 waves] cosines and sines of one end's share of the waves."""
        wave_x, wave_y = self._waves[end]
        angle = places[:, :1] * wave_x + places[:, 1:] * wave_y + self._phases[:, end]
        return np.hstack([np.cos(angle), np.sin(angle)])


def _wave_numbers(draw: np.random.Generator) -> np.ndarray:
    """[2, waves] x, y for a correlation distance of 1. The share up to k is 1 - 1 / sqrt(1 + k^2),
    the spectrum of exp(-distance) in the plane; lengths and directions are spread evenly."""
    share, turn = (draw.permuted(np.tile(np.arange(_WAVES), (2, 1)), axis=1)
                   + draw.uniform(size=(2, _WAVES))) / _WAVES
    wave, angle = np.sqrt((1 - share) ** -2 - 1), 2 * np.pi * turn
    return np.array([wave * np.cos(angle), wave * np.sin(angle)])
