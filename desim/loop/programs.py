"""The node that starts the real programs of a host, and ends them with it."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from desim.engine.kernel import Phase
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.ports.networks import Handle
from desim.scenario.schema.loop import Program

GRACE_S = 2.0  # between SIGTERM and SIGKILL, as docker stop has ten (our choice)


class ProgramEnd(NamedTuple):
    """The end of a program. ``code``: its exit code, minus a signal's number, or None where it ran
    until the end of the run, or until its host stopped."""

    host: str
    run: str
    log: str
    code: int | None


class ProgramStarter(Node):
    """Starts ``programs`` of its host in its network namespace. Their output goes to files
    ``HOST.NUMBER.log`` in the folder ``logs``."""

    def __init__(self, host: Host, programs: Sequence[tuple[int, Program]],
                 env: Mapping[str, str], logs: Path) -> None:
        super().__init__(host, "programs")
        self._programs, self._env, self._logs = programs, env, logs
        for number, _ in programs:
            self._log(number).unlink(missing_ok=True)  # of an earlier run that was killed
        self._running: list[tuple[int, Program, subprocess.Popen[bytes]]] = []
        self._starts: list[Handle] = []
        self._ends: list[ProgramEnd] = []

    def start(self) -> None:
        self._alive = True  # the node is the same after its host was down
        kernel = self._graph.kernel
        self._starts = [kernel.after(max(program.at_ns - kernel.now_ns, 0), Phase.CONTROL,
                                     self.host.id, self._start, (number, program))
                        for number, program in self._programs]

    def stop(self) -> None:
        super().stop()
        for start in self._starts:
            start.cancel()
        self.end()

    def end(self) -> list[ProgramEnd]:
        """End all programs. Returns the ends of all that ever ran here."""
        self._ends += [
            ProgramEnd(self.host.name, program.run, self._log(number).name, process.poll())
            for number, program, process in self._running]
        terminate([process for _, _, process in self._running])
        self._running = []
        return self._ends

    def _log(self, number: int) -> Path:
        return self._logs / f"{self.host.name}.{number}.log"

    def _start(self, what: tuple[int, Program]) -> None:
        number, program = what
        with self._log(number).open("ab") as log:
            process = subprocess.Popen(
                namespace_command(self.host.name, ["/bin/sh", "-c", program.run]),
                cwd=program.folder, env={**self._env, **program.env}, stdin=subprocess.DEVNULL,
                stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
        self._running.append((number, program, process))


def namespace_command(host: str, command: Sequence[str]) -> list[str]:
    """``command`` in the network namespace of ``host``."""
    return ["ip", "netns", "exec", host, *command]


def terminate(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    """End processes, and all that they have started, with SIGTERM, and after a grace with SIGKILL.
    """
    for process in processes:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
    for process in processes:
        try:
            process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
