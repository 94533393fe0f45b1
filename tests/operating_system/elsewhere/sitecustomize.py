"""This machine without what Windows lacks; Python imports it at its start, in workers, too.

What the standard library needs on Linux is imported first and keeps what it has.
"""

import functools
import io
import os
import pathlib  # noqa: F401
import selectors  # noqa: F401
import shutil
import signal
import subprocess  # noqa: F401
import sys
import tempfile  # noqa: F401
import types

# msvcrt, with locks that Linux has, too.
stand_in = types.ModuleType("msvcrt")
stand_in.LK_LOCK, stand_in.LK_NBLCK = os.F_LOCK, os.F_TLOCK


def locking(descriptor, how, size, lockf=os.lockf):
    """Lock a file. Raises ``PermissionError`` where another process has it."""
    try:
        lockf(descriptor, how, size)
    except BlockingIOError as error:
        raise PermissionError(*error.args) from None


stand_in.locking = locking
sys.modules["msvcrt"] = stand_in
for name in "fcntl", "grp", "pwd", "resource", "syslog", "termios":
    sys.modules[name] = None

for owner, names in (
        (os, "O_DIRECTORY O_NOFOLLOW O_NONBLOCK getuid geteuid getpgid killpg lockf mkfifo "
             "pidfd_open pread register_at_fork sched_getaffinity set_blocking setsid sysconf"),
        (signal, "pthread_sigmask pthread_kill setitimer sigwait sigwaitinfo"),
        (sys.modules["select"], "epoll poll")):
    for name in names.split():
        delattr(owner, name)

# As on Windows, no call takes an open folder.
os.supports_dir_fd.clear()
shutil._use_fd_functions = shutil.rmtree.avoids_symlink_attacks = False


def outside_of_proc(function):
    """A function that finds no file below /proc, and takes no ``dir_fd``."""
    @functools.wraps(function)
    def found(path=".", *arguments, **keys):
        if keys.get("dir_fd") is not None:
            raise NotImplementedError("dir_fd unavailable on this platform")
        if isinstance(path, str | os.PathLike) and os.fspath(path).startswith("/proc"):
            raise FileNotFoundError(2, "No such file or directory", path)
        return function(path, *arguments, **keys)
    return found


for name in "stat", "lstat", "open", "scandir", "listdir":
    setattr(os, name, outside_of_proc(getattr(os, name)))
io.open = outside_of_proc(io.open)
__builtins__["open"] = io.open
