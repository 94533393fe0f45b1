"""The commits that have a source, of a repository in which it changed and came back."""

import subprocess

import commits_of
import pytest

IDENTITY = """\
from pathlib import Path


def source(modules):
    return Path("desim/code").read_text()
"""


@pytest.fixture
def repository_with(tmp_path, monkeypatch):
    """A function that commits ``code`` of a desim whose source is its text."""
    def git(*arguments):
        subprocess.run(["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b",
                        *arguments], check=True, capture_output=True)

    git("init")
    for file in ("desim/__init__.py", "desim/results/__init__.py", "netmodels/__init__.py"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).touch()
    (tmp_path / "desim" / "results" / "identity.py").write_text(IDENTITY)
    monkeypatch.setattr(commits_of, "ROOT", tmp_path)

    def commit(code, message):
        (tmp_path / "desim" / "code").write_text(code)
        (tmp_path / "desim" / "page").write_text(message)
        git("add", "-A")
        git("commit", "-m", message)
    return commit


def found(monkeypatch, capsys, *arguments):
    monkeypatch.setattr("sys.argv", ["commits_of.py", *arguments])
    code = commits_of.main()
    return [line.split(" ", 2)[2] for line in capsys.readouterr().out.splitlines()], code


def test_the_latest_row_of_commits(repository_with, monkeypatch, capsys):
    for code, message in (("a", "long ago"), ("b", "other"), ("a", "back"), ("a", "a page"),
                          ("c", "last")):
        repository_with(code, message)
    assert found(monkeypatch, capsys, "a") == (["a page", "back"], 0)
    assert found(monkeypatch, capsys, "c") == (["last"], 0)
    assert found(monkeypatch, capsys, "d") == ([], 1)
    assert found(monkeypatch, capsys, "b", "--among", "3") == ([], 1)
