"""Entries of the leaderboard: a strategy in a terrain, over a network, with so many robots."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from desim.campaign.design.columns import DESIM
from desim.campaign.design.reference import ReferenceDesign
from desim.errors import InputError
from desim.ports import natural_key
from desim.report.campaign import formatting
from desim.report.campaign.numbers import TIMES, Estimates, Study
from desim.report.campaign.numbers.estimates import Estimate

_UNKNOWN = "–"
_TIME = re.compile(rf"(> )?([\d.]+)(?: \(([\d.]+|{_UNKNOWN}) to ([\d.]+|{_UNKNOWN})\))?")


class MedianTime(NamedTuple):
    """A median time (s) and its interval: infinite, from 0 to infinity where they are unknown."""

    median: float
    low: float
    high: float


class LeaderboardEntry(NamedTuple):
    """A row of the leaderboard, as text: place, median exploration time (s) with its 95 % interval;
    the number of runs, of those that did not reach the aim, of those that failed; means of the
    other runs; version of desim and hash of its source."""

    terrain: str
    network: str
    robots: str
    strategy: str
    time: str
    runs: str
    late: str
    failed: str
    way: str
    quality: str
    sent: str
    desim: str

    @property
    def group(self) -> tuple[str, str, str]:
        """The place without the strategy: entries of a group compete."""
        return self.terrain, self.network, self.robots

    @property
    def order(self) -> tuple[object, ...]:
        """A key that sorts entries: by group, the fastest first."""
        return *map(natural_key, self.group), self.times.median, natural_key(self.strategy)

    @property
    def times(self) -> MedianTime:
        """The numbers of ``time``."""
        found = _TIME.fullmatch(self.time)
        longer, median, low, high = found.groups() if found else (None, None, None, None)
        return MedianTime(math.inf if longer or not median else float(median),
                          float(low) if low and low != _UNKNOWN else 0.0,
                          float(high) if high and high != _UNKNOWN else math.inf)


def entries(study: Study, reference: ReferenceDesign) -> list[LeaderboardEntry]:
    """The entries of a campaign, one for each vector. Raises ``InputError`` if no run has finished.
    """
    if TIMES[0] not in study.metrics:
        raise InputError(f"{study.folder}: none of its runs has finished")
    estimates, desim, found = Estimates(study), study.text(DESIM), []
    for vector in study.vectors:
        names = reference.names({axis.name: " ".join(axis.label(vector).split())
                                 for axis in study.axes.values()})
        time = estimates.of(TIMES[0], vector)
        way, quality, sent = (estimates.of(name, vector).mean if study.has(name) else None
                              for name in ("exploration_cost_m", "map_quality", "bytes_on_air"))
        found.append(LeaderboardEntry(
            **names, time=_time(time), runs=str(time.runs), late=str(time.late),
            failed=str(time.failed), way=formatting.number(way, 4),
            quality=formatting.number(quality, 4),
            sent=formatting.number(None if sent is None else sent / 1e6, 3),
            desim=", ".join(dict.fromkeys(desim[vector.rows]))))
    return found


def _time(found: Estimate) -> str:
    """``96.4 (95.2 to 98)``, or ``> 2000`` where half of the runs did not get there."""
    if found.times is None:
        return _UNKNOWN
    median = found.times.median
    text = f"> {found.times.limit:.1f}" if median.value is None else f"{median.value:.1f}"
    if median.low is None and median.high is None:
        return text
    low, high = (_UNKNOWN if bound is None else f"{bound:.1f}" for bound in median[1:])
    return f"{text} ({low} to {high})"
