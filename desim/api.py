"""``desim.run``: runs a scenario, leaves its folder even after Ctrl-C or an error, measures costs.

A run ends in one of the three ways of ``RunStatus``, which its manifest records, and ``run`` passes
that on: it returns a ``Run`` (finished), raises ``KeyboardInterrupt`` (interrupted) or the error
(failed). A command turns these into exit codes: ``desim.commands.exit_codes.exit_codes``.
"""

from __future__ import annotations

import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from desim.blame import blame
from desim.compiler.store import compiling_s
from desim.engine.trace import RowSink
from desim.errors import InputError, ModelError
from desim.monitor.monitor import StopReason
from desim.operating_system.resources import forget_peak_memory, peak_memory_bytes
from desim.results.folder import RunFolder
from desim.results.recording import Recording
from desim.results.recording_tables import RECORDED
from desim.results.run import Run
from desim.results.status import RunStatus, refuse_imported_scenario
from desim.results.traces import repeatable
from desim.robot.software import Pilot
from desim.scenario.load import Loaded, load
from desim.scenario.schema.experiment import TraceParams
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

Watch = Callable[[Simulation, RunFolder], AbstractContextManager[object]]


def run(scenario: Loaded | Scenario | str | Path, *, out: str | Path = "results",
        overrides: Sequence[str] = (), seed: int | None = None, watch: Watch | None = None,
        rows: RowSink | None = None, command: str = "") -> Run:
    """Run a scenario (or the file of one) and leave its folder in ``out/<name>/<run id>``.

    ``overrides`` and ``seed`` as ``desim.load`` takes them, for a file. ``watch(simulation,
    folder)`` is entered while the clock runs; ``rows`` gets all trace rows in batches. Ctrl-C ends
    the run in good order: its status is then ``interrupted`` (a finished run of the same id is not
    replaced), and ``KeyboardInterrupt`` is raised, with the folder's path if that is kept. An error
    of the run is raised again when the manifest says ``failed``, with a note of its cause: the
    plug-in, its line, the host and the time. Raises ``InputError`` for a wrong
    scenario or a folder that cannot be written.
    """
    source, scenario = loaded(scenario, overrides, seed)
    return _carried_out(source, scenario, out, watch, rows, command)


def run_beside_programs(scenario: Loaded, out: str | Path, watch: Watch, pilot: Pilot,
                        command: str) -> Run:
    """Run a scenario as ``run`` does whose real programs ``watch`` starts and ends. ``pilot`` as
    ``Simulation`` takes it."""
    return _carried_out(scenario, scenario.scenario, out, watch, None, command, pilot)


def _carried_out(source: Loaded | None, scenario: Scenario, out: str | Path, watch: Watch | None,
                 rows: RowSink | None, command: str, pilot: Pilot | None = None) -> Run:
    folder, simulation = RunFolder(out, scenario), None
    begin_s = _worked_s()
    forget_peak_memory()
    try:
        with located(source):
            simulation = Simulation(scenario, trace_sink=_both(folder.trace_sink, rows),
                                    on_fate=folder.on_fate, recorder=folder.recorder,
                                    ledger=folder.ledger, pilot=pilot)
        folder.begin(simulation.names, tuple(host.name for host in simulation.graph.hosts))
        with _interruptible(simulation), watch(simulation, folder) if watch else nullcontext():
            with located(source):
                simulation.graph.start()
            simulation.run()
        interrupted = simulation.monitor.stop_reason == StopReason.INTERRUPTED
        path = folder.finish(simulation.monitor, simulation.kernel.now_ns, {
            "status": RunStatus.INTERRUPTED if interrupted else RunStatus.FINISHED,
            "digest": simulation.trace.digest(),
            "digest_by_entity": simulation.trace.digest_by_entity(),
            "digest_by_kind": simulation.trace.digest_by_kind(),
            "events": simulation.kernel.events, "command": command,
            **_costs(begin_s, simulation.kernel.now_ns)})
    except (InputError, KeyboardInterrupt):
        folder.discard()
        raise
    except (Exception, SystemExit) as error:
        if isinstance(error, SystemExit):  # of a plug-in: it ends the run, not desim
            error = ModelError("sys.exit() was called").with_traceback(error.__traceback__)
        now_ns, events = (0, 0) if simulation is None else (simulation.kernel.now_ns,
                                                            simulation.kernel.events)
        if simulation is not None:
            with suppress(Exception):  # what failed may fail again
                simulation.trace.flush()
        cause = blame(error).line
        folder.abandon({"status": RunStatus.FAILED, "digest": None, "events": events,
                        "command": command, **_costs(begin_s, now_ns), "error": cause,
                        "traceback": traceback.format_exc()})
        error.add_note(cause)
        raise error
    if path is None:  # interrupted, and a finished run of the same id stays
        raise KeyboardInterrupt
    if interrupted:
        raise KeyboardInterrupt(str(path))
    return Run(path, trust=True)  # this process has run its code already


