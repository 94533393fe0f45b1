"""Two runs side by side: keys of their scenarios, metrics, and when their robots part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from desim.results.file_names import POSES, ROBOTS, SCENARIO, SUMMARY
from desim.results.row import flat
from desim.results.run import Run, readable
from desim.results.seal import Json
from desim.results.shown import InNotebooks
from desim.scenario import yaml12
from desim.units import NS_PER_S

_TURNED_RAD = 0.5e-3  # half of a recorded step: pi and -pi, rounded, are one heading
_Track = tuple[np.ndarray, np.ndarray]  # time_ns [n], pose [n, 3] of one robot: x m, y m, yaw rad


class KeyDifference(NamedTuple):
    """A key that two files have with different values; None where one lacks it."""

    key: str
    first: object
    second: object


class MetricPair(NamedTuple):
    """A metric of two runs, or its means over the runs of two campaigns; None where unknown."""

    name: str
    first: float | str | None
    second: float | str | None

    @property
    def difference(self) -> float | None:
        """The second value minus the first; None unless both are numbers."""
        one, other = self.first, self.second
        return other - one if isinstance(one, int | float) and isinstance(other, int | float) \
            else None

    @property
    def percent(self) -> float | None:
        """The difference as a share of the first value; None where that is zero."""
        change, one = self.difference, self.first
        return 100.0 * change / abs(one) if change is not None and isinstance(one, int | float) \
            and one else None

    @property
    def is_equal(self) -> bool:
        return self.first == self.second

    def json_object(self) -> Json:
        """The metric as an object for ``--json``."""
        return {"name": self.name, "first": self.first, "second": self.second,
                "difference": self.difference, "percent": self.percent}


class Parting(NamedTuple):
    """The first instant at which a robot is at another place than in the other run, or turned
    otherwise (``apart_m`` 0)."""

    time_s: float
    robot: str
    apart_m: float


class ComparedRuns(InNotebooks):
    """Two runs side by side; everything is computed when it is asked for. Raises ``InputError``
    where a run is damaged."""

    def __init__(self, first: Run, second: Run) -> None:
        self.first, self.second = first, second

    @cached_property
    def keys(self) -> list[KeyDifference]:
        """The keys of the resolved scenarios that differ, in the order of the first one."""
        return different_keys(*(_written(run)
                                for run in (self.first, self.second)))

    @cached_property
    def metrics(self) -> list[MetricPair]:
        """The numbers and words of both summaries, equal ones too, without those by topic. There
        are none where a run has failed."""
        if self.failed:
            return []
        one, other = (flat(run.metrics) for run in (self.first, self.second))
        return [MetricPair(name, one.get(name), other.get(name)) for name in {**one, **other}
                if not name.startswith("messages_by_topic_")]

    @cached_property
    def parted(self) -> Parting | None:
        """The first instant at which a robot that both have is elsewhere; None where they never
        part, or have no instant in common. In steps of the recorded poses (0.1 s), of a second
        where one run has not kept them."""
        one, other = self._ways
        return min(filter(None, (_parting(name, one[name], other[name])
                                 for name in one if name in other)), default=None)

    @cached_property
    def robots(self) -> tuple[frozenset[str], frozenset[str]]:
        """The names of each run's robots."""
        one, other = self._ways
        return frozenset(one), frozenset(other)

    @cached_property
    def _ways(self) -> tuple[dict[str, _Track], dict[str, _Track]]:
        """The way of each robot, by its name, in both runs."""
        runs = self.first, self.second
        read = _poses if all(run.has(POSES) for run in runs) else _places
        one, other = (read(run) if run.has(ROBOTS) else {} for run in runs)
        return one, other

    @property
    def failed(self) -> list[Run]:
        """The runs that have left no metrics."""
        return [run for run in (self.first, self.second) if not run.has(SUMMARY)]

    @property
    def is_same(self) -> bool:
        """Whether everything that happened is the same: both digests are."""
        one, other = (run.manifest["digest"] for run in (self.first, self.second))
        return one is not None and one == other

    def json_object(self) -> Json:
        """The comparison as an object for ``--json``."""
        return {"first": str(self.first.path), "second": str(self.second.path),
                "status": [run.manifest["status"] for run in (self.first, self.second)],
                "same_digest": self.is_same, "keys": [key._asdict() for key in self.keys],
                "metrics": [pair.json_object() for pair in self.metrics],
                "parted": self.parted._asdict() if self.parted else None}

    def __repr__(self) -> str:
        return f"ComparedRuns({str(self.first.path)!r}, {str(self.second.path)!r})"


def _written(run: Run) -> Mapping[str, object]:
    text = run.content(SCENARIO)
    with readable(run.path / SCENARIO):
        return yaml12.parse(text.decode(), f"{run.path / SCENARIO}")[0]


def different_keys(first: Mapping[str, object], second: Mapping[str, object],
                   ) -> list[KeyDifference]:
    """The leaves of two nested mappings that differ, by dotted path."""
    one, other = dict(_leaves(first)), dict(_leaves(second))
    return [KeyDifference(key, one.get(key), other.get(key)) for key in {**one, **other}
            if one.get(key) != other.get(key)]


def _leaves(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict) and value:
        for key, below in value.items():
            yield from _leaves(below, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        for i, below in enumerate(value):
            yield from _leaves(below, f"{path}.{i}")
    else:
        yield path, value


def _poses(run: Run) -> dict[str, _Track]:
    return _tracks(run.table("poses"), "time_ns", ("x_mm", "y_mm", "yaw_mrad"), 1, 1e-3)


def _places(run: Run) -> dict[str, _Track]:
    return _tracks(run.robots, "time_s", ("x_m", "y_m", "yaw_rad"), NS_PER_S, 1.0)


def _tracks(rows: Mapping[str, np.ndarray], time: str, pose: tuple[str, ...], ns: int, unit: float,
            ) -> dict[str, _Track]:
    times_ns = np.rint(rows[time] * ns).astype(np.int64)
    poses = np.column_stack([rows[name] * unit for name in pose])
    return {name: (times_ns[own], poses[own]) for name in dict.fromkeys(rows["robot"].tolist())
            for own in (rows["robot"] == name,)}


def _parting(robot: str, one: _Track, other: _Track) -> Parting | None:
    times_ns, i, j = np.intersect1d(one[0], other[0], return_indices=True)
    apart = one[1][i] - other[1][j]
    turned = np.abs((apart[:, 2] + np.pi) % (2 * np.pi) - np.pi) > _TURNED_RAD
    differ = np.flatnonzero((apart[:, :2] != 0).any(axis=1) | turned)
    if not differ.size:
        return None
    at = differ[0]
    apart_m = np.hypot(*apart[at, :2])
    return Parting(float(times_ns[at] / NS_PER_S), robot, float(apart_m))
