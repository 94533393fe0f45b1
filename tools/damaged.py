"""Damaged scenarios, designs, run and campaign folders. ``tools/fuzz.py damaged`` plays them.

Text and values are mutated; files are cut, reversed, removed, or replaced by folders, links, FIFOs
and devices; foreign files lie in all places. Then commands meet it. None may end in a traceback,
hang, or leave with another exit code than 0, 1 or 2; foreign files and every run that was whole
must still be there; nothing outside the folder may be written; a campaign that ends well has the
table of the undamaged one. Where this does not hold the command that repeats the case is printed.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from hostile_files import DESIGN
from typer.testing import CliRunner

import desim
from desim.campaign.running import driver, probes
from desim.campaign.running.work import RunTask, work
from desim.cli import app
from desim.results.row import Row

SCENARIO = """\
name: small
environment: {terrain: {size: [12 m, 12 m], drawing: {cell: 4 m, lines: [
  "+--+--+--+", "|     |  |", "+  +  +  +", "|  |     |",
  "+  +--+  +", "|        |", "+--+--+--+"]}}}
fleet: {size: 2, start: {from: [-4 m, 4 m], step: [2 m, 0 m]}}
robot: {laser: {beams: 20}}
network: {media: {lan: {model: switch, rate: 10 Mb/s, rules: [{rule: loss, probability: 1 %}]}}}
stop: {elapsed: 50 ms}
"""
MINE = "mine, whatever desim does"
LONGEST_S = 120
_MOST_RUNS = 16  # of a mutated design that is carried out


class Template(NamedTuple):
    """The undamaged original: a folder with a scenario, a design, a run and a campaign; ``table``
    is that of the campaign."""

    folder: Path
    resolved: str
    table: bytes


class Here:
    """Runs tasks in this process, in place of a ``Crew``; ends a campaign that is too long."""

    has_idle_worker, is_busy = True, False

    def __init__(self, *_: Any) -> None:
        self._tasks: list[RunTask] = []
        self._begun = 0

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def begin(self, task: RunTask) -> None:
        self._begun += 1
        if self._begun > _MOST_RUNS:
            raise KeyboardInterrupt
        self._tasks.append(task)
        self.has_idle_worker, self.is_busy = False, True

    def finished(self) -> list[tuple[RunTask, Row]]:
        task = self._tasks.pop()
        self.has_idle_worker, self.is_busy = True, False
        return [(task, work(task))]


class Wrong(Exception):
    """A fault of desim."""


def play(kinds: list[str], numbers: range, seed: int = 1) -> int:
    """Play these cases, and print those that fail; returns their number."""
    wrong, before = 0, os.getcwd()
    with tempfile.TemporaryDirectory() as name, _patched():
        template = _template(Path(name) / "template")
        for number in numbers:
            kind = KINDS[kinds[number % len(kinds)]]
            place = Path(name) / "case"
            shutil.copytree(template.folder, place, symlinks=True)
            outside = _outside(Path(name) / "outside")
            os.chdir(place)
            case = Case(template, place, random.Random(f"{seed} {number}"))
            try:
                kind(case)
                _require(_seen(outside.folder) == outside.seen, "something outside was changed")
                _require(case.mine <= _texts(place), "a file that is not desim's is lost")
            except Wrong as error:
                wrong += 1
                print(f"damaged --seed {seed} --first {number} --count 1 --only {kind.__name__}: "
                      f"{error}\n" + "\n".join(f"    {line}" for line in case.log), flush=True)
            finally:
                os.chdir(before)
                for folder in (place, outside.folder):
                    shutil.rmtree(folder)
    return wrong


class Case:
    """One case: ``folder`` is a copy of the template's, and the current one; ``log`` has what was
    done, ``mine`` the texts of foreign files."""

    def __init__(self, template: Template, folder: Path, stream: random.Random) -> None:
        self.template, self.folder, self.stream = template, folder, stream
        self.log: list[str] = []
        self.mine: set[str] = set()

    def run_command(self, *words: str) -> int:
        """Run a command. Raises ``Wrong`` if it ends as no command may."""
        self.log.append(f"desim {' '.join(words)}")
        with _limited():
            result = CliRunner().invoke(app, [*words])
        self.log.append(f"{result.exit_code}: {result.output.strip()[:2000]}")
        _require(result.exception is None or isinstance(result.exception, SystemExit),
                 f"raised {result.exception!r}")
        _require("Traceback" not in result.output and "desim failed" not in result.output,
                 "a traceback")
        _require(result.exit_code in (0, 1, 2) or
                 result.exit_code == 130 and words[0] == "sweep", "another exit code")
        _require(result.exit_code != 2 or bool(result.output.strip()), "no word of what is wrong")
        return result.exit_code

    def put(self, path: Path) -> None:
        """Write a foreign file."""
        if path.parent.is_dir() and not path.parent.is_symlink() and not os.path.lexists(path):
            text = f"{MINE} {self.stream.random()}"
            path.write_text(text)
            self.mine.add(text)
            self.log.append(f"put {path.relative_to(self.folder)}")


Kind = Callable[[Case], None]


def scenario(case: Case) -> None:
    """Change a text or a value in a scenario."""
    text = case.stream.choice([SCENARIO, case.template.resolved])
    (case.folder / "s.yaml").write_bytes(mutated(text, case))
    case.run_command("run", "s.yaml", "--quiet", "--out", "out", *(
        ["--until", "20 ms"] if case.stream.random() < 0.7 else []))


def design(case: Case) -> None:
    """Change a text or a value in a design."""
    (case.folder / "d.yaml").write_bytes(mutated(DESIGN, case))
    (case.folder / "x1").write_text(MINE)
    if case.run_command("sweep", "d.yaml", "--dry-run", "--out", "out") == 0:
        case.run_command("sweep", "d.yaml", "--quiet", "--out", "out")
        case.run_command("sweep", "d.yaml", "--quiet", "--out", "out")


def run_folder(case: Case) -> None:
    """Damage a finished run's folder, read it, and make it again."""
    run = next((case.folder / "results" / "small").iterdir())
    for _ in range(case.stream.choice([1, 1, 2, 3])):
        harm(case, run.parent, run)
    sound = sorted((case.folder / "campaign" / "runs" / "small").iterdir())[0]
    command = case.stream.choice([("trace", str(run), "--message", "1"), ("figure", str(run)),
                                ("diff", str(run), str(sound)), ("diff", str(run), str(run)),
                                ("graph", str(run)), ("diff", str(sound), str(run))])
    case.run_command(*command)
    if case.run_command("run", "small.yaml", "--set", "trace.keep=all", "--quiet") == 0:
        _require(bool(desim.Run(run).metrics), "the run is not whole")


