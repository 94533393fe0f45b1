"""Files that somebody else may have made, opened for reading; and files that reach the disk."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Sequence

# Flags of open(2). Windows has none of them.
NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_FOLDER = getattr(os, "O_DIRECTORY", 0)
_READ = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)

_HOLDS_FOLDERS = NO_LINK and _FOLDER and {os.open, os.stat} <= os.supports_dir_fd


def regular_file(path: str | os.PathLike, folder: int | None = None) -> int:
    """A descriptor of a file, by its path or by its name in an open ``folder``, where it is no
    link. Raises ``OSError`` for what is no regular file, which is not even opened: opening a pipe
    or a device may have effects."""
    refuse_irregular(os.stat(path, dir_fd=folder), path)
    link = 0 if folder is None else NO_LINK
    descriptor = os.open(path, _READ | link, dir_fd=folder)
    try:
        refuse_irregular(os.fstat(descriptor), path)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def regular_file_below(folder: str | os.PathLike, parts: Sequence[str]) -> int:
    """A descriptor of a regular file below a folder; no link on the way is followed. Where a system
    cannot hold folders open, another process may put one there between the look and the step."""
    if not _HOLDS_FOLDERS:
        path = os.fspath(folder)
        for part in parts:
            path = os.path.join(path, part)
            _refuse_link(os.lstat(path), part)
        return regular_file(path)
    *folders, last = parts
    at = os.open(folder, os.O_RDONLY | _FOLDER)
    try:
        for part in folders:
            _refuse_link(os.stat(part, dir_fd=at, follow_symlinks=False), part)
            below = os.open(part, os.O_RDONLY | _FOLDER | NO_LINK, dir_fd=at)
            os.close(at)
            at = below
        _refuse_link(os.stat(last, dir_fd=at, follow_symlinks=False), last)
        return regular_file(last, at)
    finally:
        os.close(at)


def _refuse_link(facts: os.stat_result, name: str) -> None:
    if stat.S_ISLNK(facts.st_mode):
        raise OSError(errno.ELOOP, "is a symbolic link, which desim does not follow", name)


def refuse_irregular(facts: os.stat_result, path: str | os.PathLike) -> None:
    """Raise ``OSError`` for what is no regular file."""
    if stat.S_ISDIR(facts.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if not stat.S_ISREG(facts.st_mode):
        raise OSError(errno.EINVAL, "is no regular file", os.fspath(path))


def synced(path: str | os.PathLike) -> None:
    """Wait until a file's content, or a folder's list of files, is on the disk (fsync). Windows
    keeps such lists itself, and syncs what is open for writing. Raises ``OSError``."""
    if not _FOLDER and os.path.isdir(path):
        return
    descriptor = os.open(path, os.O_RDONLY if _FOLDER else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def is_mine_alone(facts: os.stat_result) -> bool:
    """Whether a folder is this user's and nobody else may write in it. Windows says neither in
    these facts; there a user's own folders are nobody else's."""
    if not hasattr(os, "getuid"):
        return True
    return facts.st_uid == os.getuid() and not facts.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def user_name() -> str:
    """A name for this user's files among everybody's."""
    return str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
