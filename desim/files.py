"""Reading and writing of files in folders that others may have changed."""

from __future__ import annotations

import errno
import math
import os
import posixpath
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader
from pathlib import Path, PurePosixPath

from desim.errors import InputError, unwritable
from desim.operating_system.folders import (
    refuse_irregular,
    regular_file,
    regular_file_below,
    synced,
)


def content(path: str | os.PathLike, most_bytes: int) -> bytes:
    """All of a file. Raises ``OSError``, also where reading might never end (a FIFO, a device) and
    for a file of more than ``most_bytes``, and ``ValueError`` for a path that cannot be one."""
    with opened(path, most_bytes) as file:
        return file.read()


@contextmanager
def opened(path: str | os.PathLike, most_bytes: float = math.inf) -> Iterator[BufferedReader]:
    """A file to read. Raises ``OSError`` unless it is a regular file of at most ``most_bytes``."""
    with _sized(regular_file(path), path, most_bytes) as file:
        yield file


def content_below(folder: str | os.PathLike, name: object, most_bytes: int) -> bytes:
    """All of a file that ``opened_below`` opens."""
    with opened_below(folder, name, most_bytes) as file:
        return file.read()


@contextmanager
def opened_below(folder: str | os.PathLike, name: object, most_bytes: float = math.inf,
                 ) -> Iterator[BufferedReader]:
    """The file ``name`` in a folder that somebody else may have made: a plain name, or several with
    ``/`` between them. Below ``folder`` no link is followed, and nothing but a regular file of at
    most ``most_bytes`` is opened. Raises ``OSError``, whose ``strerror`` says what is wrong."""
    parts = plain_parts(name)
    with _sized(regular_file_below(folder, parts), parts[-1], most_bytes) as file:
        yield file


def plain_parts(name: object) -> list[str]:
    """The parts of a name that a file gives of another one. Raises ``OSError`` where it may lead
    out of its folder, or is nothing that a file can be called."""
    parts = name.split("/") if isinstance(name, str) else [""]
    if not all(part.isprintable() and part not in (".", "..") and part
               and os.path.split(part) == ("", part) for part in parts):
        raise OSError(errno.EINVAL, f"{name!r} is no name of a file in a folder")
    return parts


def name_in(folder: Path, name: str) -> str:
    """A name for ``opened_below``, without parts that lead nowhere; of a path on another machine
    its longest end that is in ``folder``."""
    flat = PurePosixPath(posixpath.normpath(name))
    ends = [PurePosixPath(*flat.parts[first:]) for first in range(1, len(flat.parts))]
    here = [end for end in ends if flat.is_absolute() and (folder / end).is_file()]
    return str(here[0] if here else flat)


def near(folder: Path, name: str) -> tuple[Path, str]:
    """A folder, and the name below it for ``opened_below``, of a file that one in ``folder`` names:
    that folder, or the one above it."""
    flat, above = name_in(folder, name), folder.parent
    if flat.startswith("../"):
        return above, flat[3:]
    return (above, name_in(above, name)) if flat.startswith("/") else (folder, flat)


@contextmanager
def _sized(descriptor: int, path: str | os.PathLike, most_bytes: float) -> Iterator[BufferedReader]:
    """An open file of at most ``most_bytes``."""
    try:
        size_bytes = os.fstat(descriptor).st_size
        if size_bytes > most_bytes:
            raise OSError(errno.EFBIG, f"has {size_bytes / 1e6:.1f} MB; at most "
                                       f"{most_bytes / 1e6:.0f} MB", os.fspath(path))
        with open(descriptor, "rb", closefd=False) as file:
            yield file
    finally:
        os.close(descriptor)


@contextmanager
def reading(path: object) -> Iterator[None]:
    """Turn errors of reading ``path`` into an ``InputError``."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def refuse_link(path: str | os.PathLike) -> None:
    """Raise ``OSError`` for a symbolic link: what is written to it would go elsewhere."""
    if os.path.islink(path):
        raise OSError(errno.ELOOP, "is a symbolic link, which desim does not write through",
                      os.fspath(path))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A file to write, which replaces ``path`` when it is complete and on the disk; if something
    goes wrong ``path`` stays as it was. Raises ``OSError``, which names ``path``, also for a link.
    """
    refuse_link(path)
    with suppress(FileNotFoundError):  # a folder stays, and a device or a pipe would be gone
        refuse_irregular(os.stat(path), path)
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
