"""Path loss: dB that a radio wave loses in the open, by distance.

Each model has ``loss_db(distance_m)``, on arrays of any shape, and never gains: where the formula
of the far field would, closer to the antenna than it holds, the loss is 0 dB. Where the distance is
unknown (NaN) so is the loss.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from typing import Literal, Protocol

import numpy as np
from pydantic import Field, model_validator

from desim import ports
from desim.units import Carrier, Decibels, Length

LIGHT_MPS = 299_792_458.0
_NEAREST_M = 1e-3  # antennas are no nearer
_FARTHEST_M = 1e9  # a reach beyond this is infinite
# In two rooms 1.6 and 2.0 (Feng, Nguyen and Luo 2024, doi:10.5281/zenodo.11558792).
CLEAR_EXPONENT = 1.8


Distance = np.ndarray | float


class PathLoss(Protocol):
    """A model of path loss."""

    def loss_db(self, distance_m: Distance) -> np.ndarray:
        """dB at each distance."""


@dataclass(frozen=True)
class FreeSpace:
    """(4 pi d / lambda)^2 (Friis 1946), isotropic antennas."""

    frequency_hz: float

    def loss_db(self, distance_m: Distance) -> np.ndarray:
        wave_m = LIGHT_MPS / self.frequency_hz
        distance_m = np.maximum(distance_m, _NEAREST_M)
        return np.maximum(20 * np.log10(4 * np.pi * distance_m / wave_m), 0.0)


@dataclass(frozen=True)
class LogDistance:
    """Log-distance path loss: reference + 10 exponent log10(d / 1 m) (Rappaport 2002, 4.9.1).
    Within 1 m it is that of 1 m. The class's own defaults are ns-3's; a radio replaces
    ``reference`` by free space on its channel (``PathLossParams.chosen``)."""

    exponent: float = 3.0
    reference_db: float = 46.6777

    def loss_db(self, distance_m: Distance) -> np.ndarray:
        return self.reference_db + 10 * self.exponent * np.log10(np.maximum(distance_m, 1.0))


@dataclass(frozen=True)
class TwoRay:
    """d^4 / height^4 (Rappaport 2002, 4.6) where the ray that the ground reflects is as good as
    opposite to the direct one: beyond 4 pi height^2 / lambda, where free space loses as much."""

    frequency_hz: float
    height_m: float = 1.0

    def loss_db(self, distance_m: Distance) -> np.ndarray:
        far_m = 4 * np.pi * self.height_m ** 2 * self.frequency_hz / LIGHT_MPS
        free_db = FreeSpace(self.frequency_hz).loss_db(distance_m)
        ground_db = 40 * np.log10(np.maximum(distance_m, _NEAREST_M) / self.height_m)
        return np.where(np.asarray(distance_m) > far_m, ground_db, free_db)


@dataclass(frozen=True)
class Fixed:
    """The same at any distance, and between hosts that have no place."""

    total_db: float

    def loss_db(self, distance_m: Distance) -> np.ndarray:
        return np.full(np.shape(distance_m), self.total_db)


# By kind of building: dB that a decade of distance loses (at 1.8 to 2 GHz), the first floor in
# between, and each further one (ITU-R P.1238; as in ns-3).
_BUILDINGS = {"residential": (28.0, 4.0, 4.0), "office": (30.0, 15.0, 4.0),
              "commercial": (22.0, 6.0, 3.0)}


@dataclass(frozen=True)
class Indoor:
    """20 log10(f / 1 MHz) + N log10(d / 1 m) + Lf(n) - 28 (ITU-R P.1238): walls and furniture of a
    kind of building are in N, so that those that are drawn should cost nothing beside (``walls:
    null``). N = 28, 30, 22 and Lf = 4 n, 15 + 4 (n - 1), 6 + 3 (n - 1) for residential, office and
    commercial buildings. Within 1 m, that of 1 m."""

    frequency_hz: float
    building: str = "office"
    floors: int = 0

    def loss_db(self, distance_m: Distance) -> np.ndarray:
        decade_db, first_db, further_db = _BUILDINGS[self.building]
        floors_db = first_db + further_db * (self.floors - 1) if self.floors else 0.0
        return np.maximum(20 * np.log10(self.frequency_hz / 1e6) + floors_db - 28
                          + decade_db * np.log10(np.maximum(distance_m, 1.0)), 0.0)


_MODELS = {"free_space": FreeSpace, "log_distance": LogDistance, "two_ray": TwoRay, "fixed": Fixed,
           "itu_p1238": Indoor}


class PathLossParams(ports.Params):
    """A model by its name, and its parameters."""

    model: Literal["free_space", "log_distance", "two_ray", "fixed", "itu_p1238"] = Field(
        "log_distance", description="(ns-3)")
    exponent: float | None = Field(None, gt=0, le=20, description=(
        "of log_distance (1.8, in sight, where walls are drawn and cost something: they are what "
        "makes it larger; else 3, ns-3; more among things that are not drawn)"))
    reference_db: Decibels | None = Field(None, description=(
        "of log_distance, loss of the first metre (that of free space on the radio's channel: 40.1 "
        "dB on channel 1 of 11b and 11g, 46.7 dB on channel 36 of 11a; preset ns3_3_44: 46.6777 "
        "dB, at 5.15 GHz, for all)"))
    frequency_hz: Carrier | None = Field(None, description=(
        "of free_space, two_ray and itu_p1238: 2412 MHz is channel 1 of 11b and 11g, 5180 MHz "
        "channel 36 of 11a (none, it has to be given)"))
    height_m: Length | None = Field(None, gt=0, description=(
        "of two_ray, of all antennas (1 m: on top of a robot)"))
    total_db: Decibels | None = Field(None, description=(
        "of fixed, between any two hosts (none, it has to be given)"))

    building: Literal["residential", "office", "commercial"] | None = Field(None, description=(
        "of itu_p1238, its kind (office)"))
    floors: int | None = Field(None, ge=0, le=100, description=(
        "of itu_p1238, between any two hosts (0: all are on the same one)"))

    def _given(self) -> dict[str, object]:
        """The parameters that are set, without the model's name."""
        return {name: value for name, value in self if value is not None and name != "model"}

    @model_validator(mode="after")
    def _fits(self) -> PathLossParams:
        own = fields(_MODELS[self.model])
        given, known = self._given(), [ports.yaml_key(field.name) for field in own]
        for name in given:
            if ports.yaml_key(name) not in known:
                raise ValueError(f"{self.model} has no {ports.yaml_key(name)}; it has "
                                 f"{', '.join(known)}")
        for field in own:
            if field.default is MISSING and field.name not in given:
                raise ValueError(f"{self.model} needs {ports.yaml_key(field.name)}")
        return self

    def beside_walls(self) -> PathLossParams:
        """The same where walls are drawn: unless one is given, the exponent is that in sight."""
        if self.model != "log_distance" or self.exponent is not None:
            return self
        return self.model_copy(update={"exponent": CLEAR_EXPONENT})

    def chosen(self, carrier_hz: float | None = None) -> PathLoss:
        """The path loss of a radio on ``carrier_hz``. Unless ``reference`` is given, the first
        metre loses what it does in free space (Friis 1946)."""
        given = self._given()
        if self.model == "log_distance" and carrier_hz is not None:
            given.setdefault("reference_db", float(FreeSpace(carrier_hz).loss_db(1.0)))
        model: Callable[..., PathLoss] = _MODELS[self.model]
        return model(**given)


def reach_m(path_loss: PathLoss, budget_db: float) -> float:
    """The distance at which the loss exceeds ``budget_db``; inf if none is far enough."""
    near_m, far_m = _NEAREST_M, _FARTHEST_M
    if path_loss.loss_db(np.array(far_m)) <= budget_db:
        return math.inf
    while far_m / near_m > 1 + 1e-9:
        middle_m = math.sqrt(near_m * far_m)
        if path_loss.loss_db(np.array(middle_m)) <= budget_db:
            near_m = middle_m
        else:
            far_m = middle_m
    return far_m
