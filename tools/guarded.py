"""A command of desim in a process of its own, with limits, under an audit hook.

    python tools/guarded.py FOLDER COMMAND...

The hook ends the process with exit code 99 if code in FOLDER is run, another program is started, or
a file is written or removed outside of FOLDER's ``out`` and runs, and of the folders for temporary
files and for compiled kernels. CPU time and address space are limited, too. ``measured`` also tells
the largest resident memory; a child's begins with its caller's, so that one must be small.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

CPU_S, WALL_S, MEMORY_BYTES = 30, 240, 500_000_000
_ADDRESSES_BYTES = 6 * 2**30  # so that the machine survives; resident memory is judged
_FORBIDDEN = 99
_STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.fork", "pty.spawn")
_REMOVES = ("os.remove", "os.rmdir", "os.rename", "os.link", "os.symlink", "os.truncate",
            "os.chmod", "shutil.rmtree", "os.mkdir")


class Outcome(NamedTuple):
    """The end of a command; ``wrong`` is empty if it is as it must be."""

    wrong: str
    code: int
    cpu_s: float
    memory_bytes: int
    said: str


def measured(folder: Path, words: list[str], base_bytes: int) -> Outcome:
    """Run ``desim WORDS`` in ``folder``; ``base_bytes`` is the memory of a command at rest."""
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen([sys.executable, __file__, str(folder), *words], cwd=folder,
                                   env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
                                   stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        timer = subprocess.Popen(["sleep", str(WALL_S)])
        while True:
            ended, status, usage = os.wait4(-1, 0)
            if ended == process.pid:
                break
            process.kill()
        timer.kill()
        timer.wait()
        process.returncode = code = os.waitstatus_to_exitcode(status)
        output.seek(0)
        said = output.read(1_000_000).decode(errors="replace")
    cpu_s, memory_bytes = usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024 - base_bytes
    wrong = ("forbidden" if code == _FORBIDDEN else
             "time" if code < 0 or cpu_s > CPU_S else
             "memory" if memory_bytes > MEMORY_BYTES else
             "traceback" if "Traceback" in said or "desim failed" in said else
             "exit code" if code not in (0, 1, 2) else
             "no word" if code == 2 and not said.strip() else "")
    return Outcome(wrong, code, cpu_s, memory_bytes, said)


def _watch(folder: Path) -> None:
    inside = str(folder)
    allowed = [str(folder / "out"), "/dev/null", *map(str, folder.glob("results/*/*")),
               tempfile.gettempdir() + "/tmp",
               f"/proc/{os.getpid()}/clear_refs",  # resets the peak of memory
               *(str(Path.home() / name) for name in (".cache", ".config/matplotlib"))]

    def refused(path: Any, at: Any = None) -> bool:
        if isinstance(path, int):
            return False
        base = f"/proc/self/fd/{at}" if isinstance(at, int) and at >= 0 else os.getcwd()
        full = os.path.realpath(os.path.join(os.path.realpath(base), os.fsdecode(path)))
        return not any(full == place or full.startswith(place) for place in allowed)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        why = ""
        # A sweep's workers are this interpreter; platform.platform() asks uname.
        if event in _STARTS and arguments[0] not in (sys.executable, "uname"):
            why = f"starts {arguments[0]!r}"
        elif event == "exec" and str(arguments[0].co_filename).startswith(inside + os.sep):
            why = f"runs {arguments[0].co_filename}"
        elif event == "open" and arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) \
                and refused(arguments[0]):
            why = f"writes {arguments[0]!r}"
        elif event in _REMOVES and refused(
                arguments[0], arguments[-1] if event in ("os.remove", "os.rmdir") else None):
            why = f"{event} {arguments[0]!r}"
        if why:
            os.write(2, f"forbidden: {why}\n".encode(errors="replace"))
            os._exit(_FORBIDDEN)

    sys.addaudithook(hook)


def main() -> None:
    folder = Path(sys.argv[1]).resolve()
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S + 2, CPU_S + 2))
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES_BYTES, _ADDRESSES_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    from desim.cli import app

    _watch(folder)
    app(sys.argv[2:])


if __name__ == "__main__":
    main()
