"""How many Python calls does a simulated second take, by function and by kind of event?

    python tools/bench.py calls [--check | --write] [--functions N] [NAME ...]

Counts are exact: a tree gives the same on every machine with the same Python. A call of a compiled
kernel or of a C function is none. `--check` compares with `calls.csv` beside this file and fails
above 1 % more. `--write` puts the counts there: then the commit says why they rose.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType

import desim
from desim.engine.kernel import Kernel
from desim.scenario.load import Loaded

ROOT = Path(__file__).resolve().parents[2]
COMMITTED = Path(__file__).with_suffix(".csv")
ALLOWED = 1.01  # of the committed figure
UNTIL_S = 20

_MAZE = ("maze_30.yaml",)
WORKLOADS: dict[str, tuple[str, ...]] = {  # a scenario and what is set in it
    "hello": ("hello.yaml",),
    "maze_30": _MAZE,
    "maze_30, ros1": (*_MAZE, "middleware.model=ros1"),
    "maze_30, fastdds": (*_MAZE, "middleware.model=dds", "middleware.preset=fastdds"),
    "maze_30, cyclonedds": (*_MAZE, "middleware.model=dds", "middleware.preset=cyclonedds"),
    "maze_30, zenoh": (*_MAZE, "middleware.model=zenoh"),
    "maze_30, computers measured": (*_MAZE, "computers=measured"),
    "maze_30, gmapping": (*_MAZE, "robot.localization=gmapping"),
    "maze_30, 100 robots": (*_MAZE, "fleet.size=100", "fleet.start.step=[0 m, -0.75 m]"),
    "maze_30, no replay": (*_MAZE, "trace.keep=messages"),
    "field_30": ("field_30.yaml",),
}

_LOOP = Kernel._loop.__code__


class Calls:
    """Python calls while the clock of a run runs: by function, and by the event that led to them.
    An event goes by the name of the function that it calls."""

    def __init__(self) -> None:
        self.functions: Counter[CodeType] = Counter()
        self.events: Counter[CodeType] = Counter()
        self.by_event: Counter[CodeType] = Counter()
        self._event = _LOOP

    def count(self, frame: FrameType, what: str, _: object) -> None:
        """Count one call. Python's profiler calls it."""
        if what != "call":
            return
        code, caller = frame.f_code, frame.f_back
        if caller is not None and caller.f_code is _LOOP:
            self._event = code
            self.events[self._event] += 1
        self.functions[code] += 1
        self.by_event[self._event] += 1

    @property
    def total(self) -> int:
        return sum(self.functions.values())


def load(name: str, until_s: float) -> Loaded:
    """A workload's scenario, which ends after ``until_s`` simulated seconds."""
    file, *settings = WORKLOADS[name]
    return desim.load(ROOT / "scenarios" / file, [*settings, f"stop.elapsed={until_s} s"])


def count(name: str) -> Calls:
    """The calls of the first ``UNTIL_S`` seconds of a workload. A run before it compiles and loads
    the kernels."""
    loaded = load(name, UNTIL_S)
    with tempfile.TemporaryDirectory() as out:
        desim.run(loaded, out=out)
    calls = Calls()

    @contextmanager
    def counting(*_: object) -> Iterator[None]:
        sys.setprofile(calls.count)
        try:
            yield
        finally:
            sys.setprofile(None)

    with tempfile.TemporaryDirectory() as out:
        desim.run(loaded, out=out, watch=counting)
    return calls


def committed() -> dict[str, int]:
    """Calls of the first ``UNTIL_S`` seconds by workload, as `calls.csv` has them."""
    with COMMITTED.open(encoding="utf-8", newline="") as file:
        return {row["workload"]: int(row["python_calls"]) for row in csv.DictReader(file)}


def commit(counts: dict[str, int]) -> None:
    """Write these counts into `calls.csv`; others stay."""
    counts = committed() | counts if COMMITTED.exists() else counts
    with COMMITTED.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("workload", "python_calls"))
        table.writerows((name, counts[name]) for name in WORKLOADS if name in counts)


def too_many(counts: dict[str, int]) -> list[str]:
    """One sentence for each workload that makes more calls than the committed figure allows."""
    before = committed()
    return [f"{name}: {now} Python calls in {UNTIL_S} s, {now / before[name] - 1:+.1%} of the "
            f"{before[name]} in {COMMITTED.name}; at most {ALLOWED - 1:+.0%} is allowed: take them "
            f"back, or change the figure (`python tools/bench.py calls --write`) and say why"
            for name, now in counts.items() if now > ALLOWED * before[name]]


def function_rows(calls: Calls, most: int) -> list[dict[str, object]]:
    """The functions that are called most."""
    return [{"what": _name(code), "calls": round(count / UNTIL_S, 1)}
            for code, count in calls.functions.most_common(most)]


def event_rows(calls: Calls, most: int) -> list[dict[str, object]]:
    """The kinds of events that lead to most calls."""
    return [{"what": _name(code), "events": round(calls.events[code] / UNTIL_S, 1),
             "calls": round(count / UNTIL_S, 1),
             "calls each": round(count / max(1, calls.events[code]), 1)}
            for code, count in calls.by_event.most_common(most)]


def _name(code: CodeType) -> str:
    return f"{code.co_filename.removeprefix(f'{ROOT}/')}:{code.co_qualname}"
