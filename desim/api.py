"""The small Python API: load a scenario, run it, look at what came out."""

from __future__ import annotations

import json
import os
import resource
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from desim.blame import blame
from desim.errors import InputError, ModelError
from desim.experiment import maps
from desim.experiment.results import FAILED, FINISHED, INTERRUPTED, RunFolder
from desim.experiment.seal import MANIFEST, MAPS, SUMMARY, manifest_of, wrong_with
from desim.scenario import yaml12
from desim.scenario.load import Loaded, from_mapping, load
from desim.scenario.schema import Scenario
from desim.simulation import Simulation
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.campaign.design import Design

__all__ = ["Campaign", "Run", "from_mapping", "load", "run"]

Watch = Callable[[Simulation, RunFolder], AbstractContextManager[Any]]


class Run:
    """A run's folder: everything is read when it is asked for."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        found = manifest_of(self.path)
        if found is None:
            raise InputError(_no_run(self.path))
        # How it ran: status, digest, versions, times.
        self.manifest: dict[str, Any] = found

    @cached_property
    def scenario(self) -> Scenario:
        """What was run, every value spelled out. It is not checked again: its plug-ins and its map
        need not be there any more."""
        with _readable(self.file("scenario.resolved.yaml")) as file:
            return Scenario.model_validate(yaml12.read(str(file))[0])

    @cached_property
    def metrics(self) -> dict[str, Any]:
        """The summary."""
        with _readable(self.file(SUMMARY)) as file:
            return json.loads(file.read_text())

    @cached_property
    def samples(self) -> dict[str, np.ndarray]:
        """The monitor's time series, by column."""
        return self.table("samples")

    @cached_property
    def robots(self) -> dict[str, np.ndarray]:
        """Where each robot was, once a second, by column."""
        return self.table("robots")

    @cached_property
    def map(self) -> maps.OccupancyMap:
        """What the robot that the metrics speak of believed in at the end."""
        return self._map("merged")

    @cached_property
    def truth(self) -> maps.OccupancyMap:
        """The ground truth; what no laser can reach is unknown."""
        return self._map("truth")

    @cached_property
    def names(self) -> dict[int, str]:
        """The names of the ids in ``trace.parquet``."""
        with _readable(self.file("names.json")) as file:
            return {int(id_): name for id_, name in json.loads(file.read_text()).items()}

    def table(self, name: str) -> dict[str, np.ndarray]:
        """``samples``, ``robots``, ``latency``, ``messages`` or ``trace`` by column. What is not
        there is None among words and NaN among numbers."""
        return _columns(self.file(f"{name}.parquet"))

    def has(self, name: str) -> bool:
        """Whether the run has left this file, and it is still there."""
        return name in self.manifest["files"] and (self.path / name).exists()

    def file(self, name: str) -> Path:
        """One of its files, as desim wrote it. Raises ``InputError`` where it is not so."""
        if name not in self.manifest["files"]:
            raise InputError(f"{self.path}: has no {name} (its status is "
                             f"{self.manifest['status']!r})")
        wrong = wrong_with(self.path, self.manifest, name)
        if wrong is not None:
            raise InputError(f"{self.path}: damaged: {wrong}; running its scenario again mends it")
        return self.path / name

    def _map(self, name: str) -> maps.OccupancyMap:
        for ending in ("pgm", "yaml"):
            self.file(f"{MAPS}/{name}.{ending}")
        return maps.load(self.path / MAPS, name)

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"


