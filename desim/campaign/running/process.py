"""A worker's process as its driver sees it: the connection, the life, and what it prints."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from desim.files import refuse_link

_KEPT_BYTES = 65_536  # of what a run prints
_CHUNK_BYTES = 1 << 20


class WorkerProcess:
    """A process of ``desim.campaign.running.worker``, which leads a group of its own. ``signs`` are
    what to wait for: an answer, its death, more output. ``is_ready``: it has said that its start is
    over, with an answer of None."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self._output, output = os.pipe()
        os.set_blocking(self._output, False)
        with theirs:
            self._process = subprocess.Popen(
                # -P: without the current folder in sys.path, where anybody's desim.py may lie.
                [sys.executable, "-P", "-m", "desim.campaign.running.worker",
                 str(theirs.fileno())],
                pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                start_new_session=True)  # Ctrl-C is for the campaign, which ends its workers
        os.close(output)
        self.connection = Connection(ours.detach())
        # Not the connection's end, which a child that lives on may hold open.
        self._life = os.pidfd_open(self._process.pid)
        self._printed, self._printed_bytes = b"", 0
        self.is_ready = False
        self._silent = False  # nobody has the other end of its output

    @property
    def signs(self) -> list[Connection | int]:
        """Handles of which one becomes ready when something happens."""
        return [self.connection, self._life, *([] if self._silent else [self._output])]

    def drain(self) -> None:
        """Read what it has printed until now; only the beginning is kept."""
        for _ in range(64):  # it may print faster than anybody reads
            try:
                found = os.read(self._output, _CHUNK_BYTES)
            except BlockingIOError:
                return
            self._silent = not found
            if not found:
                return
            self._printed += found[:_KEPT_BYTES - len(self._printed)]
            self._printed_bytes += len(found)

    def keep_output(self, log: Path | None) -> None:
        """Write what it has printed since the last time into ``log``, and forget it."""
        self.drain()
        if log is not None and self._printed_bytes:
            cut = self._printed_bytes - len(self._printed)
            with suppress(OSError):  # a full disk ends a campaign by its results
                log.parent.mkdir(exist_ok=True)
                refuse_link(log.parent)
                refuse_link(log)
                log.write_bytes(self._printed + (f"\n[cut: {cut} bytes more]\n".encode() if cut
                                                 else b""))
        self._printed, self._printed_bytes = b"", 0

    def end(self) -> str:
        """Kill the process and its children; returns the cause of its death."""
        with suppress(ProcessLookupError, PermissionError):  # all of them are dead
            # What it is writing stays a .partial folder, which the next try empties.
            os.killpg(self._process.pid, signal.SIGKILL)
        code = self._process.wait()
        self.connection.close()
        os.close(self._life)
        os.close(self._output)
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
