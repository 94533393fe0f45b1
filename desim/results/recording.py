"""The recording of a run, read again: poses, maps, plans, walls, events, links, messages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from desim.engine.trace import real
from desim.monitor.map_growth import Life, MapGrowth
from desim.monitor.recorder import ShownPlan, StandingWall
from desim.ports import GridSpec
from desim.results import tables
from desim.results.run import Run, readable
from desim.results.seal import Json
from desim.results.trace_words import values
from desim.simulation.deployment import HostPlan, plan
from desim.units import MM_PER_M, MRAD_PER_RAD, NS_PER_S


class Poses(NamedTuple):
    """The true poses of all robots: ``times_ns`` [n], ascending, ``xy_mm`` int32 [n, robots, 2] and
    ``yaw_mrad`` int16 [n, robots]."""

    times_ns: np.ndarray
    xy_mm: np.ndarray
    yaw_mrad: np.ndarray

    def of_instant(self, k: int) -> np.ndarray:
        """[robots, 3] x m, y m, yaw rad at ``times_ns[k]``."""
        return np.column_stack([self.xy_mm[k] / MM_PER_M, self.yaw_mrad[k] / MRAD_PER_RAD])

    def at(self, time_ns: int) -> np.ndarray:
        """[robots, 3] x m, y m, yaw rad at ``time_ns``, on straight lines between the instants."""
        times_ns = self.times_ns
        after = int(np.clip(np.searchsorted(times_ns, time_ns), 1, max(len(times_ns) - 1, 1)))
        before = min(after, len(times_ns) - 1)
        one, other = before - (after <= before), before
        span_ns = max(int(times_ns[other] - times_ns[one]), 1)
        share = min(max((time_ns - int(times_ns[one])) / span_ns, 0.0), 1.0)
        xy_mm = self.xy_mm[one] + share * (self.xy_mm[other] - self.xy_mm[one])
        turn = (self.yaw_mrad[other] - self.yaw_mrad[one].astype(float)) / MRAD_PER_RAD
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        yaw_rad = self.yaw_mrad[one] / MRAD_PER_RAD + share * turn
        return np.column_stack([xy_mm / MM_PER_M, yaw_rad])


class Event(NamedTuple):
    """A rare row of the trace, in words."""

    time_ns: int
    kind: str
    entity: str
    detail: str


class LinkChange(NamedTuple):
    """Frames get from ``host`` to ``other`` from ``time_ns`` on, or do not."""

    time_ns: int
    host: str
    other: str
    linked: bool


class Recording:
    """The recording of a run whose folder has one. Everything is read when it is asked for; each
    may raise ``InputError`` for a damaged file."""

    def __init__(self, run: Run, home: TemporaryDirectory[str] | None = None) -> None:
        self.run = run
        self.begin_ns = 0
        self._home = home  # of a run that was made again, gone with this object

    @cached_property
    def hosts(self) -> tuple[HostPlan, ...]:
        """The hosts in index order, with their places."""
        return tuple(plan(self.run.scenario))

    @cached_property
    def robots(self) -> tuple[str, ...]:
        """The robots, in the order of ``poses``."""
        with self._table("poses") as table:
            return tuple(table["robot"].combine_chunks().dictionary.to_pylist())

    @cached_property
    def end_ns(self) -> int:
        """The last instant of the run."""
        return round(self.run.manifest["simulated_s"] * NS_PER_S)

    @cached_property
    def poses(self) -> Poses:
        """The poses of all robots; where there is none, the instants of moving obstacles, or the
        run's first and last."""
        if not self.robots:
            with self._table("moving_obstacles") as table:
                seen_ns = np.unique(table["time_ns"].to_numpy())
            times_ns = seen_ns if len(seen_ns) else np.array([0, self.end_ns])
            nobody = np.empty((len(times_ns), 0, 2), np.int32)
            return Poses(times_ns, nobody, nobody[..., 0])
        with self._table("poses") as table:
            by_robot = {name: table[name].to_numpy().reshape(len(self.robots), -1)
                        for name in ("time_ns", "x_mm", "y_mm", "yaw_mrad")}
            self._refuse_other_times(by_robot["time_ns"][0])
            return Poses(by_robot["time_ns"][0],
                         np.stack([by_robot["x_mm"].T, by_robot["y_mm"].T], axis=-1),
                         by_robot["yaw_mrad"].T)

    @cached_property
    def moving_obstacles(self) -> np.ndarray:
        """int32 [n, obstacles, 3] x mm, y mm, radius mm, at the instants of ``poses``."""
        with self._table("moving_obstacles") as table:
            columns = [table[name].to_numpy() for name in ("x_mm", "y_mm", "radius_mm")]
            return np.stack(columns, axis=-1).reshape(
                -1, len(self.poses.times_ns), 3).swapaxes(0, 1)

    @property
    def lives(self) -> list[Life]:
        """The times at which the software of robots with maps ran."""
        return [Life(*growth[:3]) for growth in self.growths]

    @cached_property
    def growths(self) -> tuple[MapGrowth, ...]:
        """The growth of each map, in the order in which robots' software started."""
        with self._table("growth") as table:
            self._refuse_strangers(table["robot"])
            for name in ("started_ns", "until_ns"):
                self._refuse_other_times(table[name].to_numpy())
            return tuple(_growth({name: table[name][i] for name in table.column_names})
                         for i in range(len(table)))

    @cached_property
    def walls(self) -> tuple[StandingWall, ...]:
        """The terrain: its walls, and closed doors as long as they were closed."""
        with self._table("walls") as table:
            return tuple(StandingWall(**row) for row in table.to_pylist())

    @cached_property
    def plans(self) -> tuple[ShownPlan, ...]:
        """All that hosts have shown, and the robots' goals and poses by SLAM, by time."""
        with self._table("plans") as table:
            places = [np.column_stack([x, y]).astype(np.int32) for x, y in
                      zip(table["x_mm"].to_pylist(), table["y_mm"].to_pylist(), strict=True)]
            texts = map(tuple, table["texts"].to_pylist() if "texts" in table.column_names
                        else [()] * len(table))  # recordings of before there were texts
            self._refuse_other_times(table["time_ns"].to_numpy())
            shown = list(map(ShownPlan, table["time_ns"].to_pylist(), table["robot"].to_pylist(),
                             table["kind"].to_pylist(), places, texts))
        return tuple(sorted(shown + shown_in(self._rows), key=lambda plan: plan.time_ns))

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The rare rows of the trace, by time."""
        return events_of(self._rows, self.run.names)

    @cached_property
    def links(self) -> tuple[LinkChange, ...]:
        """The changes of links, sampled once a second. In the beginning nobody is linked."""
        table = self.run.table("links")
        times_ns = np.rint(table["time_s"] * NS_PER_S).astype(np.int64).tolist()
        return tuple(map(LinkChange, times_ns, table["host"], table["other"],
                         table["linked"].tolist()))

    @cached_property
    def messages(self) -> pa.Table:
        """One row a message and receiver."""
        with self._table("messages") as table:
            return table

    @cached_property
    def _rows(self) -> list[Json]:
        with self._table("events") as table:
            self._refuse_other_times(table["t_ns"].to_numpy())
            return rows_of(table)

    @contextmanager
    def _table(self, name: str) -> Iterator[pa.Table]:
        with readable(self.run.file(f"{name}.parquet")) as file:
            yield tables.read(file)

    def _refuse_other_times(self, times_ns: np.ndarray) -> None:
        if len(times_ns) and not 0 <= times_ns.min() <= times_ns.max() <= self.end_ns:
            raise ValueError("a time is not in the run")

    def _refuse_strangers(self, names: pa.ChunkedArray) -> None:
        strangers = set(names.to_pylist()).difference(host.name for host in self.hosts)
        if strangers:
            raise ValueError(f"{min(strangers)!r} is none of the run's hosts")


def rows_of(events: pa.Table) -> list[Json]:
    """Rows of a trace, by time, as mappings."""
    rows: list[Json] = events.sort_by("t_ns").to_pylist()
    return rows


def events_of(rows: Sequence[Json], names: Mapping[int, str]) -> tuple[Event, ...]:
    """Rows of a trace in words; ``names`` are those of its ids."""
    return tuple(Event(row["t_ns"], row["kind"], row["entity"], values(row, row["kind"], names))
                 for row in rows)


_SHOWN = {"goal": "goal", "goal_reached": "goal", "goal_aborted": "goal", "localized": "pose"}


def shown_in(rows: Sequence[Json]) -> list[ShownPlan]:
    """The goals that explore has set, and their ends; the poses that SLAM has found."""
    shown = []
    for row in rows:
        kind = _SHOWN.get(row["kind"])
        if kind is not None:
            has_place = row["kind"] in ("goal", "localized")
            place = [real(row[column]) * MM_PER_M for column in "ab"] if has_place else []
            shown.append(ShownPlan(row["t_ns"], row["entity"], kind,
                                   np.rint(place).astype(np.int32).reshape(-1, 2)))
    return shown


def _growth(row: Mapping[str, pa.Scalar]) -> MapGrowth:
    robot, started_ns, until_ns, *grid = (row[name].as_py() for name in (
        "robot", "started_ns", "until_ns", "resolution_m", "width", "height", "x_m", "y_m"))
    spec = GridSpec(*grid)
    shape = spec.height, spec.width
    occupied = np.unpackbits(row["occupied"].values.to_numpy(), count=spec.width * spec.height)
    return MapGrowth(robot, started_ns, until_ns, spec,
                     row["known_since"].values.to_numpy().reshape(shape),
                     occupied.reshape(shape).astype(bool))
