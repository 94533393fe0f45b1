"""An order: what the process beside the real programs is to run, and what it answers."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import NamedTuple

MEMORY_MB = 1500  # of a guest, unless the user says; ten hosts with Python programs run in it
# Files in the order's folder. STOP, once it is there, ends the run in good order; NEWS has lines
# for the user.
ORDER, ANSWER, PROGRESS, NEWS, STOP = "order.json", "answer.json", "progress", "news", "stop"
INTERRUPTED = 130  # the exit code of a run that STOP has ended
CONSOLE, OUTPUT = OUTPUTS = "console", "output"  # of the guest's kernel; of the process


class Order(NamedTuple):
    """A run with real programs. ``changes``: as ``desim.load`` takes them. ``command``: what was
    typed. ``clock``: virtual or wall. ``capture``: whether the frames are kept, as pcap."""

    scenario: str
    changes: list[str]
    seed: int | None
    out: str
    command: str
    clock: str = "virtual"
    capture: bool = False

    def write(self, folder: Path) -> None:
        """Leave the order in ``folder``, with absolute paths."""
        whole = self._replace(scenario=os.path.abspath(self.scenario),
                              out=os.path.abspath(self.out))
        (folder / ORDER).write_text(json.dumps(whole), "utf-8")

    @classmethod
    def read(cls, folder: Path) -> Order:
        """The order that lies in ``folder``."""
        return cls(*json.loads((folder / ORDER).read_text("utf-8")))


class LoopAnswer(NamedTuple):
    """The folder of a run (``path``), or its ``error``, with the exit code of both."""

    code: int
    path: str = ""
    error: str = ""
    traceback: str = ""

    def write(self, folder: Path) -> None:
        """Leave the answer in ``folder``."""
        (folder / ANSWER).write_text(json.dumps(self), "utf-8")

    @classmethod
    def read(cls, folder: Path) -> LoopAnswer | None:
        """The answer that lies in ``folder``, if there is one."""
        file = folder / ANSWER
        return cls(*json.loads(file.read_text("utf-8"))) if file.is_file() else None
