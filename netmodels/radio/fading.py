"""Fading: what a link gains or loses by echoes, from one moment to the next.

The power is that of a steady wave and many scattered ones: Rice's law, without a steady wave
Rayleigh's, by which the gain is exponential (Rappaport 2002, 5.6). It goes up and down as Clarke
found (1968): echoes come from all directions, and fades are as frequent and as long as Rice's
formulas say (Rappaport 2002, 5.5.3). Or it holds for a block and knows nothing of the one before.
It is the same in both directions. A pair's gain is a fixed function of its hosts' names and of the
time: other hosts and the order of questions do not matter.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from pydantic import Field
from scipy.special import chndtrix

from desim import ports
from desim.units import NS_PER_S, Decibels, Period, Speed
from netmodels.radio import kernels
from netmodels.radio.budget import RadioLinks
from netmodels.radio.path_loss import LIGHT_MPS

_STRONGEST = 53 * math.log(2)  # of what is scattered: the draw has 53 bits
_QUANTILES = 1024  # tuned: a mean delivery is off by 2e-4; +-20 % changes it by less than 1e-4
_WAVES = 32  # scattered ones of a pair: the law's distribution function is off by 0.004 at most
_STEP = 0.01  # of a period of the Doppler frequency; a fade of 20 dB lasts 4 of them on average
_COSINES = np.cos(2 * np.pi * (np.arange(4096) + 0.5) / 4096)


class Fading(ports.Params):
    """Parameters of fading, around the mean by path loss, walls and shadowing."""

    rician_k_db: Decibels | None = Field(None, description=(
        "power of the steady wave to that of the scattered ones (null: no steady wave, Rayleigh; "
        "in sight indoors 7 dB, 3GPP TR 38.901, table 7.5-6)"))
    speed_mps: Speed = Field("1.2 m/s", gt=0, description=(
        "of one end against the other, or of what moves around them (a robot; the paper's)"))
    coherence_ns: Period | None = Field(None, description=(
        "a block, for which the gain holds; then comes one that has nothing to do with it (null: "
        "no blocks, but Clarke's fades)"))

    @property
    def steady(self) -> float:
        """K, not in dB."""
        return 0.0 if self.rician_k_db is None else 10 ** (self.rician_k_db / 10)

    @property
    def best_db(self) -> float:
        """The most that a link gains by it."""
        scattered = _STRONGEST if self.coherence_ns else _WAVES
        strongest = math.sqrt(self.steady) + math.sqrt(scattered)
        return 20 * math.log10(strongest) - 10 * math.log10(self.steady + 1)

    def of(self, hosts: tuple[str, ...], stream: Callable[..., np.random.Generator],
           carrier_hz: float, found_dbm: float) -> Fades:
        """The fading between ``hosts``, with random numbers from ``stream`` by their names; a frame
        is found from ``found_dbm`` on."""
        keys = np.array([stream("fading", host).integers(2 ** 64, dtype=np.uint64)
                         for host in hosts], np.uint64)
        found_mw = 10 ** (found_dbm / 10)
        if self.coherence_ns is not None:
            return Blocks(keys, self.steady, self.coherence_ns, found_mw)
        return Echoes(keys, self.steady, self.speed_mps * carrier_hz / LIGHT_MPS, found_mw)

    def gains_db(self) -> np.ndarray:
        """[k] quantiles of equal chance, ascending: a mean over them is one over all blocks."""
        share = (np.arange(_QUANTILES) + 0.5) / _QUANTILES
        return 10 * np.log10(chndtrix(share, 2, 2 * self.steady) / (2 * self.steady + 2))


class Fades(ABC):
    """The fading between hosts with ``keys``. Gains hold for a step; the present one ends at
    ``until_ns``."""

    def __init__(self, keys: np.ndarray, steady: float, step_ns: int, found_mw: float) -> None:
        self._keys, self._steady, self._found_mw = keys, steady, found_mw
        self.step_ns = step_ns
        self.until_ns = 0

    def links(self, mean: RadioLinks, now_ns: int) -> RadioLinks:
        """The links with their gains of the step that ``now_ns`` lies in."""
        step = now_ns // self.step_ns
        self.until_ns = (step + 1) * self.step_ns
        mw = self._gains(mean, step)
        mw *= mean.mw
        return RadioLinks.of(mean.source(), mean.hearer, mw, mw >= self._found_mw, len(self._keys))

    @abstractmethod
    def _gains(self, mean: RadioLinks, step: int) -> np.ndarray:
        """[k] power gains of these links."""


class Blocks(Fades):
    """Block fading: each step's gain has nothing to do with that of the one before."""

    def _gains(self, mean: RadioLinks, step: int) -> np.ndarray:
        gains = np.empty(len(mean.mw))
        kernels.gains(self._keys, mean.source(), mean.hearer, np.uint64(step), self._steady, gains)
        return gains


class Echoes(Fades):
    """Clarke's fading, with a maximum Doppler frequency of ``doppler_hz``; the steady wave has
    none."""

    def __init__(self, keys: np.ndarray, steady: float, doppler_hz: float, found_mw: float) -> None:
        super().__init__(keys, steady, max(round(NS_PER_S * _STEP / doppler_hz), 1), found_mw)
        self._turns = doppler_hz * self.step_ns / NS_PER_S
        self._mean: RadioLinks | None = None

    def _gains(self, mean: RadioLinks, step: int) -> np.ndarray:
        if mean is not self._mean:
            self._mean = mean
            self._start, self._rate = np.empty((2, len(mean.mw), _WAVES), np.uint64)
            kernels.waves(self._keys, mean.source(), mean.hearer, self._turns, self._start,
                          self._rate)
        gains = np.empty(len(mean.mw))
        kernels.echoes(self._start, self._rate, np.uint64(step), self._steady, _COSINES, gains)
        return gains
