"""Locks between processes: the system gives them back when their process dies."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from desim.operating_system.folders import NO_LINK

try:
    import fcntl
except ImportError:  # Windows
    # typeshed has them on Windows alone
    from msvcrt import LK_LOCK, LK_NBLCK, locking  # type: ignore[attr-defined]

    OUTLIVES_ITS_FILE = False  # and a folder with an open file cannot be renamed

    def _locked(descriptor: int) -> bool:
        """Lock a file, unless another process has."""
        with suppress(PermissionError):
            locking(descriptor, LK_NBLCK, 1)
            return True
        return False

    def _wait_for_lock(descriptor: int) -> None:
        while True:
            with suppress(OSError):  # after ten tries, one a second
                locking(descriptor, LK_LOCK, 1)
                return
else:
    OUTLIVES_ITS_FILE = True

    def _locked(descriptor: int) -> bool:
        """Lock a file, unless another process has."""
        with suppress(BlockingIOError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        return False

    def _wait_for_lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX)


class Taken(Exception):
    """Another process has the lock."""


class Lock:
    """A lock on a file, which is made if need be; no link is followed. Raises ``Taken``, or
    ``OSError`` where the file cannot be opened or locked."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._descriptor: int | None = os.open(path, os.O_CREAT | os.O_RDWR | NO_LINK)
        try:
            if not _locked(self._descriptor):
                raise Taken
        except BaseException:
            self.release()
            raise

    def remove_file(self) -> None:
        """Remove the file; this keeps the lock where the system can."""
        if not OUTLIVES_ITS_FILE:
            self.release()
        self._path.unlink()

    def release(self) -> None:
        """Give the lock back, if this has it still."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def waited_for(path: Path) -> bool:
    """Wait until no process has the lock on a file; returns whether one had. Raises ``OSError``
    where there is no such file, or no lock."""
    with open(path, "r+b") as file:
        if _locked(file.fileno()):
            return False
        _wait_for_lock(file.fileno())
    return True
