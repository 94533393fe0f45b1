"""A meter: it measures one thing in a run, and gives its part of the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from desim.monitor.samples import Sample
from desim.robot.mapping.robot_map import RobotMap

T = TypeVar("T")

Due = Callable[[str], bool]  # is the column of this name due now?
Listener = Callable[[str, int, int, int], object]  # host, a, b, c of a row of the trace


class Second(NamedTuple):
    """The truth at an instant: ``poses`` [robots, 3] x m, y m, yaw rad, ``travelled_m`` [robots],
    and ``linked`` [n, n] bool, whether frames get from one of the explorers that are up to another
    one (None: between all)."""

    now_ns: int
    poses: np.ndarray
    travelled_m: np.ndarray
    linked: np.ndarray | None


class Meter:
    """A meter has those of these methods that it needs: the others give nothing. ``listeners`` get
    the rows of the trace of their kinds."""

    listeners: Mapping[str, Listener] = {}

    def watch(self, robot: str, robot_map: RobotMap | None, now_ns: int) -> None:
        """``robot`` has a fresh map (its software started), or none (its host stopped)."""

    def each_second(self, second: Second) -> None:
        """A full second has passed."""

    def quantities(self, now_ns: int) -> Sample:
        """The present values for expressions, numbers; each is a column of samples.parquet, too.
        Their names stand in ``scenario/schema/experiment.py``."""
        return {}

    def sample(self, now_ns: int, due: Due) -> Sample:
        """The other columns of samples.parquet. What is not ``due`` is left out there."""
        return {}

    def track(self, second: Second) -> Sample:
        """Columns of robots.parquet at this instant: [robots], or [explorers], by name."""
        return {}

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """The part of ``robots`` and ``hosts`` in summary.json, by name of host."""
        return {}

    def summary(self, now_ns: int) -> Sample:
        """The part of summary.json of a run until now."""
        return {}


def merged(parts: Iterable[Mapping[str, T]]) -> dict[str, T]:
    """All that ``parts`` have, in their order."""
    return {name: value for part in parts for name, value in part.items()}


def both(first: Listener | None, second: Listener) -> Listener:
    """A listener that calls ``first``, if there is one, and ``second``."""
    return second if first is None else lambda *row: (first(*row), second(*row))