def campaign_folder(case: Case) -> None:
    """Damage a finished campaign's folder, and let the campaign go on."""
    out = case.folder / "campaign"
    runs = {path: (path / "manifest.json").stat().st_mtime_ns
            for path in (out / "runs" / "small").iterdir()}
    for _ in range(case.stream.choice([1, 1, 2, 3])):
        touched = harm(case, out, case.stream.choice(sorted(runs)))
        runs = {path: time_ns for path, time_ns in runs.items()
                if touched != path and touched not in path.parents and path not in touched.parents}
    if case.stream.random() < 0.2:
        case.run_command("report", str(out), "--quiet")
    case.run_command("sweep", "design.yaml", "--dry-run", "--out", str(out))
    code = case.run_command("sweep", "design.yaml", "--quiet", "--out", str(out))
    for path, time_ns in runs.items():
        _require((path / "manifest.json").is_file(), f"{path.name} is lost")
        _require((path / "manifest.json").stat().st_mtime_ns == time_ns,
                 f"{path.name}, which was whole, was made again")
    if code == 0:
        _require((out / "runs.parquet").read_bytes() == case.template.table, "another table")


KINDS: dict[str, Kind] = {kind.__name__: kind for kind in (
    scenario, design, run_folder, campaign_folder)}

VALUES = [None, True, 0, -1, 3, 1.5, 10**30, float("nan"), "", "x1", "5 m", "10 Mb/s",
          "1e400 s", "-1 s", "a\0b", "\x1b[31m", "[/x]", "$x", "../../outside", "/dev/zero",
          "module:thing", "sys:exit",
          "os:getpid", "é", "x" * 5000, [], {}, [[]], {"a": 1}, [None], {"": {}}, "small.yaml",
          [1] * 50, "no", "null", "*", "0x10", "2026-01-01", "true: false", "\ud800"]
TEXTS = ["\0", "\t", "\ufeff", "&a [*a]", "*b", "!!python/object:os.system x", "<<: {}", "---\n",
         "%YAML 1.1\n", "[" * 2000, "{a: " * 300, "? ", "|\n", "'", '"', "\x80", "\x1b", ": ", "- ",
         "&a", "\r", "\u2028"]


