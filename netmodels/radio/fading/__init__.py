"""What a link gains or loses by echoes, from one moment to the next: block fading.

The power is that of a steady wave and many scattered ones: Rice's law, without a steady wave
Rayleigh's, by which the gain is exponential (Rappaport 2002, 5.6). It is the same during a block,
in both directions, and knows nothing of the block before. Blocks begin for all pairs at once. A
pair's gain is a fixed function of its hosts' names and of the block's number: so it does not matter
who else is there or who asks first.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from pydantic import Field
from scipy.special import chndtrix

from desim import ports
from desim.units import NS_PER_S, Decibels, Period, Speed
from netmodels.radio.budget import Links
from netmodels.radio.fading import kernels
from netmodels.radio.pathloss import LIGHT_MPS

_STRONGEST = 53 * math.log(2)  # of what is scattered: there are so many bits of luck
_QUANTILES = 1024


class Fading(ports.Params):
    """Beside path loss, walls and shadowing, which say what the mean is."""

    rician_k_db: Decibels | None = Field(None, description=(
        "power of the steady wave to that of the scattered ones (null: no steady wave, Rayleigh; "
        "in sight indoors 7 dB, 3GPP TR 38.901, table 7.5-6)"))
    speed_mps: Speed = Field("1.2 m/s", gt=0, description=(
        "of one end against the other, or of what moves around them (a robot; the paper's)"))
    coherence_ns: Period | None = Field(None, description=(
        "a block (9 / (16 pi speed / wavelength), Rappaport 2002, 5.4.3: 18.5 ms on channel 1 of "
        "11g)"))

    @property
    def steady(self) -> float:
        """K, not in dB."""
        return 0.0 if self.rician_k_db is None else 10 ** (self.rician_k_db / 10)

    @property
    def best_db(self) -> float:
        """The most that a link gains by it."""
        strongest = math.sqrt(self.steady) + math.sqrt(_STRONGEST)
        return 20 * math.log10(strongest) - 10 * math.log10(self.steady + 1)

    def block_ns(self, carrier_hz: float) -> int:
        """How long a block is."""
        if self.coherence_ns is not None:
            return self.coherence_ns
        doppler_hz = self.speed_mps * carrier_hz / LIGHT_MPS
        return max(round(9 / (16 * math.pi * doppler_hz) * NS_PER_S), 1)

    def gains_db(self) -> np.ndarray:
        """[k] quantiles of equal chance, ascending: a mean over them is one over all blocks."""
        share = (np.arange(_QUANTILES) + 0.5) / _QUANTILES
        return 10 * np.log10(chndtrix(share, 2, 2 * self.steady) / (2 * self.steady + 2))


class Fades:
    """The fading between ``hosts``, whose luck comes from ``stream`` by their names; a frame is
    found from ``found_dbm`` on. The present block ends at ``until_ns``."""

    def __init__(self, params: Fading, hosts: tuple[str, ...],
                 stream: Callable[..., np.random.Generator], carrier_hz: float,
                 found_dbm: float) -> None:
        self._steady, self._block_ns = params.steady, params.block_ns(carrier_hz)
        self._found_mw = 10 ** (found_dbm / 10)
        self._keys = np.array([stream("fading", host).integers(2 ** 64, dtype=np.uint64)
                               for host in hosts], np.uint64)
        self.until_ns = 0

    def links(self, mean: Links, now_ns: int) -> Links:
        """What these links are in the block that ``now_ns`` lies in."""
        block = now_ns // self._block_ns
        self.until_ns = (block + 1) * self._block_ns
        mw = np.empty(len(mean.mw))
        source = mean.source()
        kernels.gains(self._keys, source, mean.hearer, np.uint64(block), self._steady, mw)
        mw *= mean.mw
        return Links.of(source, mean.hearer, mw, mw >= self._found_mw, len(self._keys))
