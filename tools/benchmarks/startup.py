"""How long does desim take to start? Imports, kernels kept or compiled, a worker of a campaign.

Clock time and CPU time of processes of their own, medians. For `tools/bench.py startup`."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from desim.campaign.running.crew import Crew
from desim.campaign.running.work import RunTask
from desim.results.identity import Identity
from desim.scenario.load import load

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
REPETITIONS, FIRST_RUNS = 7, 3

Seconds = tuple[float, float]  # of clock time and of CPU time


def startup() -> list[dict[str, object]]:
    """Seconds from the shell to the end, medians. First runs compile their kernels."""
    with tempfile.TemporaryDirectory() as scratch:
        rows = [row("import desim", [python("-c", "import desim") for _ in range(REPETITIONS)])]
        for name, until in ("hello", "1000 s"), ("maze_30", "1 s"):
            command = ("-m", "desim.cli", "run", str(SCENARIOS / f"{name}.yaml"), "--quiet",
                       "--until", until, "--out", scratch)
            first = [python(*command, folder=f"{scratch}/{name} {k}") for k in range(FIRST_RUNS)]
            later = [python(*command, folder=f"{scratch}/{name} 0") for _ in range(REPETITIONS)]
            rows += [row(f"{name} to {until}, first run", first),
                     row(f"{name} to {until}, kernels kept", later)]
        python("-c", "import desim.api")  # its kernels are kept
        rows.append(row("a worker to the end of its first run (hello to 1 s)",
                        [of(lambda: first_run(scratch)) for _ in range(REPETITIONS)]))
    return rows


def row(what: str, measured: list[Seconds]) -> dict[str, object]:
    wall_s, cpu_s = (round(median(one), 3) for one in zip(*measured, strict=True))
    return {"what": what, "clock s": wall_s, "CPU s": cpu_s, "runs": len(measured)}


def python(*arguments: str, folder: str | None = None) -> Seconds:
    """A process of Python, with kernels in ``folder``."""
    environment = {**os.environ, **({} if folder is None else {"NUMBA_CACHE_DIR": folder})}
    return of(lambda: subprocess.run([sys.executable, *arguments], check=True, env=environment,
                                     stdout=subprocess.DEVNULL))


def first_run(scratch: str) -> None:
    """A worker is started, makes a run and is ended."""
    loaded = load(SCENARIOS / "hello.yaml", ["stop.elapsed=1 s"])
    run_id = Identity(loaded.scenario).run_id(loaded.scenario.seed)
    with Crew(1) as crew:
        crew.begin(RunTask(run_id, loaded, scratch, ()))
        [(_, outcome)] = crew.finished()
    if isinstance(outcome, Exception):
        raise outcome


def of(action: Callable[[], object]) -> Seconds:
    """Clock time, and CPU time of the processes that were started and have ended."""
    def cpu_s() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    before = time.perf_counter(), cpu_s()
    action()
    return time.perf_counter() - before[0], cpu_s() - before[1]
