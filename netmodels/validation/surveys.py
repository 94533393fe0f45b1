"""Presets of the radio against what was measured in rooms, and against 3GPP's table of a street.

Feng, Nguyen and Luo measured signals of 14 access points at 342 places 0.6 m apart in three rooms,
60 times each. Their powers are means of these; their residuals are those of a fit by log-distance,
one for each room. Ours are measured in the same way, in rooms as large, from what
``desim coverage`` predicts.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.distance import pdist, squareform
from scipy.special import j0

from desim.ports.cases import Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.path_loss import LIGHT_MPS

# The least and the most of the three rooms: a lecture theatre and an office (links in sight), and a
# corridor (links out of sight, whose exponent is not one in sight).
EXPONENT = 1.6, 2.0
SIGMA_DB = 3.5, 4.2
CORRELATION = {(0.59, 0.61): (0.19, 0.31), (0.9, 1.8): (0.10, 0.29), (1.8, 3.0): (0.04, 0.25),
               (3.0, 5.0): (0.0, 0.18)}  # by m between two places
TWO_LINKS = 0.0, 0.08  # of one place

STREET_EXPONENT, STREET_SIGMA_DB, STREET_M = 2.1, 4.0, 10.0
STREET_ECHOES_DB = 2.3  # of a steady wave that is 9 dB above them

# m: width and depth, and where access points are.
_ROOMS = (((15.0, 14.5), ((1.8, 5.4), (6.0, 5.4), (11.3, 5.4), (1.8, 12.6), (11.4, 12.6))),
          ((18.0, 5.5), ((0.6, 3.0), (6.6, -0.6), (9.0, 3.6), (12.0, -0.6), (15.0, 3.0))),
          ((35.0, 6.0), ((1.2, 4.5), (10.2, 4.1), (22.8, 5.4), (28.8, 3.0))))
_GRID_M = 0.6
_SEEDS = range(1, 11)
_WAVE_M = LIGHT_MPS / 2.412e9
_HALF_A_DECIBEL = 0.5
_STANDS_NS = 60 * NS_PER_S


class RadioInRooms:
    """The preset ``indoor``, means of ten seeds: exponent, sigma and correlations between the least
    and the most of three rooms. A robot that stands for a minute keeps its signal, within 0.5 dB;
    the echoes half a wavelength away are others (J0(pi)^2, within 0.05)."""

    source = ("Feng, Nguyen and Luo 2024, doi:10.5281/zenodo.11558792: 3 rooms, 14 access points, "
              "1569 links; Clarke 1968")

    def checks(self, play: Play) -> Iterator[Check]:
        rooms = np.mean([_survey(_radio(play, seed, preset="indoor"), *room)
                         for seed in _SEEDS for room in _ROOMS], axis=0)
        exponent, sigma_db, two_links, *correlations = rooms
        yield _between("exponent in sight", exponent, EXPONENT)
        yield _between("sigma", sigma_db, SIGMA_DB, "dB")
        for (bin_m, range_), found in zip(CORRELATION.items(), correlations, strict=True):
            yield _between(f"correlation, {bin_m[0]:g} to {bin_m[1]:g} m", found, range_)
        yield _between("correlation of two links of a place", two_links, TWO_LINKS)
        yield Check("lost by a robot that stands for a minute", _lost_in_a_minute(play), 0.0, 0.0)
        echoes = {"sigma": "0 dB"}
        yield Check("correlation of echoes half a wavelength away",
                    _alike(play, _WAVE_M / 2, preset="indoor", shadowing=echoes),
                    float(j0(np.pi)) ** 2, 0.05)


class RadioInAStreet:
    """The preset ``outdoor``: exponent within 0.05, sigma within 5 %, correlations within 0.05."""

    source = "3GPP TR 38.901, UMi street canyon, LOS: tables 7.4.1-1 and 7.5-6"

    def checks(self, play: Play) -> Iterator[Check]:
        sigma_db = float(np.hypot(STREET_SIGMA_DB, STREET_ECHOES_DB))
        loss_db = [_losses(play, seed, 0.0, preset="outdoor")[0] for seed in _SEEDS]
        yield Check("outdoors: sigma", float(np.std(loss_db)), sigma_db, 0.05 * sigma_db, "dB")
        for way_m in (5.0, STREET_M, 20.0):
            yield Check(f"outdoors: correlation, {way_m:g} m",
                        _alike(play, way_m, preset="outdoor"),
                        (STREET_SIGMA_DB / sigma_db) ** 2 * float(np.exp(-way_m / STREET_M)), 0.05)
        radio = _radio(play, 1, preset="outdoor", shadowing=None)
        near_dbm, far_dbm = radio.signal(np.zeros(2), np.array([[10.0, 0], [100.0, 0]])).power_dbm
        yield Check("outdoors: exponent", (near_dbm - far_dbm) / 10, STREET_EXPONENT, 0.05)


def _survey(radio: DcfRadio, size_m: tuple[float, float],
            access_points: tuple[tuple[float, float], ...]) -> tuple[float, ...]:
    """The fit's exponent and sigma in dB, the correlation of two links of one place, and that of
    two places at each of the distances."""
    places = np.stack(np.meshgrid(*(np.arange(0.0, side_m, _GRID_M) for side_m in size_m)),
                      axis=-1).reshape(-1, 2)
    from_m = np.array(access_points)
    power_dbm = np.array([radio.signal(at_m, places).power_dbm for at_m in from_m])
    decades = np.log10(np.maximum(np.hypot(*(places - from_m[:, None]).transpose(2, 0, 1)), 1.0))
    slope, at_1_m_dbm = np.polyfit(decades.ravel(), power_dbm.ravel(), 1)
    rest_db = power_dbm - (slope * decades + at_1_m_dbm)
    variance = rest_db.var()
    between = squareform(rest_db @ rest_db.T / len(places), checks=False)
    together = squareform(rest_db.T @ rest_db / len(from_m), checks=False)
    apart_m = pdist(places)
    return (-slope / 10, rest_db.std(), between.mean() / variance,
            *(together[(low_m <= apart_m) & (apart_m <= high_m)].mean() / variance
              for low_m, high_m in CORRELATION))


def _between(what: str, found: float, range_: tuple[float, float], unit: str = "") -> Check:
    least, most = range_
    return Check(what, float(found), (least + most) / 2, (most - least) / 2, unit)


def _radio(play: Play, seed: int, **params: object) -> DcfRadio:
    """A radio that has started."""
    radio = DcfRadio(DcfRadio.Params(**params))
    flow = Flow("a", ("b",), 100, 100, "zero", NS_PER_S, broadcast=True)
    play(Setup(radio, {"a": (0.0, 0.0), "b": (1.0, 0.0)}, [flow], NS_PER_S), seed=seed)
    return radio


def _losses(play: Play, seed: int, way_m: float, **params: object) -> np.ndarray:
    """[2, 900] dB beside path loss at places 100 m apart, and ``way_m`` beside each, of a sender
    far away."""
    radio, far_m = _radio(play, seed, **params), np.array([1e5, 1e5])
    line_m = 100.0 * np.arange(30)
    at_m = np.stack(np.meshgrid(line_m, line_m), axis=-1).reshape(-1, 2)
    both = np.stack([at_m, at_m + [way_m, 0.0]])
    loss_db = radio.params.loss().loss_db(np.hypot(*(both - far_m).transpose(2, 0, 1)))
    return np.stack([radio.params.power_dbm - radio.signal(far_m, where).power_dbm
                     for where in both]) - loss_db


def _alike(play: Play, way_m: float, **params: object) -> float:
    """The correlation of the losses of places ``way_m`` apart."""
    both = np.concatenate([_losses(play, seed, way_m, **params) for seed in _SEEDS], axis=1)
    return float(np.corrcoef(both)[0, 1])


def _lost_in_a_minute(play: Play) -> float:
    """The share of broadcasts that do not arrive, where a preamble is found down to 0.5 dB below
    the first one's power."""
    here, there = (0.0, 0.0), (7.0, 3.0)
    first_dbm = float(_radio(play, 1, preset="indoor").signal(
        np.array(here), np.array([there])).power_dbm[0])
    radio = DcfRadio(DcfRadio.Params(
        preset="indoor", reception={"preamble": f"{first_dbm - _HALF_A_DECIBEL} dBm"}))
    flow = Flow("a", ("b",), 100, 100, "zero", NS_PER_S // 10, broadcast=True)
    return float(play(Setup(radio, {"a": here, "b": there}, [flow], _STANDS_NS))["loss"])
