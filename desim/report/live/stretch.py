"""A running simulation, stretch by stretch, as its page shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from desim.monitor.map_growth import Life, MapGrowth
from desim.monitor.monitor import StopReason
from desim.monitor.recorder import Recorder, ShownPlan, StandingWall
from desim.monitor.summary import robots_table, summarize
from desim.results import parquet
from desim.results.file_names import LEDGER
from desim.results.folder import RunFolder
from desim.results.identity import versions
from desim.results.recording import (
    Event,
    LinkChange,
    Poses,
    events_of,
    rows_of,
    shown_in,
)
from desim.results.seal import Json
from desim.results.status import RunStatus
from desim.scenario.schema.scenario import Scenario
from desim.simulation.deployment import HostPlan, plan
from desim.simulation.simulation import Simulation
from desim.units import MM_PER_M, NS_PER_S

RUNNING = "running"  # as a status, beside those of ``RunStatus``
_STATUS: dict[str | None, str] = {None: RUNNING, StopReason.INTERRUPTED: RunStatus.INTERRUPTED}


@dataclass(frozen=True)
class FactsSoFar:
    """The words and figures of a running simulation, as ``results.Run`` has those of a run."""

    scenario: Scenario
    manifest: Json
    metrics: Json
    robots: dict[str, np.ndarray]
    samples: dict[str, np.ndarray]
    ledger: pa.Table | None = None  # known at the end alone

    def has(self, name: str) -> bool:
        """Whether the run will have this file, and it can be shown before its end."""
        return name != LEDGER


@dataclass(frozen=True)
class Stretch:
    """A run from ``begin_ns`` until before ``end_ns``, as ``results.Recording`` has it."""

    run: FactsSoFar
    begin_ns: int
    end_ns: int
    robots: Sequence[str]
    hosts: Sequence[HostPlan]
    poses: Poses
    moving_obstacles: np.ndarray
    lives: Sequence[Life]
    growths: Sequence[MapGrowth]
    walls: Sequence[StandingWall]
    plans: Sequence[ShownPlan]
    events: Sequence[Event]
    links: Sequence[LinkChange]
    messages: pa.Table


class Stretches:
    """Cuts a running simulation into stretches. Its recording must be kept (``trace.keep``). What
    happened before this object was made is in none of them."""

    def __init__(self, simulation: Simulation, folder: RunFolder, recorder: Recorder) -> None:
        self._simulation, self._folder, self._recorder = simulation, folder, recorder
        self._hosts = plan(simulation.scenario)
        self._begin_ns = 0
        # The numbers of those that have been shown.
        self._poses = self._plans = self._links = self._seconds = self._samples = 0
        self._events: list[pa.RecordBatch] = []
        self._messages: list[pa.RecordBatch] = []
        folder.on_events = self._note_events
        folder.on_messages = self._note_messages

    def next(self, with_maps: bool) -> Stretch:
        """The stretch from the end of the last one until now, a full second, in phase OBSERVE."""
        simulation, now_ns = self._simulation, self._simulation.kernel.now_ns
        simulation.trace.flush()
        self._folder.flush()
        rows = rows_of(self._taken(self._events, parquet.TRACE_SCHEMA))
        stretch = Stretch(
            self._facts(), self._begin_ns, now_ns, self._recorder.robots, self._hosts,
            *self._next_poses(), self._recorder.lives[:],
            self._recorder.growths() if with_maps else (),
            self._recorder.walls, self._next_plans(shown_in(rows)),
            events_of(rows, simulation.names.items()), self._next_links(),
            self._taken(self._messages, parquet.MESSAGE_SCHEMA))
        self._begin_ns = now_ns
        return stretch

    def last(self) -> Stretch:
        """The stretch until the end of the run, which is now."""
        self._recorder.finish()
        return self.next(with_maps=True)

    def _facts(self) -> FactsSoFar:
        simulation, monitor = self._simulation, self._simulation.monitor
        scenario = simulation.scenario
        table = robots_table(monitor)
        begin, self._seconds = self._seconds, len(monitor.tracks) * len(monitor.truth.robots)
        status = _STATUS.get(monitor.stop_reason, RunStatus.FINISHED)
        return FactsSoFar(
            scenario, {"name": scenario.name, "seed": scenario.seed, "status": status,
                       "digest": None, "run_id": self._folder.run_id,
                       "desim_version": versions()["desim"]},
            summarize(monitor, simulation.kernel.now_ns),
            {name: np.asarray(column)[begin:self._seconds] for name, column in table.items()},
            self._next_samples())

    def _next_samples(self) -> dict[str, np.ndarray]:
        samples = self._simulation.monitor.samples
        begin, self._samples = self._samples, len(samples)
        return {name: np.array([sample[name] for sample in samples[begin:]], np.float64)
                for name in ("time_s", "explored_union")}

    def _next_poses(self) -> tuple[Poses, np.ndarray]:
        """Those of the robots, and of moving obstacles."""
        recorder, begin = self._recorder, self._poses
        self._poses = len(recorder.times_ns)
        times_ns = np.array(recorder.times_ns[begin:], np.int64)
        shape = len(times_ns), len(recorder.robots), 3
        poses = np.rint(np.array(recorder.poses[begin:]).reshape(shape) * MM_PER_M)
        obstacles = np.rint(recorder.moving_obstacles(begin) * MM_PER_M).astype(np.int32)
        return (Poses(times_ns, poses[:, :, :2].astype(np.int32), poses[:, :, 2].astype(np.int16)),
                obstacles)

    def _next_plans(self, of_rows: list[ShownPlan]) -> list[ShownPlan]:
        plans, begin = self._recorder.plans, self._plans
        self._plans = len(plans)
        return sorted(plans[begin:] + of_rows, key=lambda each: each.time_ns)

    def _next_links(self) -> list[LinkChange]:
        table, begin = self._recorder.links.table(), self._links
        self._links = len(table["time_s"])
        times_ns = np.rint(table["time_s"][begin:] * NS_PER_S).astype(np.int64).tolist()
        return list(map(LinkChange, times_ns, table["host"][begin:].tolist(),
                        table["other"][begin:].tolist(), table["linked"][begin:].tolist()))

    def _note_events(self, rows: np.ndarray) -> None:
        self._events.append(parquet.trace_batch(rows, self._simulation.names))

    def _note_messages(self, rows: np.ndarray, reasons: list[str]) -> None:
        self._messages.append(parquet.message_batch(
            rows, reasons, self._simulation.names, tuple(host.name for host in self._hosts)))

    def _taken(self, batches: list[pa.RecordBatch], schema: pa.Schema) -> pa.Table:
        table = pa.Table.from_batches(batches, schema)
        batches.clear()
        return table
