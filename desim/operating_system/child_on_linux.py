"""A child process as Linux can have it: nothing that it does hides its death."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from multiprocessing.connection import Connection

IS_HERE = sys.platform == "linux" and hasattr(os, "pidfd_open")

_PR_SET_PDEATHSIG = 1  # prctl(2)


class LinuxChild:
    """A ``Child``, which leads a group of its own."""

    def __init__(self, module: str) -> None:
        ours, theirs = socket.socketpair()
        self._output, output = os.pipe()
        os.set_blocking(self._output, False)
        with theirs:
            self._process = subprocess.Popen(
                # -P: without the current folder in sys.path, where anybody's desim.py may lie.
                [sys.executable, "-P", "-m", module, str(theirs.fileno())],
                pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                start_new_session=True)  # Ctrl-C is for the campaign, which ends its workers
        os.close(output)
        self.connection = Connection(ours.detach())
        # Not the connection's end, which a child that lives on may hold open.
        self._life = os.pidfd_open(self._process.pid)
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
        with suppress(ProcessLookupError, PermissionError):  # all of them are dead
            os.killpg(self._process.pid, signal.SIGKILL)
        code = self._process.wait()
        self.connection.close()
        os.close(self._life)
        os.close(self._output)
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def connection(argument: str) -> Connection:
    """The child's end of the connection."""
    descriptor, parent = int(argument), os.getppid()
    # Even where a plug-in's machine code never lets Python have its turn.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        sys.exit()
    threading.Thread(target=_die_with_parent, args=(descriptor,), daemon=True).start()
    return Connection(descriptor)


def _die_with_parent(descriptor: int) -> None:
    hung_up = select.poll()
    hung_up.register(descriptor, 0)  # POLLHUP is always reported
    hung_up.poll()
    os.killpg(os.getpid(), signal.SIGKILL)  # with its children
