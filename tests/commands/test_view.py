"""``desim view`` writes a page, says where, and opens it only where there is a screen."""

import shutil
import sys
import webbrowser

import pytest
from typer.testing import CliRunner

import desim
from desim.cli import app


def view(*words, code=0):
    done = CliRunner().invoke(app, ["view", *map(str, words)], catch_exceptions=False)
    assert done.exit_code == code, done.output
    return done.output.strip()


@pytest.fixture(scope="module")
def run(tmp_path_factory, repository):
    scenario = desim.load(repository / "scenarios" / "hello.yaml", ["stop.elapsed=2 s"])
    return desim.run(scenario, out=tmp_path_factory.mktemp("runs"))


@pytest.fixture
def opened(monkeypatch):
    """The addresses that a browser was asked to open."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", addresses.append)
    return addresses


def test_the_page_is_in_the_runs_folder(run, opened):
    page = run.path / "replay.html"
    assert view(run.path) == str(page)
    assert page.read_text().startswith("<!doctype html>")
    assert opened == []  # the output of a test is no terminal


def test_two_runs_in_a_file_of_ones_own(run, tmp_path):
    page = tmp_path / "both.html"
    assert view(run.path, run.path, "--to", page) == str(page)
    assert page.read_text().count('class="run-about"') == 2


@pytest.mark.parametrize(("display", "terminal", "options", "opens"), [
    (":0", True, (), True), ("", True, (), False), (":0", False, (), False),
    (":0", True, ("--no-open",), False)])
def test_it_is_opened_where_there_are_a_terminal_and_a_screen(
        run, opened, monkeypatch, display, terminal, options, opens):
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("desim.commands.browser.is_terminal", lambda: terminal)
    monkeypatch.setattr(sys, "platform", "linux")
    page = view(run.path, *options)
    assert opened == ([f"file://{page}"] if opens else [])


def test_no_run(tmp_path):
    assert view(tmp_path, code=2) == (
        f"{tmp_path}: not the folder of a run; a run's folder has a manifest.json, e.g. "
        "results/hello/1a2b3c4d5e6f")


def test_a_folder_that_is_not_there(run, tmp_path):
    page = tmp_path / "no" / "page.html"
    assert view(run.path, "--to", page, code=2) == (
        f"--to: {page} cannot be written: No such file or directory")


def test_a_runs_folder_that_cannot_be_written_names_the_option(run, tmp_path):
    """The file that desim chose itself is a folder here; on a read-only disk it is the same."""
    copy = tmp_path / "run"
    shutil.copytree(run.path, copy)
    for command, name in (("view", "replay.html"), ("figure", "figure.png")):
        (copy / name).unlink(missing_ok=True)
        (copy / name).mkdir()
        done = CliRunner().invoke(app, [command, str(copy)])
        assert (done.exit_code, done.output) == (
            2, f"{copy / name} cannot be written: Is a directory; another place: --to FILE\n")
