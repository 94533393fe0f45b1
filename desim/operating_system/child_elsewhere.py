"""A child process with what macOS and Windows have, too.

A thread waits for its death, a file has what it prints, and its standard input ends with its
parent. Windows kills it alone, not the processes that it has started.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from multiprocessing import Pipe, current_process
from multiprocessing.connection import Client, Connection, Listener
from typing import BinaryIO

from desim.operating_system.signals import cause_of_death

_KEY_BYTES = 32  # of multiprocessing's authkey


class PlainChild:
    """A ``Child``, which leads a group of its own where the system has such groups."""

    def __init__(self, module: str) -> None:
        key = bytes(current_process().authkey)
        output, self._path = tempfile.mkstemp(prefix="desim-", suffix=".log")
        self._output = open(self._path, "rb", buffering=0)  # noqa: SIM115 (until end)
        self._life, ended = Pipe(duplex=False)
        with Listener(authkey=key) as listener:
            self._process = subprocess.Popen(
                # -P: without the current folder in sys.path, where anybody's desim.py may lie.
                [sys.executable, "-P", "-m", module, str(listener.address)],
                stdin=subprocess.PIPE, stdout=output, stderr=output,
                # Ctrl-C is for the campaign, which ends its workers
                start_new_session=True,
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0))
            os.close(output)
            threading.Thread(target=self._watch, args=(ended, str(listener.address)),
                             daemon=True).start()
            try:
                self._input.write(key)
                self._input.flush()
                self.connection = listener.accept()
            except (EOFError, OSError):  # it died before it came to that
                self.connection, other = Pipe()
                other.close()

    @property
    def _input(self) -> BinaryIO:
        assert self._process.stdin is not None
        return self._process.stdin  # type: ignore[return-value]  # of bytes, as Popen was asked

    def _watch(self, ended: Connection, address: str) -> None:
        self._process.wait()
        with suppress(OSError):  # whoever waits for its connection has waited long enough
            Client(address).close()
        ended.close()

    @property
    def signs(self) -> list[Connection | int]:
        return [self.connection, self._life]

    def printed(self, most_bytes: int) -> bytes:
        return self._output.read(most_bytes) or b""

    def end(self) -> str:
        with suppress(ProcessLookupError, PermissionError):  # all of them are dead
            _kill(self._process)
        code = self._process.wait()
        for ours in (self.connection, self._life, self._output, self._input):
            with suppress(OSError):
                ours.close()
        with suppress(OSError):  # on Windows, while a process has it
            os.unlink(self._path)
        return cause_of_death(code)


def _kill(process: subprocess.Popen[bytes]) -> None:
    if hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def connection(argument: str) -> Connection:
    """The child's end of the connection."""
    parent = os.fdopen(os.dup(0), "rb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    key = parent.read(_KEY_BYTES)
    threading.Thread(target=_die_with_parent, args=(parent,), daemon=True).start()
    return Client(argument, authkey=key)


def _die_with_parent(parent: BinaryIO) -> None:
    parent.read()  # until nobody has the other end
    if hasattr(os, "killpg"):
        os.killpg(os.getpid(), signal.SIGKILL)  # with its children
    os._exit(1)