class Campaign:
    """A campaign's folder, as ``desim sweep`` leaves it: everything is read when it is asked for.
    Iterating gives its finished runs, by vector and iteration. ``desim.campaign(path)`` is one."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not (self.path / "design.yaml").is_file():
            raise InputError(f"{self.path}: not the folder of a campaign; that has a design.yaml, "
                             "see desim sweep")

    @cached_property
    def design(self) -> Design:
        """What was asked, every default spelled out."""
        from desim.campaign.design import read_design

        return read_design(str(self.path / "design.yaml"))[0]

    @cached_property
    def runs(self) -> dict[str, np.ndarray]:
        """The table of all runs that are done, failed ones too, by column."""
        return _columns(self.path / "runs.parquet")

    def run(self, run_id: str) -> Run:
        """One of its runs. Raises ``InputError`` where there is no folder of it."""
        for scenario in sorted((self.path / "runs").glob("*")):
            if (scenario / run_id / "manifest.json").is_file():
                return Run(scenario / run_id)
        errors = dict(zip(self.runs["run_id"], self.runs["error"], strict=True))
        raise InputError(f"{self.path}: " + (f"run {run_id!r} has left no folder: {errors[run_id]}"
                                             if run_id in errors else f"has no run {run_id!r}"))

    def __iter__(self) -> Iterator[Run]:
        for run_id, status in zip(self.runs["run_id"], self.runs["status"], strict=True):
            if status == FINISHED:
                yield self.run(run_id)

    def __repr__(self) -> str:
        return f"Campaign({str(self.path)!r})"


def run(scenario: Loaded | Scenario | str | Path, *, out: str | Path = "results",
        overrides: Sequence[str] = (), seed: int | None = None, watch: Watch | None = None,
        rows: Callable[[np.ndarray], Any] | None = None, command: str = "") -> Run:
    """Run a scenario (or the file of one) and leave its folder in ``out/<name>/<run id>``.

    ``overrides`` and ``seed`` as ``desim.load`` takes them, for a file. ``watch(simulation,
    folder)`` is entered while the clock runs; ``rows`` gets all trace rows in batches. Ctrl-C ends
    the run in good order: its status is then ``interrupted`` (where a finished run of the same id
    exists, that one stays), and ``KeyboardInterrupt`` goes on, with the folder's path if it is
    kept. An error of the run goes on after the manifest says ``failed``. Raises ``InputError`` for
    a wrong scenario or a folder that cannot be written.
    """
    if isinstance(scenario, (str, Path)):
        scenario = load(scenario, overrides, seed)
    elif overrides or seed is not None:
        raise InputError("overrides and seed belong to desim.load, the scenario is loaded already")
    loaded = scenario if isinstance(scenario, Loaded) else None
    scenario = loaded.scenario if loaded else scenario
    folder, meter, simulation = RunFolder(out, scenario), _Meter(command), None
    try:
        with _blamed(loaded):
            simulation = Simulation(scenario, trace_sink=_both(folder.trace_sink, rows),
                                    on_fate=folder.on_fate)
        folder.begin(simulation.names, tuple(host.name for host in simulation.graph.hosts))
        with _blamed(loaded):
            simulation.graph.start()
        with _interruptible(simulation), watch(simulation, folder) if watch else nullcontext():
            simulation.run()
        interrupted = simulation.monitor.stop_reason == INTERRUPTED
        path = folder.finish(simulation.monitor, simulation.kernel.now_ns, {
            "status": INTERRUPTED if interrupted else FINISHED, **_digests(simulation),
            **meter.read(simulation.kernel.now_ns)})
    except (InputError, KeyboardInterrupt):
        folder.discard()
        raise
    except (Exception, SystemExit) as error:
        if isinstance(error, SystemExit):  # of a stranger's code: it ends the run, not desim
            error = ModelError("sys.exit() was called").with_traceback(error.__traceback__)
        now_ns, events = (0, 0) if simulation is None else (simulation.kernel.now_ns,
                                                            simulation.kernel.events)
        folder.abandon({"status": FAILED, "digest": None, "events": events,
                        **meter.read(now_ns), "error": blame(error).line,
                        "traceback": traceback.format_exc()})
        raise error
    if interrupted:
        raise KeyboardInterrupt(*([] if path is None else [str(path)]))
    return Run(path)


def _no_run(path: Path) -> str:
    if os.path.lexists(path / MANIFEST):
        return (f"{path}: damaged: {MANIFEST} is not what desim writes, or what an earlier version "
                "wrote; running its scenario again mends it")
    cut_off = " (it is being written, or was cut off)" if path.suffix == ".partial" else ""
    return (f"{path}: not the folder of a run{cut_off}; a run's folder has a {MANIFEST}, e.g. "
            "results/hello/1a2b3c4d5e6f")


@contextmanager
def _readable(file: Path) -> Iterator[Path]:
    """The file, whatever may be wrong inside of it."""
    try:
        yield file
    except (ValueError, OSError, RecursionError) as error:  # JSON's, pydantic's, pyarrow's too
        raise InputError(f"{file}: damaged: {str(error).splitlines()[0]}") from error


def _columns(file: Path) -> dict[str, np.ndarray]:
    with _readable(file):
        table = pq.read_table(file)
    return {column: _array(table[column]) for column in table.column_names}


def _array(column: pa.ChunkedArray) -> np.ndarray:
    if not pa.types.is_dictionary(column.type):
        return column.to_numpy()
    # pyarrow's own to_numpy() reads a null as the dictionary's first word.
    parts = [np.array([*chunk.dictionary.to_pylist(), None], object)[
        chunk.indices.fill_null(-1).to_numpy(zero_copy_only=False)] for chunk in column.chunks]
    return np.concatenate([np.empty(0, object), *parts])


def _digests(simulation: Simulation) -> dict[str, Any]:
    return {"digest": simulation.trace.digest(),
            "digest_by_entity": simulation.trace.digest_by_entity(),
            "events": simulation.kernel.events}


@contextmanager
def _blamed(loaded: Loaded | None) -> Iterator[None]:
    """What goes wrong while the parts are built names its path; give it its place in the file."""
    try:
        yield
    except InputError as error:
        if loaded is None:
            raise
        raise loaded.placed(error) from error


@contextmanager
def _interruptible(simulation: Simulation) -> Iterator[None]:
    """The first Ctrl-C or termination signal ends the run when the present instant is complete;
    a second one at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, _: Any) -> None:
        signal.signal(number, signal.default_int_handler)
        simulation.interrupt()

    before = {number: signal.signal(number, interrupt)
              for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _both(first: Callable | None, second: Callable | None) -> Callable[[np.ndarray], None] | None:
    if first is None or second is None:
        return first or second

    def add(rows: np.ndarray) -> None:
        first(rows)
        second(rows)

    return add


class _Meter:
    """What a run costs. It starts when everything is imported and compiled."""

    def __init__(self, command: str) -> None:
        self._command = command
        self._wall_s, self._cpu_s = time.perf_counter(), time.process_time()

    def read(self, simulated_ns: int) -> dict[str, Any]:
        cpu_s = time.process_time() - self._cpu_s
        return {"command": self._command, "simulated_s": simulated_ns / NS_PER_S,
                "wall_s": round(time.perf_counter() - self._wall_s, 3), "cpu_s": round(cpu_s, 3),
                "real_time_factor": round(simulated_ns / NS_PER_S / max(cpu_s, 1e-9), 2),
                # ru_maxrss is in kB on Linux
                "peak_memory_mb": round(
                    resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1)}
