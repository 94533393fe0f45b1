"""Whether a frame gets over a link while nobody else is on the air."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from netmodels.radio.dcf.stations import Reception
from netmodels.radio.errors import bit_error
from netmodels.radio.fading import Fading
from netmodels.radio.standards import Standard

_WEAKEST_DBM, _STRONGEST_DBM = -200.0, 100.0  # all that radios receive is in between
# Steps of 0.1 dB: with ten times as many, a mean delivery under fading differs by 4e-5.
_LEVELS_DBM = np.linspace(_WEAKEST_DBM, _STRONGEST_DBM, 3001)


def delivery(power_dbm: np.ndarray | float, standard: Standard, rate: int, psdu_bytes: int,
             reception: Reception) -> np.ndarray:
    """Chance that a frame of ``psdu_bytes`` at ``rates[rate]``, sent once, is found and has no
    error where it comes in with ``power_dbm`` (any shape): what the stations' kernels do with a
    signal that nothing interferes with.

    (1 - b_header)^header bits * (1 - b_payload)^payload bits, with b the bit errors at this ratio
    to the noise, from as strong a signal on as a preamble is found at.
    """
    power_dbm = np.asarray(power_dbm, float)
    above_db = power_dbm - reception.noise_dbm
    ratio = 10 ** (above_db / 10)
    how, lowest = standard.rates[rate], standard.rates[standard.lowest(rate)]
    header_bits = (how.payload_ns - how.header_ns) * 1e-3 * lowest.mbps
    payload_bits = (standard.airtime_ns(psdu_bytes, rate) - how.payload_ns) * 1e-3 * how.mbps
    with np.errstate(divide="ignore"):  # where a bit is never right
        right = np.exp(header_bits * np.log1p(-bit_error(lowest.mbps, ratio))
                       + payload_bits * np.log1p(-bit_error(how.scheme, ratio)))
    found = (power_dbm >= reception.preamble_dbm) & (above_db >= reception.preamble_db)
    return np.where(found, right, 0.0)


def mean_delivery(power_dbm: np.ndarray | float, standard: Standard, rate: int, psdu_bytes: int,
                  reception: Reception, fading: Fading | None) -> np.ndarray:
    """The same where ``power_dbm`` is a mean that fades: over all gains."""
    if fading is None:
        return delivery(power_dbm, standard, rate, psdu_bytes, reception)
    shares = _faded(standard, rate, psdu_bytes, reception, fading)
    return np.interp(np.nan_to_num(power_dbm, nan=_WEAKEST_DBM), _LEVELS_DBM, shares)


@lru_cache
def _faded(standard: Standard, rate: int, psdu_bytes: int, reception: Reception,
           fading: Fading) -> np.ndarray:
    """At each of the levels."""
    steady = delivery(_LEVELS_DBM, standard, rate, psdu_bytes, reception)
    return np.interp(_LEVELS_DBM[:, None] + fading.gains_db(), _LEVELS_DBM, steady).mean(axis=1)


def sensitivity_dbm(share: float, standard: Standard, rate: int, psdu_bytes: int,
                    reception: Reception, tries: int = 1, fading: Fading | None = None) -> float:
    """The least power that ``share`` of all frames get through with, of which each is sent up to
    ``tries`` times: 1 - (1 - delivery)^tries. A mean power if it fades, in blocks that are longer
    than all the tries take."""
    gains_db = fading.gains_db() if fading else np.zeros(1)
    weak_dbm, strong_dbm = _WEAKEST_DBM, _STRONGEST_DBM
    while strong_dbm - weak_dbm > 1e-9:
        middle_dbm = (weak_dbm + strong_dbm) / 2
        lost = (1 - delivery(middle_dbm + gains_db, standard, rate, psdu_bytes, reception)) ** tries
        if 1 - lost.mean() >= share:
            strong_dbm = middle_dbm
        else:
            weak_dbm = middle_dbm
    return strong_dbm
