"""The node that starts the real programs of a host, and ends them with it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from desim.engine.kernel import Phase
from desim.errors import InputError
from desim.loop.environment import path
from desim.loop.program_input import ProgramInput
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.ports.networks import Handle
from desim.scenario.schema.loop import Program
from desim.units import NS_PER_S

GRACE_S = 2.0  # between SIGTERM and SIGKILL, as docker stop has ten (our choice)
_PLAIN = re.compile(r"[\w./+-]+")  # a word that means itself to a shell


class ProgramEnd(NamedTuple):
    """The end of a program. ``code``: its exit code, minus a signal's number, or None where it ran
    until the end of the run, or until its host stopped. ``at_s``: when it ended by itself."""

    host: str
    run: str
    log: str
    code: int | None
    at_s: float | None = None

    def __str__(self) -> str:
        return f"{self.host:12} {self.run}: " + (
            "ran until the end" if self.code is None else f"exit code {self.code}" + (
                "" if self.at_s is None else f" at {self.at_s:.3f} s"))


OnEnd = Callable[[ProgramEnd], object]  # gets the end of a program that ended by itself


class ProgramStarter(Node):
    """Starts ``programs`` of its host in its network namespace. Their output goes to files
    ``HOST.NUMBER.log`` in the folder ``logs``. ``inputs`` notice when they end."""

    def __init__(self, host: Host, programs: Sequence[tuple[int, Program]],
                 env: Mapping[str, str], logs: Path, inputs: ProgramInput, on_end: OnEnd) -> None:
        super().__init__(host, "programs")
        self._programs, self._env, self._logs = programs, env, logs
        self._inputs, self._on_end = inputs, on_end
        for number, _ in programs:
            self._log(number).unlink(missing_ok=True)  # of an earlier run that was killed
        # By a descriptor that can be read once the program has ended (pidfd_open(2)).
        self._running: dict[int, tuple[int, Program, subprocess.Popen[bytes]]] = {}
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
        running = [self._forget(descriptor) for descriptor in [*self._running]]
        self._ends += [
            ProgramEnd(self.host.name, program.run, self._log(number).name, process.poll())
            for number, program, process in running]
        terminate([process for _, _, process in running])
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
        descriptor = os.pidfd_open(process.pid)
        self._running[descriptor] = number, program, process
        self._inputs.watch(descriptor, partial(self._has_ended, descriptor))

    def _has_ended(self, descriptor: int, now_ns: int) -> None:
        number, program, process = self._forget(descriptor)
        end = ProgramEnd(self.host.name, program.run, self._log(number).name, process.wait(),
                         now_ns / NS_PER_S)
        self._ends.append(end)
        self._on_end(end)

    def _forget(self, descriptor: int) -> tuple[int, Program, subprocess.Popen[bytes]]:
        self._inputs.forget(descriptor)
        os.close(descriptor)
        return self._running.pop(descriptor)


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


def refuse_missing(programs: Sequence[Program]) -> None:
    """Raise ``InputError`` for a program whose first word is no command here. A word with a meaning
    to the shell, such as a variable, is for the shell to judge."""
    for number, program in enumerate(programs):
        word = program.run.split()[0]
        if not _PLAIN.fullmatch(word):
            continue
        env = {"PATH": path(os.environ), **program.env}
        found = subprocess.run(["/bin/sh", "-c", 'command -v "$1"', "sh", word], env=env,
                               cwd=program.folder, capture_output=True, check=False)
        if found.returncode:
            raise InputError(f"loop.programs.{number}.run: there is no program {word}; allowed: "
                             f"one in PATH, or a file in {program.folder}")