def mutated(text: str, case: Case) -> bytes:
    """Change ``text`` as text, as bytes, or by its values."""
    stream = case.stream
    for _ in range(stream.choice([1, 1, 1, 2, 4])):
        how = stream.randrange(5)
        if how < 3:
            try:
                data = yaml.safe_load(text)
                text = yaml.safe_dump(_changed(data, case), sort_keys=False)
                continue
            except (yaml.YAMLError, UnicodeError, TypeError, ValueError, RecursionError):
                how = 3
        lines = text.splitlines(keepends=True) or [""]
        at = stream.randrange(len(lines))
        if how == 3:
            lines[at:at + 1] = stream.choice([[], [lines[at]] * 2, [lines[at][::-1]],
                                            [" " + lines[at]], [stream.choice(lines)]])
            text = "".join(lines)
        else:
            at = stream.randrange(len(text) + 1)
            text = text[:at] + stream.choice(TEXTS) + text[at + stream.choice([0, 0, 1, 30]):]
    raw = text.encode(errors="surrogatepass")
    if stream.random() < 0.05:
        at = stream.randrange(len(raw) + 1)
        raw = raw[:at] + bytes([stream.randrange(256)]) + raw[at + 1:]
    case.log.append(f"{raw[:1500]!r}")
    return raw


def _changed(data: Any, case: Case) -> Any:
    """The data with another value, key or item somewhere."""
    stream = case.stream
    if isinstance(data, dict) and data and stream.random() < 0.85:
        key = stream.choice(list(data))
        return {**data, key: _changed(data[key], case)}
    if isinstance(data, list) and data and stream.random() < 0.85:
        at = stream.randrange(len(data))
        return [*data[:at], _changed(data[at], case), *data[at + 1:]]
    if isinstance(data, dict) and stream.random() < 0.5:
        return {**data, str(stream.choice(VALUES))[:40]: stream.choice(VALUES)}
    return stream.choice(VALUES)


FOREIGN = ["mine.txt", "figure.png", ".DS_Store", "map/mine.txt", "summary.json.bak",
           "notes.partial", ".index.jsonl.new", "extra.parquet"]


def harm(case: Case, top: Path, run: Path) -> Path:
    """Something below ``top`` is damaged; ``run`` is one of its runs, which it often is. What was
    touched."""
    stream = case.stream
    if stream.random() < 0.3:
        path = stream.choice([top, run, run.parent, run.parent.parent]) / stream.choice(FOREIGN)
        case.put(path)
        return case.folder / "nothing that was whole"
    if stream.random() < 0.15:
        return _beside(case, run)
    places = [path for path in sorted(top.rglob("*")) if ".lock" not in path.name or
              stream.random() < 0.3]
    inside = [path for path in places if run in path.parents] or [run]
    path = stream.choice(inside if stream.random() < 0.6 else places or [run])
    how = stream.choice(HARMS)
    if path.is_dir() and not path.is_symlink():
        if any(run in (path, *path.parents) for run in [run]) or stream.random() < 0.3:
            how = stream.choice([_gone, _a_file, _a_link, _a_pipe])
        else:
            return case.folder / "nothing that was whole"
    if case.mine & _texts(path):
        return case.folder / "nothing that was whole"
    case.log.append(f"{how.__name__} {path.relative_to(case.folder)}")
    if os.path.lexists(path):
        how(case, path)
    return path


def _beside(case: Case, run: Path) -> Path:
    """Put something where desim itself will want to write."""
    place = run.with_name(run.name + case.stream.choice([".partial", ".old"]))
    if not os.path.lexists(place):
        how = case.stream.choice(["folder", "link", "file", "pipe"])
        case.log.append(f"{how} {place.relative_to(case.folder)}")
        if how == "folder":
            place.mkdir()
            case.put(place / "mine.txt")
            (place / "samples.parquet").write_text("half")
        elif how == "link":
            place.symlink_to(case.stream.choice(["../../../../outside", "/nowhere"]))
        elif how == "file":
            case.put(place)
        else:
            os.mkfifo(place)
    return run  # which cannot be made again now, or is


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


def _gone(case: Case, path: Path) -> None:
    _remove(path)


def _emptied(case: Case, path: Path) -> None:
    _replaced(path, b"")


def _cut(case: Case, path: Path) -> None:
    raw = path.read_bytes() if path.is_file() else b""
    _replaced(path, raw[:case.stream.randrange(len(raw) + 1)])


