"""Commands that read folders which an attacker has made.

No code of theirs runs, and nothing outside is opened for writing, moved or removed: the
interpreter's own audit events are the judge.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.results.file_names import WRITTEN

SHORT = ("stop.elapsed=1 s", "trace.keep=all", "trace.ledger=true")
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_REMOVES = {"os.remove", "os.rmdir", "os.rename", "os.truncate", "os.link", "os.symlink",
            "os.chmod", "shutil.rmtree", "shutil.move"}
_STARTS = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.startfile"}


class Audit:
    """The reports of Python's audit hook while ``watching``: it can never be removed."""

    def __init__(self) -> None:
        self.watching: Path | None = None
        self.seen: list[str] = []
        sys.addaudithook(self._heard)

    def _heard(self, event: str, args: tuple[object, ...]) -> None:
        folder = self.watching
        if folder is None:
            return
        if event in _STARTS:
            self.seen.append(f"{event} {args[0]}")
        elif event == "open" and isinstance(args[0], str | bytes | os.PathLike):
            path = os.fsdecode(args[0])
            if args[2] & _WRITES and self._is_near(path) and not self._is_own(path):
                self.seen.append(f"writes {path}")
        elif event in _REMOVES:
            if not self._may_remove(os.fsdecode(args[0])):
                self.seen.append(f"{event} {args[0]}")
        elif event in ("exec", "import"):
            name = args[0] if event == "import" else getattr(args[0], "co_filename", "")
            if "evil" in str(name):
                self.seen.append(f"{event} {name}")

    def _is_near(self, path: str) -> bool:
        return os.path.realpath(path).startswith(str(self.watching.parent.parent))

    def _is_own(self, path: str) -> bool:
        """In the folder itself, or in one for what it is exported to."""
        real = os.path.realpath(path)
        return real.startswith((f"{self.watching}/", f"{self.watching.parent.parent}/target"))

    def _may_remove(self, path: str) -> bool:
        return not self._is_near(path) or self._is_own(path) or not os.path.isabs(path)


_AUDIT: list[Audit] = []


@pytest.fixture
def audit():
    if not _AUDIT:
        _AUDIT.append(Audit())
    _AUDIT[0].seen.clear()
    yield _AUDIT[0]
    _AUDIT[0].watching = None


@pytest.fixture(scope="module")
def good(repository, tmp_path_factory):
    out = tmp_path_factory.mktemp("good")
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=SHORT, out=out).path


@pytest.fixture
def run(good, tmp_path):
    """A copy of a good run's folder; two above it is a file that nobody may touch."""
    folder = tmp_path / "results" / "hello" / good.name
    shutil.copytree(good, folder)
    (tmp_path / "results" / "victim.txt").write_text("precious")
    return folder


@pytest.fixture
def hostile_folders(repository, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(repository / "tools"), *sys.path])
    import hostile_folders

    return hostile_folders


def commands(run, target):
    """All commands that read a run's folder."""
    return [("why", run), ("why", run, "--dropped", "--json"), ("trace", run),
            ("trace", run, "--message", "1"), ("graph", run), ("graph", run, "--json"),
            ("diff", run, run), ("compare", run, run), ("compare", run, run, "--json"),
            ("ls", run.parent.parent), ("ls", run.parent.parent, "--json"), ("check", run),
            ("figure", run), ("figure", run, "--to", f"{target}/figure.pdf"),
            ("view", run, "--no-open"), ("view", run, run, "--no-open", "--to", f"{target}/v.html"),
            ("export", run, "--csv", f"{target}/csv"),
            ("export", run, "--mcap", f"{target}/m.mcap"),
            ("export", run, "--bag", f"{target}/b.bag"),
            ("export", run, "--graphml", f"{target}/g.graphml"),
            ("export", run, "--pcap", f"{target}/p.pcap"),
            ("run", run / "manifest.json")]


def played(audit, run, tmp_path):
    """The outputs of all commands on the folder, which none may end in a traceback."""
    target = tmp_path / "target"
    target.mkdir(exist_ok=True)
    said = {}
    for words in commands(run, target):
        words = tuple(map(str, words))
        audit.watching = run
        result = CliRunner().invoke(app, words)
        audit.watching = None
        what = f"{words}: {result.output}"
        assert result.exception is None or isinstance(result.exception, SystemExit), what
        assert "Traceback" not in result.output and "desim failed" not in result.output, what
        assert result.exit_code in (0, 1, 2), what
        assert "\x1b[31m" not in result.output, what
        assert audit.seen == [], what
        said[words] = result.output
    assert (tmp_path / "results" / "victim.txt").read_text() == "precious"
    return said


