"""What a radio wave loses on its way through the open: dB by distance.

Each model has ``loss_db(distance_m)``, on arrays of any shape, and never gains: where the formula
of the far field would, closer to the antenna than it holds, the loss is 0 dB. Where the distance is
unknown (NaN) so is the loss.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Carrier, Decibels, Length

LIGHT_MPS = 299_792_458.0
_NEAREST_M = 1e-3
_FARTHEST_M = 1e9


class FreeSpace(ports.Params):
    """(4 pi d / lambda)^2 (Friis 1946), isotropic antennas."""

    model: Literal["free_space"] = Field(description="by this name")
    frequency_hz: Carrier = Field(description="of the carrier: 2412 MHz is channel 1 of 11b and "
                                              "11g, 5180 MHz channel 36 of 11a")

    def loss_db(self, distance_m: np.ndarray) -> np.ndarray:
        wave_m = LIGHT_MPS / self.frequency_hz
        distance_m = np.maximum(distance_m, _NEAREST_M)
        return np.maximum(20 * np.log10(4 * np.pi * distance_m / wave_m), 0.0)


class LogDistance(ports.Params):
    """reference + 10 exponent log10(d / 1 m) (Rappaport 2002, 4.9.1); within 1 m, that of 1 m."""

    model: Literal["log_distance"] = Field("log_distance", description="by this name")
    exponent: float = Field(3.0, gt=0, le=20, description="2 in the open, more among things (ns-3)")
    reference_db: Decibels = Field("46.6777 dB", description="loss of the first metre (ns-3: free "
                                                             "space at 5.15 GHz)")

    def loss_db(self, distance_m: np.ndarray) -> np.ndarray:
        return self.reference_db + 10 * self.exponent * np.log10(np.maximum(distance_m, 1.0))


class TwoRay(ports.Params):
    """d^4 / height^4 (Rappaport 2002, 4.6) where the ray that the ground reflects is as good as
    opposite to the direct one: beyond 4 pi height^2 / lambda, where free space loses as much."""

    model: Literal["two_ray"] = Field(description="by this name")
    frequency_hz: Carrier = Field(description="of the carrier, e.g. 2412 MHz")
    height_m: Length = Field("1 m", gt=0, description="of all antennas (on top of a robot)")

    def loss_db(self, distance_m: np.ndarray) -> np.ndarray:
        near = FreeSpace(model="free_space", frequency=f"{self.frequency_hz!r} Hz")
        far_m = 4 * np.pi * self.height_m ** 2 * self.frequency_hz / LIGHT_MPS
        ground_db = 40 * np.log10(np.maximum(distance_m, _NEAREST_M) / self.height_m)
        return np.where(np.asarray(distance_m) > far_m, ground_db, near.loss_db(distance_m))


class Fixed(ports.Params):
    """The same at any distance, and between hosts that have no place."""

    model: Literal["fixed"] = Field(description="by this name")
    loss: Decibels = Field(description="between any two hosts")

    def loss_db(self, distance_m: np.ndarray) -> np.ndarray:
        return np.full(np.shape(distance_m), self.loss)


PathLoss = Annotated[FreeSpace | LogDistance | TwoRay | Fixed, Field(discriminator="model")]


def reach_m(path_loss: PathLoss, budget_db: float) -> float:
    """The distance at which the loss exceeds ``budget_db``; inf if none is far enough."""
    near_m, far_m = _NEAREST_M, _FARTHEST_M
    if path_loss.loss_db(np.array(far_m)) <= budget_db:
        return float("inf")
    while far_m / near_m > 1 + 1e-9:
        middle_m = (near_m * far_m) ** 0.5
        if path_loss.loss_db(np.array(middle_m)) <= budget_db:
            near_m = middle_m
        else:
            far_m = middle_m
    return far_m