def _turned(case: Case, path: Path) -> None:
    raw = bytearray(path.read_bytes() if path.is_file() else b"x") or bytearray(b"x")
    raw[case.stream.randrange(len(raw))] ^= 1 << case.stream.randrange(8)
    _replaced(path, bytes(raw))


def _garbage(case: Case, path: Path) -> None:
    _replaced(path, case.stream.randbytes(case.stream.randrange(2000)))


def _json(case: Case, path: Path) -> None:
    """JSON of another shape, or with another value."""
    try:
        lines = path.read_text().split("\n") if path.suffix == ".jsonl" else [path.read_text()]
        at = case.stream.randrange(len(lines))
        lines[at] = json.dumps(_changed(json.loads(lines[at]), case))
        _replaced(path, "\n".join(lines).encode())
    except (OSError, ValueError):
        _replaced(path, case.stream.choice([b"[]", b"{}", b"null", b"[" * 100_000, b'{"a": NaN}']))


def _a_file(case: Case, path: Path) -> None:
    _remove(path)
    case.put(path)


def _a_folder(case: Case, path: Path) -> None:
    _remove(path)
    path.mkdir()
    case.put(path / "mine.txt")


def _a_pipe(case: Case, path: Path) -> None:
    _remove(path)
    os.mkfifo(path)


def _a_link(case: Case, path: Path) -> None:
    _remove(path)
    outside = case.folder.parent / "outside"
    path.symlink_to(case.stream.choice([outside, outside / "file.txt", "/dev/zero", "/nowhere",
                                      path.parent, path.name]))


def _another(case: Case, path: Path) -> None:
    """Replace it by another file of the campaign."""
    others = [other for other in sorted(case.folder.rglob("*")) if other.is_file()]
    _replaced(path, case.stream.choice(others).read_bytes())


def _replaced(path: Path, raw: bytes) -> None:
    _remove(path)
    path.write_bytes(raw)


HARMS = [_gone, _emptied, _cut, _turned, _garbage, _json, _json, _a_folder, _a_pipe, _a_link,
         _another]


class _Outside(NamedTuple):
    folder: Path
    seen: dict[str, Any]


def _outside(folder: Path) -> _Outside:
    """A folder in which desim must not write."""
    folder.mkdir()
    (folder / "file.txt").write_text("not yours")
    (folder / "deep").mkdir()
    (folder / "deep" / "summary.json").write_text("{}")
    return _Outside(folder, _seen(folder))


def _seen(folder: Path) -> dict[str, Any]:
    return {str(path): (path.lstat().st_mtime_ns, path.read_bytes() if path.is_file() else None)
            for path in (folder, *sorted(folder.rglob("*")))}


def _texts(place: Path) -> set[str]:
    """Contents of all foreign files below ``place``."""
    found = set()
    for path in (place, *place.rglob("*")) if place.is_dir() else [place]:
        if path.is_file() and not path.is_symlink() and path.stat().st_size < 100:
            found.add(path.read_bytes().decode(errors="replace"))
    return {text for text in found if text.startswith(MINE)}


def _template(folder: Path) -> Template:
    folder.mkdir()
    (folder / "small.yaml").write_text(SCENARIO)
    (folder / "design.yaml").write_text(DESIGN)
    run = desim.run(folder / "small.yaml", overrides=["trace.keep=all"], out=folder / "results")
    done = CliRunner().invoke(app, ["sweep", str(folder / "design.yaml"), "--quiet", "--out",
                                    str(folder / "campaign")])
    _require(done.exit_code == 0, f"the undamaged campaign fails: {done.output}")
    return Template(folder, (run.path / "scenario.resolved.yaml").read_text(),
                    (folder / "campaign" / "runs.parquet").read_bytes())


@contextmanager
def _patched() -> Iterator[None]:
    """Runs are made in this process, and predictions cost little."""
    before = driver.Crew, probes.BUDGET_S
    driver.Crew, probes.BUDGET_S = Here, 0.1
    try:
        yield
    finally:
        driver.Crew, probes.BUDGET_S = before


@contextmanager
def _limited() -> Iterator[None]:
    def hangs(*_: Any) -> None:
        raise Wrong(f"no end after {LONGEST_S} s")

    before = signal.signal(signal.SIGALRM, hangs)
    signal.alarm(LONGEST_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _require(holds: bool, text: str) -> None:
    if not holds:
        raise Wrong(text)
