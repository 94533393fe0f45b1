"""Bit errors by signal to noise ratio: closed forms for the rates of 802.11.

OFDM: Pei and Henderson 2010, "Validation of OFDM error rate model in ns-3" (the NIST model): the
raw bit error rate of the modulation in white noise, and the union bound of a Viterbi decoder of the
K = 7 code with hard decisions. DSSS and CCK: Pei and Henderson 2009, "Validation of ns-3 802.11b
PHY model".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import erfc

# (factor, divisor) of the raw bit error rate, factor * erfc(sqrt(ratio / divisor)), of square
# constellations with Gray mapping, by coded bits per subcarrier.
_MODULATIONS = {1: (1 / 2, 1), 2: (1 / 2, 2), 4: (3 / 8, 10), 6: (7 / 24, 42), 8: (15 / 64, 170),
                10: (31 / 160, 682)}

# By code rate: input bits of a branch, least exponent and its step, and how many bits are wrong on
# all paths of that distance (Frenger, Orten, Ottosson 1998; table 1 of Pei and Henderson).
_CODES = {
    "1/2": (1, 10, 2, (36, 211, 1404, 11633, 77433, 502690, 3322763, 21292910, 134365911)),
    "2/3": (2, 6, 1, (3, 70, 285, 1276, 6160, 27128, 117019, 498860, 2103891, 8784123)),
    "3/4": (3, 5, 1, (42, 201, 1492, 10469, 62935, 379644, 2253373, 13073811, 75152755,
                      428005675)),
    "5/6": (5, 4, 1, (92, 528, 8694, 79453, 792114, 7375573, 67884974, 610875423, 5427275376,
                      47664215639)),
}

_SCHEMES = {  # by ``standards.Rate.scheme``: coded bits per subcarrier, code
    6: (1, "1/2"), 9: (1, "3/4"), 12: (2, "1/2"), 18: (2, "3/4"), 24: (4, "1/2"), 36: (4, "3/4"),
    48: (6, "2/3"), 54: (6, "3/4"), 60: (6, "5/6"), 72: (8, "3/4"), 80: (8, "5/6"),
    90: (10, "3/4"), 100: (10, "5/6"),
}

_CHIPS = 22  # bandwidth in MHz that the noise of DSSS is measured in (Pei and Henderson 2009)


def _ofdm(rate_mbps: float, ratio: np.ndarray) -> np.ndarray:
    bits, code = _SCHEMES[int(rate_mbps)]
    factor, divisor = _MODULATIONS[bits]
    branch, exponent, step, weights = _CODES[code]
    raw = factor * erfc(np.sqrt(ratio / divisor))
    distance = np.sqrt(4 * raw * (1 - raw))
    bound = sum(weight * distance ** (exponent + step * k) for k, weight in enumerate(weights))
    return np.minimum(bound / (2 * branch), 1.0)


def _dsss(rate_mbps: float, ratio: np.ndarray) -> np.ndarray:
    if rate_mbps == 1:  # differential BPSK
        return 0.5 * np.exp(-ratio * _CHIPS)
    if rate_mbps == 2:  # differential QPSK, asymptotic
        bit = np.maximum(ratio * _CHIPS / 2, 1e-12)
        factor = (np.sqrt(2) + 1) / np.sqrt(8 * np.pi * np.sqrt(2) * bit)
        return np.minimum(factor * np.exp(-(2 - np.sqrt(2)) * bit), 0.5)
    if rate_mbps == 5.5:  # CCK, fitted to the integral of the paper
        part = np.maximum(ratio - 3.3092430025608586e-3, 0.0) / 0.41654372361004
        fitted = 0.53681634344056195 * np.exp(-part ** 1.0288981434358866)
    else:
        above = (7.9056742265333456e-3 * ratio - 0.1839744939917636) * ratio + 1.0740689468707241
        below = ((ratio + 1.0523316904502553) * ratio + 0.30552298746496687) * ratio
        fitted = above / (below + 2.2032715128698435)
    return np.where(ratio > 10, 0.0, np.where(ratio < 0.1, 0.5, np.clip(fitted, 0.0, 0.5)))


def bit_error(rate_mbps: float, ratio: np.ndarray | float) -> np.ndarray:
    """Chance that a bit at ``rate_mbps`` is wrong at a signal to noise and interference ratio (not
    in dB; noise in 20 MHz, at 1 to 11 Mb/s in 22 MHz)."""
    ratio = np.asarray(ratio, dtype=float)
    return (_dsss if rate_mbps in (1, 2, 5.5, 11) else _ofdm)(rate_mbps, ratio)


def packet_error(rate_mbps: float, ratio: np.ndarray | float, size_bytes: int) -> np.ndarray:
    """Chance that at least one of ``size_bytes`` is wrong."""
    with np.errstate(divide="ignore"):
        return -np.expm1(8 * size_bytes * np.log1p(-bit_error(rate_mbps, ratio)))


class ErrorTable(NamedTuple):
    """``log_log`` [rates, k]: log(-log(chance that a bit has no error)) at ``first_db`` + j
    ``step_db``; nothing is wrong above the ratio ``clear``."""

    log_log: np.ndarray
    first_db: float
    step_db: float
    clear: float


def error_table(rates_mbps: tuple[float, ...], first_db: float = -10.0, last_db: float = 35.0,
                step_db: float = 0.025) -> ErrorTable:
    """The table for the kernels, linear in between: of a packet of 1500 B the chance of an error
    differs by less than 1e-4 from the closed form."""
    count = round((last_db - first_db) / step_db) + 1
    ratio = 10 ** ((first_db + step_db * np.arange(count)) / 10)
    with np.errstate(divide="ignore"):
        rows = [np.log(-np.log1p(-bit_error(rate, ratio))) for rate in rates_mbps]
    return ErrorTable(np.ascontiguousarray(np.clip(rows, -100.0, 5.0)), first_db, step_db,
                      10 ** (last_db / 10))
