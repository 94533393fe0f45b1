"""Runs with small real programs in a guest, for tests."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

from desim.errors import InputError
from desim.loop.doctor import findings
from desim.loop.guest_kernel import guest_kernel
from desim.loop.order import Order
from desim.loop.supervision import Watcher
from desim.loop.virtual import run_virtually
from desim.results.run import Run
from desim.scenario.load import load

HEAD = """\
name: guests
seed: 1
deployment: field
environment:
  terrain: {size: [60 m, 60 m], drawing: {cell: 60 m, lines: ["+--+", "|  |", "+--+"]}}
fleet: {size: 0}
hosts: {base: {at: [0 m, 0 m]}, other: {at: [5 m, 0 m]}}
"""

NOBODY = Watcher(lambda *_: None, lambda _: None)


class Program(NamedTuple):
    """A program of Python on a host."""

    host: str
    code: str


def refuse_without_guest() -> None:
    """Skip the test where no guest can run here."""
    if sys.platform != "linux":
        pytest.skip("guests run on Linux alone")
    lacking = [f"{finding.what}: {finding.remedy}" for finding in findings()
               if finding.needed and finding.remedy]
    if lacking:
        pytest.skip(lacking[-1])


def played(folder: Path, keys: str, programs: list[Program], *, changes: tuple[str, ...] = (),
           seed: int | None = None, memory_mb: int = 700,
           watcher: Watcher = NOBODY) -> Run:
    """A run of ``programs`` on the hosts base and other, with further ``keys`` of a scenario."""
    for number, program in enumerate(programs):
        (folder / f"p{number}.py").write_text(program.code)
    started = "".join(f"    - {{host: {program.host}, run: $DESIM_PYTHON p{number}.py}}\n"
                      for number, program in enumerate(programs))
    file = folder / "guests.yaml"
    file.write_text(f"{HEAD}{keys}loop:\n  programs:\n{started}")
    loaded = load(str(file), changes, seed)
    return run_virtually(Order(str(file), list(changes), seed, str(folder / "out"), "desim loop"),
                         loaded.scenario, _kernel(), memory_mb, watcher)


def _kernel() -> Path:
    try:
        return guest_kernel()
    except InputError as error:
        pytest.skip(str(error))


def said(run: Run, host: str, number: int) -> list[str]:
    """The lines that a program has printed."""
    return (run.path / f"{host}.{number}.log").read_text("utf-8").splitlines()


@contextmanager
def busy_machine(processes: int) -> Iterator[None]:
    """Let so many processes compute meanwhile."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()
