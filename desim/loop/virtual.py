"""A run with real programs in simulated time: boots the guest, and waits for its answer."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from desim.errors import InputError, ModelError
from desim.loop import guest
from desim.loop.busy_program import busy_program
from desim.loop.order import PROGRESS, LoopAnswer, Order
from desim.results.run import Run
from desim.scenario.schema.scenario import Scenario
from desim.units import NS_PER_S

STUCK_S = 120.0  # of computing without an instant of simulated time
_POLL_S = 0.1


def run_virtually(order: Order, scenario: Scenario, kernel: Path, memory_mb: int,
                  on_progress: Callable[[int, int], object]) -> Run:
    """Run ``order``, that of ``scenario``, on the guest ``kernel`` with so much memory.
    ``on_progress`` hears how many simulated seconds of how many are over. Raises ``InputError``
    where the programs need what is not there, and ``ModelError`` for a run that failed."""
    Path(order.out).mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix="desim-loop-") as home:
        folder = Path(home)
        order.write(folder)
        process = guest.boot(kernel, order, folder, scenario.seed, memory_mb)
        try:
            _wait(process, folder, scenario.stop.elapsed_ns // NS_PER_S, on_progress)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        said = _said(folder)
        answer = LoopAnswer.read(folder)
    if killed := re.search(r"Out of memory: Killed process \d+ \((.*?)\)", said):
        raise ModelError(f"the guest's memory is full ({memory_mb} MB), and Linux has killed "
                         f"{killed[1]}; --memory gives it more")
    if answer is None:
        lines = [line for line in said.splitlines() if line.strip()]
        raise ModelError("\n".join(["the guest ended without an answer; its last lines:",
                                    *lines[-8:]]))
    if answer.code == 2:
        raise InputError(answer.error)
    if answer.code:
        raise ModelError(f"{answer.error}\n{answer.traceback}")
    return Run(answer.path)


def _wait(process: subprocess.Popen[bytes], folder: Path, seconds: int,
          on_progress: Callable[[int, int], object]) -> None:
    """Wait for the guest's end. Raises ``ModelError`` for one whose clock stands still."""
    before, since_s = "", time.monotonic()
    while process.poll() is None:
        time.sleep(_POLL_S)
        file = folder / PROGRESS
        reached = file.read_text("utf-8") if file.is_file() else ""
        if reached != before:
            before, since_s = reached, time.monotonic()
            on_progress(int(reached or 0), seconds)
        if before and time.monotonic() - since_s > STUCK_S:
            busy = busy_program(process.pid) or "what computes there was not found"
            raise ModelError(f"the simulated clock has stood at {before} s for {STUCK_S:.0f} s: a "
                             f"program computes without end and never sleeps ({busy})")


def _said(folder: Path) -> str:
    """The output of the guest's kernel and of the process beside the programs."""
    return "".join((folder / name).read_text("utf-8", errors="replace")
                   for name in ("console", "output") if (folder / name).is_file())