def recording_of(kept: Run, watch: Watch | None = None) -> Recording:
    """The recording of the run ``kept``: its own, or that of running its scenario again, with
    ``watch`` as ``run`` takes it. Raises ``InputError`` where none was kept and the run cannot be
    repeated: it failed, or other versions are installed now."""
    if kept.keeps(f"{RECORDED[0]}.parquet"):
        return Recording(kept)
    if kept.manifest["status"] == RunStatus.FAILED:
        raise InputError(f"{kept.path}: the run failed and has kept nothing to look at; its "
                         "manifest.json has the error")
    scenario = repeatable(kept, "poses and maps", "trace.keep=replay")
    changes: dict[str, object] = {"trace": TraceParams(keep="replay")}
    if kept.manifest["status"] == RunStatus.INTERRUPTED:
        end_ns = round(kept.manifest["simulated_s"] * NS_PER_S)
        changes["stop"] = scenario.stop.model_copy(update={"elapsed_ns": end_ns})
    home = TemporaryDirectory(prefix="desim-")
    repeated = run(scenario.model_copy(update=changes), out=home.name, watch=watch)
    return Recording(repeated, home)


def loaded(scenario: Loaded | Scenario | str | Path, overrides: Sequence[str], seed: int | None
           ) -> tuple[Loaded | None, Scenario]:
    """A scenario or the file of one, and where its keys are written, for ``located``; arguments and
    errors as those of ``run``."""
    if isinstance(scenario, (str, Path)):
        refuse_imported_scenario(Path(scenario))
        scenario = load(scenario, overrides, seed)
    elif overrides or seed is not None:
        raise InputError("overrides and seed belong to desim.load, the scenario is loaded already")
    if isinstance(scenario, Loaded):
        scenario.refuse_programs()
        return scenario, scenario.scenario
    if scenario.loop.programs:
        raise InputError("loop.programs: hosts run real programs; allowed: desim loop FILE")
    return None, scenario


@contextmanager
def located(source: Loaded | None) -> Iterator[None]:
    """Add file, line and column to an error that was raised while the parts were built."""
    try:
        yield
    except InputError as error:
        if source is None:
            raise
        raise source.placed(error) from error


@contextmanager
def _interruptible(simulation: Simulation) -> Iterator[None]:
    """The first Ctrl-C or termination signal ends the run when the present instant is complete;
    a second one at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, _: object) -> None:
        signal.signal(number, signal.default_int_handler)
        simulation.interrupt()

    before = {number: signal.signal(number, interrupt)
              for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _both(first: RowSink | None, second: RowSink | None) -> RowSink | None:
    if first is None or second is None:
        return first or second

    def add(rows: np.ndarray) -> None:
        first(rows)
        second(rows)

    return add


def _worked_s() -> tuple[float, float]:
    """Clock time and CPU time of this process, but for compiling."""
    wall_s, cpu_s = compiling_s()
    return time.perf_counter() - wall_s, time.process_time() - cpu_s


def _costs(begin_s: tuple[float, float], simulated_ns: int) -> dict[str, object]:
    """The costs of a run that began at ``begin_s`` of ``_worked_s``."""
    wall_s, cpu_s = (now - before for now, before in zip(_worked_s(), begin_s, strict=True))
    peak_bytes = peak_memory_bytes()
    return {"simulated_s": simulated_ns / NS_PER_S,
            "wall_s": round(wall_s, 3), "cpu_s": round(cpu_s, 3),
            "real_time_factor": round(simulated_ns / NS_PER_S / max(cpu_s, 1e-9), 2),
            "peak_memory_mb": None if peak_bytes is None else round(peak_bytes / 2**20, 1)}
