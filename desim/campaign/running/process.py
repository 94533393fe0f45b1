"""A worker's process as its driver sees it: the connection, the life, and what it prints."""

from __future__ import annotations

from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from desim.files import refuse_link
from desim.operating_system.children import begun

_KEPT_BYTES = 65_536  # of what a run prints
_CHUNK_BYTES = 1 << 20


class WorkerProcess:
    """A process of ``desim.campaign.running.worker``. ``is_ready``: it has answered None, which
    says that it has started."""

    def __init__(self) -> None:
        self._child = begun("desim.campaign.running.worker")
        self._printed, self._printed_bytes = b"", 0
        self.is_ready = False

    @property
    def connection(self) -> Connection:
        """The connection by which tasks go out and answers come in."""
        return self._child.connection

    @property
    def signs(self) -> list[Connection | int]:
        """The handles to wait for: an answer, its death, more output."""
        return self._child.signs

    def drain(self) -> None:
        """Read what it has printed until now; only the beginning is kept."""
        for _ in range(64):  # it may print faster than anybody reads
            found = self._child.printed(_CHUNK_BYTES)
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
        # What it is writing stays a .partial folder, which the next try empties.
        return self._child.end()
