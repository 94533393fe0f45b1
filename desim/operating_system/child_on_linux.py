"""A child process as Linux can have it: nothing that it does hides its death."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from multiprocessing.connection import Connection, wait

from desim.operating_system.guard_on_linux import guarded
from desim.operating_system.signals import cause_of_death

IS_HERE = sys.platform == "linux" and hasattr(signal, "sigwaitinfo")

_MOST_WAITED_S = 10.0  # for the guard, which has processes to kill


class LinuxChild:
    """A ``Child``. Between it and this process stands its guard, which leads a group of its own."""

    def __init__(self, module: str) -> None:
        ours, theirs = socket.socketpair()
        self._output, output = os.pipe()
        # Open while the guard lives. Not the connection's end, which the child's children may hold.
        self._life, life = os.pipe()
        os.set_blocking(self._output, False)
        with theirs:
            self._guard = subprocess.Popen(
                # -P: without the current folder in sys.path, where anybody's desim.py may lie.
                [sys.executable, "-P", "-m", module, f"{theirs.fileno()},{life}"],
                pass_fds=[theirs.fileno(), life], stdin=subprocess.DEVNULL, stdout=output,
                stderr=output,
                start_new_session=True)  # Ctrl-C is for the campaign, which ends its workers
        os.close(output)
        os.close(life)
        self.connection = Connection(ours.detach())
        self._silent = False  # nobody has the other end of its output

    @property
    def signs(self) -> list[Connection | int]:
        return [self.connection, self._life, *([] if self._silent else [self._output])]

    def printed(self, most_bytes: int) -> bytes:
        with suppress(BlockingIOError):
            found = os.read(self._output, most_bytes)
            self._silent = not found
            return found
        return b""

    def end(self) -> str:
        for number in (signal.SIGTERM, signal.SIGCONT):  # it may have been stopped
            os.kill(self._guard.pid, number)  # or its zombie
        wait([self._life], _MOST_WAITED_S)
        with suppress(ProcessLookupError, PermissionError):  # all of them are dead
            os.killpg(self._guard.pid, signal.SIGKILL)
        code = self._guard.wait()
        cause = os.read(self._life, 100).decode("ascii")
        self.connection.close()
        os.close(self._life)
        os.close(self._output)
        return cause or cause_of_death(code)


def connection(argument: str) -> Connection:
    """The child's end of the connection."""
    descriptor, life = map(int, argument.split(","))
    guarded(life, descriptor)
    return Connection(descriptor)
