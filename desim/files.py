"""Reading and writing of files in folders that others may have changed."""

from __future__ import annotations

import errno
import math
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path

from desim.errors import unwritable


def content(path: str | os.PathLike, most_bytes: int) -> bytes:
    """All of a file. Raises ``OSError``, also where reading might never end (a FIFO, a device) and
    for a file of more than ``most_bytes``, and ``ValueError`` for a path that cannot be one."""
    with opened(path, most_bytes) as file:
        return file.read()


@contextmanager
def opened(path: str | os.PathLike, most_bytes: float = math.inf) -> Iterator[BufferedReader]:
    """A file to read. Raises ``OSError`` unless it is a regular file of at most ``most_bytes``."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # else a FIFO waits for a writer
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "is no regular file", os.fspath(path))
        size_bytes = os.fstat(descriptor).st_size
        if size_bytes > most_bytes:
            raise OSError(errno.EFBIG, f"has {size_bytes / 1e6:.1f} MB; at most "
                                       f"{most_bytes / 1e6:.0f} MB", os.fspath(path))
        with open(descriptor, "rb", closefd=False) as file:
            yield file
    finally:
        os.close(descriptor)


def refuse_link(path: str | os.PathLike) -> None:
    """Raise ``OSError`` for a symbolic link: what is written to it would go elsewhere."""
    if os.path.islink(path):
        raise OSError(errno.ELOOP, "is a symbolic link, which desim does not write through",
                      os.fspath(path))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A file to write, which replaces ``path`` when it is complete and on the disk; if something
    goes wrong ``path`` stays as it was. Raises ``OSError``, which names ``path``."""
    _refuse_special(path)
    beside = path.with_name(f".{path.name}.new")
    try:
        beside.unlink(missing_ok=True)  # it may be a link
        yield beside
        synced(beside)
        os.replace(beside, path)
    except BaseException as error:
        with suppress(OSError):
            beside.unlink(missing_ok=True)
        if isinstance(error, OSError) and str(error.filename) == str(beside):
            raise OSError(error.errno, error.strerror, os.fspath(path)) from error
        raise


def _refuse_special(path: Path) -> None:
    """Raise ``OSError`` for a folder, and for a device or a pipe: they would be gone."""
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        return
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is no regular file", os.fspath(path))


def synced(path: str | os.PathLike) -> None:
    """Wait until a file's content, or a folder's list of files, is on the disk (fsync). Raises
    ``OSError``."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def writing(path: Path, option: str) -> Iterator[None]:
    """Turn errors of writing ``path``, which ``option`` has named, into an ``InputError``."""
    try:
        yield
    except OSError as error:
        raise unwritable(f"{option}: {path}", error) from error


@contextmanager
def target(path: Path, option: str) -> Iterator[Path]:
    """A file to write in place of ``path``, which ``option`` has named and which it replaces when
    it is complete; if something goes wrong ``path`` stays as it was. Raises ``InputError`` where it
    cannot be written."""
    with writing(path, option), replacing(path) as beside:
        beside.touch()  # what cannot be written is said before the work is done
        beside.unlink()
        yield beside
