"""Commands of desim in processes of their own, with limits, under an audit hook.

    with Guard() as guard:
        outcome = guard.measured(folder, ["check", "run"])

The hook ends the process with exit code 99 if code in the folder is run, another program is
started, or a file is written or removed outside of its ``out``, runs and campaign, and of the
folders for temporary files and for compiled kernels. CPU time and address space are limited, too.
``measured`` also tells the largest resident memory, above that of a command at rest. It looks at
all files before and after, and at the pages that were written.

The processes are forks of one that has imported what commands use: this costs none of them time.
"""

from __future__ import annotations

import fnmatch
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple

CPU_S, WALL_S, MEMORY_BYTES = 30, 240, 500_000_000
_ADDRESSES_BYTES = 6 * 2**30  # so that the machine survives; resident memory is judged
_FORBIDDEN = 99
_STARTS = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.fork", "pty.spawn")
_REMOVES = ("os.remove", "os.rmdir", "os.rename", "os.link", "os.symlink", "os.truncate",
            "os.chmod", "shutil.rmtree", "os.mkdir")
MINE = "mine.txt"  # the user's own, wherever it is
# What a command may write in the folder beside ``out``.
_WRITES = {"view": "*/replay.html", "figure": "*/figure.png", "report": "campaign/report/*",
           "sweep": "campaign/*"}


class Outcome(NamedTuple):
    """The end of a command; ``wrong`` is empty if it is as it must be."""

    wrong: str
    code: int
    cpu_s: float
    memory_bytes: int
    said: str


class Guard:
    """The process whose forks are the commands."""

    def __enter__(self) -> Guard:
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
        self._base_bytes = 0
        with tempfile.TemporaryDirectory() as folder:
            self._base_bytes = self.measured(Path(folder), ["--version"]).memory_bytes
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def made(self, folder: Path, kind: str, number: int) -> list[list[str]]:
        """Make the hostile file of this kind and number in ``folder``; returns commands for it."""
        (folder / "out").mkdir(parents=True)
        code, _, _, said = self._forked("make", str(folder), kind, number)
        if code:
            raise RuntimeError(f"{kind} {number}: {said}")
        return json.loads(said.splitlines()[-1])

    def _forked(self, *request: object) -> tuple[int, float, int, str]:
        """Send a request; returns the exit code, the CPU time, the memory, and what was said."""
        with tempfile.NamedTemporaryFile() as output:
            print(json.dumps([output.name, *request]), file=self._process.stdin, flush=True)
            return *json.loads(self._process.stdout.readline()), output.read(
                1_000_000).decode(errors="replace")

    def measured(self, folder: Path, words: list[str]) -> Outcome:
        """Run ``desim WORDS`` in ``folder``."""
        before = _files(folder, words[0])
        code, cpu_s, memory_bytes, said = self._forked("command", str(folder), *words)
        changed = sorted({name for name, _ in before ^ _files(folder, words[0])})
        pages = [Path(top) / name for top, _, names in os.walk(folder) for name in names
                 if name.endswith(".html") and os.path.isfile(os.path.join(top, name))]
        memory_bytes -= self._base_bytes
        return Outcome(_wrong(code, cpu_s, memory_bytes, said)
                       or (f"changed {changed[:3]}" if changed else
                           "page" if any(map(_is_evil, pages)) else ""),
                       code, cpu_s, memory_bytes, said)


def _wrong(code: int, cpu_s: float, memory_bytes: int, said: str) -> str:
    return ("forbidden" if code == _FORBIDDEN else
            "time" if -code in (signal.SIGALRM, signal.SIGXCPU) or cpu_s > CPU_S else
            "died" if code < 0 else
            "memory" if memory_bytes > MEMORY_BYTES else
            "traceback" if "Traceback" in said or "desim failed" in said else
            "exit code" if code not in (0, 1, 2) else
            "no word" if code == 2 and not said.strip() else
            "escape" if "\x1b[31m" in said or "\x1b]" in said else "")


def _files(folder: Path, command: str) -> set[tuple[str, tuple[int, ...]]]:
    """All files that the command may not change, with what would change with them."""
    found = set()
    for top, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(top, name)
            inside = os.path.relpath(path, folder)
            own = fnmatch.fnmatch(inside, _WRITES.get(command, "")) or inside.startswith("out/")
            if not own or name == MINE:
                facts = os.lstat(path)
                found.add((inside, (facts.st_mode, facts.st_size, facts.st_mtime_ns,
                                    facts.st_ino)))
    return found


class _Page(HTMLParser):
    """Finds markup of an attacker that has become part of a page."""

    evil = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.evil |= tag == "evil" or any(name.startswith("on") for name, _ in attrs)

    def handle_data(self, data: str) -> None:
        self.evil |= self.cdata_elem == "script" and data.strip().startswith("evil()")


def _is_evil(page: Path) -> bool:
    parser = _Page()
    parser.feed(page.read_text())
    return parser.evil


def _watch(folder: Path) -> None:
    inside = str(folder)
    allowed = [str(folder / "out"), "/dev/null", *map(str, folder.glob("results/*/*")),
               f"{folder}/campaign",
               *(f"{tempfile.gettempdir()}/{name}" for name in ("tmp", "desim-")),
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


def _make(name: str, kind: str, number: int) -> None:
    import hostile_files

    print(json.dumps(hostile_files.hostile(Path(name), kind, number)))


def _command(name: str, *words: str) -> None:
    """Become the command."""
    folder = Path(name).resolve()
    os.chdir(folder)
    signal.alarm(WALL_S)
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S + 2, CPU_S + 2))
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES_BYTES, _ADDRESSES_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.argv = ["desim", *words]
    from desim.cli import app

    _watch(folder)
    try:
        app(words)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    sys.stdout.flush()
    os._exit(code)  # threads of the process that was forked are not here to be ended


def main() -> None:
    from desim.commands import campaigns, exports, pictures, results, runs  # noqa: F401
    from desim.report import run_figure  # noqa: F401
    from desim.report.campaign import campaign_report  # noqa: F401
    from desim.simulation import simulation  # noqa: F401

    for line in sys.stdin:
        output, what, *words = json.loads(line)
        if not (child := os.fork()):
            os.dup2(os.open("/dev/null", os.O_RDONLY), 0)
            for stream in (1, 2):
                os.dup2(os.open(output, os.O_WRONLY | os.O_APPEND), stream)
            (_make if what == "make" else _command)(*words)
            return
        _, status, usage = os.wait4(child, 0)
        print(json.dumps([os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime,
                          usage.ru_maxrss * 1024]), flush=True)


if __name__ == "__main__":
    main()
