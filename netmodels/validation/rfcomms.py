"""Gazebo's radio with the settings of the SubT Challenge: what its formulas make of distances."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from desim.ports.cases import Check, Play
from netmodels.compatible.gz_rfcomms import RfParams, delivery, deviation_db, received_dbm

# Beside the defaults (40 dB, exponent 2.5, sigma 10, -90 dBm): those of SubT's worlds.
WORLDS = {"range": "500 m", "power": "20 dBm"}

# Of 1500 B, by m: without sigma, with its root (Gazebo until pull request 1743, and SubT) and with
# sigma itself; each with an error for each byte and for each bit.
DELIVERY = {
    50: ((1.0, 1.0), (1.0, 1.0), (0.9745, 0.9667)),
    100: ((1.0, 1.0), (0.9999, 0.9996), (0.8853, 0.8608)),
    200: ((1.0, 1.0), (0.9177, 0.8496), (0.6742, 0.6303)),
    300: ((0.5994, 0.0167), (0.5160, 0.3700), (0.5051, 0.4575)),
    400: ((0.0, 0.0), (0.1788, 0.0963), (0.3826, 0.3378)),
    500: ((0.0, 0.0), (0.0478, 0.0198), (0.2945, 0.2545)),
}
_SIGMAS: dict[str, dict[str, str]] = {
    "no sigma": {"sigma": "0 dB"}, "root of sigma": {"sigma_is": "variance"}, "sigma": {}}
_DIGITS = 6e-5  # half of the last printed one, and what the sum below leaves out


class RadioOfGazebo:
    """Delivery of messages by distance: to the printed digits (0.00006)."""

    source = "formulas of gz-sim, src/systems/rf_comms, and of osrf/subt"

    def checks(self, play: Play) -> Iterator[Check]:
        for distance_m, rows in DELIVERY.items():
            for (name, sigma), chances in zip(_SIGMAS.items(), rows, strict=True):
                for errors, chance in zip(("bytes", "bits"), chances, strict=True):
                    params = RfParams(**WORLDS, **sigma, errors=errors)
                    yield Check(f"1500 B, {distance_m} m, {name}, {errors}",
                                _expected(params, distance_m), chance, _DIGITS)


def _expected(params: RfParams, distance_m: float) -> float:
    """The chance of 1500 B, over the normal distribution of the power that they come in with."""
    mean_dbm = received_dbm(params, np.array([float(distance_m)]), np.array([params.exponent]))
    off = np.linspace(-8, 8, 40_001)  # standard deviations
    weight = np.exp(-off ** 2 / 2)
    chance = delivery(params, mean_dbm + deviation_db(params) * off, 1500)
    return float(np.sum(weight * chance) / np.sum(weight))
