"""The process that carries out an order, from outside: its progress, its end and its answer."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from desim.errors import InputError, ModelError
from desim.loop.order import INTERRUPTED, NEWS, OUTPUTS, PROGRESS, STOP, LoopAnswer, Order
from desim.results.run import Run
from desim.units import NS_PER_S

_POLL_S = 0.1
GRACE_S = 20.0  # for the end of a run that is interrupted: of programs, and of writing its folder

Process = subprocess.Popen[bytes]


class Watcher(NamedTuple):
    """The watcher of a run. ``on_progress`` gets the simulated seconds that are over, and of how
    many; ``on_news`` a line, such as that a program has failed."""

    on_progress: Callable[[int, int], object]
    on_news: Callable[[str], object]


class Supervisor(NamedTuple):
    """The supervision of one system. ``start`` starts the process for the order in a folder;
    ``stuck(process, reached, since_s)`` and ``failed(said)`` raise ``ModelError`` where the clock
    stands still, and for what has been printed."""

    start: Callable[[Path], Process]
    stuck: Callable[[Process, str, float], object]
    failed: Callable[[str], object]


def carried_out(order: Order, elapsed_ns: int, supervisor: Supervisor, watcher: Watcher) -> Run:
    """Have ``order`` carried out, which is to last ``elapsed_ns``. Ctrl-C ends the run in good
    order, a second one at once. Raises ``InputError`` where the programs need what is not there,
    ``ModelError`` for a run that failed, and ``KeyboardInterrupt`` with the path of what was kept.
    """
    with TemporaryDirectory(prefix="desim-loop-") as home:
        folder = Path(home)
        order.write(folder)
        process = supervisor.start(folder)
        try:
            _wait(process, folder, elapsed_ns // NS_PER_S, supervisor, watcher)
        except KeyboardInterrupt:
            (folder / STOP).touch()
            with suppress(subprocess.TimeoutExpired):
                process.wait(GRACE_S)
            if LoopAnswer.read(folder) is None:
                raise
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        said = _said(folder)
        answer = LoopAnswer.read(folder)
    supervisor.failed(said)
    if answer is None:
        lines = [line for line in said.splitlines() if line.strip()]
        raise ModelError("\n".join(["the process beside the programs ended without an answer; its "
                                    "last lines:", *lines[-8:]]))
    if answer.code == INTERRUPTED:
        raise KeyboardInterrupt(answer.path)
    if answer.code == 2:
        raise InputError(answer.error)
    if answer.code:
        raise ModelError(f"{answer.error}\n{answer.traceback}")
    return Run(answer.path)


def _wait(process: Process, folder: Path, seconds: int, supervisor: Supervisor,
          watcher: Watcher) -> None:
    """Wait for the end of ``process``."""
    before, since_s, shown = "", time.monotonic(), 0
    while process.poll() is None:
        time.sleep(_POLL_S)
        file = folder / PROGRESS
        reached = file.read_text("utf-8") if file.is_file() else ""
        if reached != before:
            before, since_s = reached, time.monotonic()
            watcher.on_progress(int(reached or 0), seconds)
        shown = _pass_on(folder, shown, watcher)
        if before:
            supervisor.stuck(process, before, time.monotonic() - since_s)
    _pass_on(folder, shown, watcher)


def _pass_on(folder: Path, shown: int, watcher: Watcher) -> int:
    """Pass on to ``watcher`` the news behind the first ``shown`` lines. Returns how many there are.
    """
    file = folder / NEWS
    lines = file.read_text("utf-8").splitlines(keepends=True) if file.is_file() else []
    whole = [line.rstrip("\n") for line in lines if line.endswith("\n")]
    for line in whole[shown:]:
        watcher.on_news(line)
    return len(whole)


def _said(folder: Path) -> str:
    """The output of the process, and of the guest's kernel."""
    return "".join((folder / name).read_text("utf-8", errors="replace")
                   for name in OUTPUTS if (folder / name).is_file())