def test_the_audit_sees_what_it_is_there_to_see(audit, run, tmp_path, monkeypatch):
    (run / "evil_twin.py").write_text("x = 1")
    monkeypatch.syspath_prepend(str(run))
    audit.watching = run
    import evil_twin  # noqa: F401

    outside = run.parent.parent / "outside"
    outside.write_text("")
    outside.unlink()
    audit.watching = None
    assert {word.split()[0] for word in audit.seen} >= {"import", "exec", "writes", "os.remove"}


@pytest.mark.parametrize("place", range(10))
def test_a_module_in_the_folder_never_runs(audit, run, tmp_path, hostile_folders, place):
    keys = hostile_folders.CODE[place]
    hostile_folders.set_code(run, keys)
    said = played(audit, run, tmp_path)
    assert not (run / hostile_folders.MARK).exists()
    why = said["why", str(run)].strip()
    assert "--trust" in why and len(why.splitlines()) == 1, why


def test_with_trust_it_runs(run, hostile_folders):
    """The twin: without the refusal the attack works."""
    hostile_folders.set_code(run, ("coordination", "strategy"))
    CliRunner().invoke(app, ["why", str(run), "--trust"])
    assert (run / hostile_folders.MARK).exists()


@pytest.mark.parametrize("name", ["../../victim.txt", "map/../../../victim.txt", "/etc/hostname"])
def test_running_again_removes_nothing_outside(repository, run, tmp_path, hostile_folders, name):
    hostile_folders.resealed(run, lambda manifest: manifest.update(
        files={name: {"bytes": 1, "sha256": "x"}}))
    desim.run(repository / "scenarios" / "hello.yaml", overrides=SHORT, out=tmp_path / "results")
    assert (tmp_path / "results" / "victim.txt").read_text() == "precious"


def test_running_again_keeps_a_file_that_desim_has_not_written(repository, run, tmp_path,
                                                              hostile_folders):
    """Whatever the manifest says of it."""
    (run / "thesis.tex").write_text("ten years")
    hostile_folders.resealed(run, lambda manifest: manifest.update(
        files={"thesis.tex": {"bytes": 9, "sha256": "x"}}))
    desim.run(repository / "scenarios" / "hello.yaml", overrides=SHORT, out=tmp_path / "results")
    assert (run / "thesis.tex").read_text() == "ten years"


@pytest.mark.parametrize(("command", "file"), [("view", "replay.html"), ("figure", "figure.png")])
def test_nothing_is_written_through_a_link(run, tmp_path, command, file):
    (run / file).symlink_to("../../victim.txt")
    result = CliRunner().invoke(app, [command, str(run), *["--no-open"] * (command == "view")])
    assert (result.exit_code, result.output) == (
        2, f"{run / file} cannot be written: is a symbolic link, which desim does not write "
           "through; another place: --to FILE\n")
    assert (tmp_path / "results" / "victim.txt").read_text() == "precious"


def test_a_full_disk_leaves_no_cut_page(run, tmp_path, monkeypatch):
    page = tmp_path / "page.html"
    page.write_text("the page of before")

    def full(path, text, **_):
        Path.write_bytes(path, text.encode()[:100])
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_text", full)
    result = CliRunner().invoke(app, ["view", str(run), "--no-open", "--to", str(page)])
    assert (result.exit_code, result.output) == (
        2, f"--to: {page} cannot be written: No space left on device\n")
    assert page.read_bytes() == b"the page of before"
    assert [path.name for path in tmp_path.iterdir() if "page" in path.name] == ["page.html"]


@pytest.mark.parametrize("number", range(int(os.environ.get("HOSTILE_FOLDERS", "4"))))
def test_hostile_folders(audit, run, tmp_path, hostile_folders, number):
    hostile_folders.hostile(run, number)
    played(audit, run, tmp_path)
    assert not (run / hostile_folders.MARK).exists()


def test_the_list_of_files_is_complete(good):
    """A file that desim writes and the list has not would never be removed."""
    import json

    assert {*json.loads((good / "manifest.json").read_text())["files"]} <= {*WRITTEN}
