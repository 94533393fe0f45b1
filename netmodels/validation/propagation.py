"""Path loss, walls and packet errors against ns-3, ITU-R P.1238 and Veins.

The formulas agree to the printed digits of these references.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from desim import ports
from desim.ports.cases import Check, Play
from netmodels.radio.errors import packet_error
from netmodels.radio.path_loss import FreeSpace, Indoor, LogDistance, PathLoss
from netmodels.radio.walls import Walls

POWER_DBM = 16.0206

# m to dBm received: log-distance (exponent 3, 46.6777 dB at 1 m), free space at 5180 and 2412 MHz.
RECEIVED_DBM = {2: (-39.688, -36.7344, -30.0953), 5: (-51.6262, -44.6932, -38.0541),
                10: (-60.6571, -50.7138, -44.0747), 50: (-81.6262, -64.6932, -58.0541),
                200: (-99.688, -76.7344, -70.0953)}
_DIGITS = 0.0005

# ITU-R P.1238, an office at 2400 MHz: m to dB. (And one of ns-3's own tests: a residential building
# at 2114 MHz, two floors, 31.32 m.)
OFFICE_DB = {1: 39.60, 5: 60.57, 10: 69.60, 30: 83.92, 50: 90.57}
RESIDENTIAL_M, RESIDENTIAL_DB = float(np.hypot(30, 9)), 88.3855

# Walls crossed: dB more than without, 5 dB each.
WALLS_DB = {0: 0.0, 1: 5.0, 2: 10.0, 3: 15.0, 4: 20.0}

# Two cuts of 9 dB through 10 m of building at 0.4 dB (Sommer et al. 2011; Veins' defaults).
BUILDING_DB = 22.0

# Rate in Mb/s, signal to noise ratio in dB: chance that a frame of 1064 B has errors.
PACKET_ERRORS = {
    (6, 3.0): 0.875017302, (6, 4.0): 0.0628048882, (6, 5.0): 0.00132718018,
    (12, 6.5): 0.322856237, (12, 7.0): 0.0651026295, (12, 8.0): 0.00138605051,
    (24, 12.5): 0.825134678, (24, 13.5): 0.0733979861, (24, 14.5): 0.00224670897,
    (54, 21.5): 0.867774088, (54, 22.5): 0.102242222, (54, 23.5): 0.0042597395,
}


class Propagation:
    """Received power and losses: to the printed digits (0.0005 dB, of ITU-R P.1238 0.005 dB)."""

    source = ("ns-3.44; ITU-R P.1238; Sommer, Eckhoff, German and Dressler 2011 (Veins); walls of "
              "5 dB are a property, not a publication")

    def checks(self, play: Play) -> Iterator[Check]:
        models: dict[str, PathLoss] = {
            "log-distance": LogDistance(), "free space, 5180 MHz": FreeSpace(5.18e9),
            "free space, 2412 MHz": FreeSpace(2.412e9)}
        for distance_m, expected_dbm in RECEIVED_DBM.items():
            for (name, model), dbm in zip(models.items(), expected_dbm, strict=True):
                loss_db = float(model.loss_db(np.array(float(distance_m))))
                yield Check(f"{name}, {distance_m} m", POWER_DBM - loss_db, dbm, _DIGITS, "dBm")
        for crossed, loss_db in WALLS_DB.items():
            yield Check(f"{crossed} walls of 5 dB", _through(crossed), loss_db, _DIGITS, "dB")
        for distance_m, loss_db in OFFICE_DB.items():
            found_db = float(Indoor(2.4e9).loss_db(float(distance_m)))
            yield Check(f"office, 2400 MHz, {distance_m} m", found_db, loss_db, 10 * _DIGITS, "dB")
        found_db = float(Indoor(2.114e9, "residential", 2).loss_db(RESIDENTIAL_M))
        yield Check("residential, 2114 MHz, 2 floors", found_db, RESIDENTIAL_DB, _DIGITS, "dB")
        yield Check("10 m of building", _through_building(), BUILDING_DB, _DIGITS, "dB")


class PacketErrors:
    """Packet errors of OFDM, as in ns-3: within 1e-6."""

    source = "ns-3.44, NistErrorRateModel (Pei and Henderson 2010)"

    def checks(self, play: Play) -> Iterator[Check]:
        for (mbps, db), chance in PACKET_ERRORS.items():
            found = float(packet_error(mbps, 10 ** (db / 10), 1064))
            yield Check(f"packet errors, {mbps} Mb/s, {db} dB", found, chance, 1e-6)


def _through(crossed: int) -> float:
    """Loss in dB on a way of 23 m through ``crossed`` of four walls, 5 m from each other."""
    way_m = np.array([[5.0 * crossed + 1.0 - 23.0, 0.0, 5.0 * crossed + 1.0, 0.0]])
    walls = Walls(crossing={"plasterboard": "5 dB"})
    return float(walls.loss_db(_across(np.arange(5.0, 25.0, 5.0)), way_m)[0])


def _through_building() -> float:
    walls = Walls(crossing={"plasterboard": "9 dB"}, inside={"plasterboard": "0.4 dB"})
    return float(walls.loss_db(_across(np.array([5.0, 15.0])), np.array([[0.0, 0, 20, 0]]))[0])


def _across(x_m: np.ndarray) -> ports.Obstacles:
    """Walls across the x axis."""
    n, far = len(x_m), np.full(len(x_m), 9.0)
    return ports.Obstacles(np.stack([x_m, -far, x_m, far], axis=1), np.zeros(n, np.int64),
                           np.full(n, 0.1), np.full(n, 3.0), ("plasterboard",), 0, _crossings)


def _crossings(segments: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Of walls across the x axis and ways along it."""
    x_m = segments[:, 0]
    return np.argwhere((pairs[:, :1] < x_m) & (x_m < pairs[:, 2:3]))
