"""The figures of a comparison: what both sides did, in numbers beside each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from statistics import mean
from typing import NamedTuple

import numpy as np

from desim.validation.real.cell import Played

NEAR = 0.05  # the share by which real and model may differ before it is looked into
HEADER = f"{'real':>12}  {'model':>12}  {'ratio':>6}"


class Figure(NamedTuple):
    """One number of both sides. ``what``: of which row; ``quantity``: which number."""

    what: str
    quantity: str
    unit: str
    real: float
    model: float

    @property
    def ratio(self) -> float:
        """Model by real; 1 where both are zero."""
        if self.real == self.model:
            return 1.0
        return self.model / self.real if self.real else float("inf")

    @property
    def near(self) -> bool:
        """Whether the two differ by at most ``NEAR``."""
        return abs(self.ratio - 1) <= NEAR

    @property
    def line(self) -> str:
        """A row of the table under ``HEADER``."""
        return (f"{self.real:12.3f}  {self.model:12.3f}  {self.ratio:6.3f}"
                f"{'  ' if self.near else ' *'}  {self.quantity}, {self.unit}: {self.what}")


class JudgedQuantity(NamedTuple):
    """A number of the outcomes of one row, which has been played once or more on either side."""

    name: str
    unit: str
    of: Callable[[Sequence[Played]], float]


def figures(what: str, quantities: Iterable[JudgedQuantity], real: Sequence[Played],
            model: Sequence[Played]) -> Iterator[Figure]:
    """The figures of a row."""
    for name, unit, of in quantities:
        yield Figure(what, name, unit, of(real), of(model))


# Quantities of any row. ``part``: of the hosts whose names begin so (all).

def frames(part: str = "") -> JudgedQuantity:
    """The frames that hosts sent."""
    return JudgedQuantity(f"frames{_of(part)}", "a run", lambda played: mean(
        sum(sent.frames for host, sent in one.sent.items() if host.startswith(part))
        for one in played))


def kilobytes(part: str = "") -> JudgedQuantity:
    """Their bytes on the medium."""
    return JudgedQuantity(f"bytes{_of(part)}", "kB a run", lambda played: mean(
        sum(sent.size_bytes for host, sent in one.sent.items() if host.startswith(part)) / 1e3
        for one in played))


def arrived(from_s: float = 0.0) -> JudgedQuantity:
    """The messages sent from an instant on that were heard."""
    return JudgedQuantity("messages that arrived", "a run", lambda played: mean(
        sum(heard.born_s >= from_s for heard in one.heard) for one in played))


def first_heard() -> JudgedQuantity:
    """The instant of the first message."""
    return JudgedQuantity("first message", "s after the begin", lambda played: mean(
        min(heard.at_s for heard in one.heard) for one in played))


def mean_delay(from_s: float = 0.0) -> JudgedQuantity:
    """The mean time of messages sent from an instant on; NaN where none arrived."""
    return JudgedQuantity("delay, mean", "ms", lambda played: 1e3 * mean(
        _delays(played, from_s) or [float("nan")]))


def delay(percent: int, from_s: float = 0.0) -> JudgedQuantity:
    """The time that so many percent of messages do not exceed."""
    def of(played: Sequence[Played]) -> float:
        delays_s = _delays(played, from_s)
        return 1e3 * float(np.percentile(delays_s, percent)) if delays_s else float("nan")
    return JudgedQuantity(f"delay, {percent} %", "ms", of)


def heard_again(until_s: float) -> JudgedQuantity:
    """The time from the end of a cut to the first message."""
    return JudgedQuantity("heard again", "s after the cut", lambda played: mean(
        min((heard.at_s for heard in one.heard if heard.at_s > until_s), default=float("nan"))
        - until_s for one in played))


def silence() -> list[JudgedQuantity]:
    """The two ends of the longest silence between two messages."""
    def ends(played: Sequence[Played]) -> tuple[float, float]:
        gaps = [max(pairwise(sorted(heard.at_s for heard in one.heard)),
                    key=lambda gap: gap[1] - gap[0]) for one in played]
        return mean(last for last, _ in gaps), mean(again for _, again in gaps)
    return [JudgedQuantity("heard last", "s after the begin", lambda played: ends(played)[0]),
            JudgedQuantity("heard again", "s after the begin", lambda played: ends(played)[1])]


def _delays(played: Sequence[Played], from_s: float) -> list[float]:
    return [heard.late_s for one in played for heard in one.heard if heard.born_s >= from_s]


def _of(part: str) -> str:
    return f" of {part}s" if part else ""
