"""Files in a run's folder: damage is always noticed, and files that are not desim's stay."""

from __future__ import annotations

import json
import os
import shutil

import pytest
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.errors import InputError
from desim.results.seal import damage, manifest_of

# Files that desim writes where hosts run real programs, and nowhere else.
OF_REAL_PROGRAMS = "base.0.log", "robot_0.ros1_bridge.log", "lan.pcap"
SHORT = ("stop.elapsed=1 s", "trace.keep=all")


@pytest.fixture(scope="module")
def hello(repository):
    return repository / "scenarios" / "hello.yaml"


@pytest.fixture(scope="module")
def finished(hello, tmp_path_factory):
    return desim.run(hello, overrides=SHORT, out=tmp_path_factory.mktemp("results")).path


@pytest.fixture
def path(finished, tmp_path):
    """A copy of the run's folder; beside it is a file that nobody may touch."""
    folder = tmp_path / "hello" / finished.name
    shutil.copytree(finished, folder)
    return folder


def again(hello, path):
    return desim.run(hello, overrides=SHORT, out=path.parent.parent)


def test_what_desim_has_not_written_stays(hello, path):
    """In the order of the README: run, figure, run."""
    assert CliRunner().invoke(app, ["figure", str(path)]).exit_code == 0
    (path / "notes").mkdir()
    (path / "notes" / "mine.txt").write_text("dear diary")
    (path / "map" / "mine.txt").write_text("my map")
    for name in OF_REAL_PROGRAMS:
        (path / name).write_text("of no program of this run")
    figure = (path / "figure.png").read_bytes()
    run = again(hello, path)
    assert (path / "figure.png").read_bytes() == figure
    assert (path / "notes" / "mine.txt").read_text() == "dear diary"
    assert (path / "map" / "mine.txt").read_text() == "my map"
    assert all((path / name).is_file() for name in OF_REAL_PROGRAMS)
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]
    assert damage(path, run.manifest) is None
    assert not {"figure.png", "notes", "map/mine.txt", *OF_REAL_PROGRAMS} & {*run.manifest["files"]}


def test_so_it_does_whatever_stops_desim_between_two_renames(hello, path):
    """The old folder is aside, the new one not there yet; then a run is killed while it works."""
    (path / "mine.txt").write_text("1")
    path.rename(path.with_name(f"{path.name}.old"))
    partial = path.with_name(f"{path.name}.partial")
    partial.mkdir()
    (partial / "samples.parquet").write_text("half")
    (partial / "also_mine.txt").write_text("2")
    again(hello, path)
    assert (path / "mine.txt").read_text() == "1" and (path / "also_mine.txt").read_text() == "2"
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]


def test_what_stands_in_a_runs_place_is_set_aside(hello, path):
    shutil.rmtree(path)
    path.write_text("mine")
    again(hello, path)
    path.with_name("kept").mkdir()
    shutil.rmtree(path)
    path.symlink_to(path.with_name("kept"))
    run = again(hello, path)
    assert path.with_name(f"{path.name}.old").read_text() == "mine"
    assert path.with_name(f"{path.name}.old2").is_symlink()
    assert not list(path.with_name("kept").iterdir()) and run.metrics


def test_nothing_is_written_through_a_link(hello, path):
    mine = path.parent / "mine"
    shutil.copytree(path, mine)
    before = sorted(os.listdir(mine))
    path.with_name(f"{path.name}.partial").symlink_to(mine)
    with pytest.raises(InputError, match=f"{path.name}.partial: is a symbolic link, which desim"):
        again(hello, path)
    assert sorted(os.listdir(mine)) == before


def test_what_a_link_in_the_folder_leads_to_stays(hello, path):
    mine = path.parent / "mine"
    (path / "map").rename(mine)
    (mine / "mine.txt").write_text("mine")
    (path / "map").symlink_to(mine)
    before = {file.name: file.read_bytes() for file in mine.iterdir()}
    run = again(hello, path)
    assert {file.name: file.read_bytes() for file in mine.iterdir()} == before
    assert run.map is not None and not (path / "map").is_symlink()


@pytest.mark.parametrize("name", [".lock", "map"])
def test_nor_through_one_in_a_folder_that_was_cut_off(hello, path, name):
    mine = path.parent / "mine"
    mine.mkdir()
    partial = path.with_name(f"{path.name}.partial")
    partial.mkdir()
    (partial / name).symlink_to(mine)
    with pytest.raises(InputError, match="cannot write results"):
        again(hello, path)
    assert not list(mine.iterdir())


def test_everything_is_on_the_disk_before_it_has_its_name(hello, tmp_path, monkeypatch):
    events = []
    fsync, replace = os.fsync, os.replace

    def synced(descriptor):
        events.append(os.path.basename(os.readlink(f"/proc/self/fd/{descriptor}")))
        fsync(descriptor)

    def renamed(old, new):
        events.append("renamed")
        replace(old, new)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", renamed)
    run = desim.run(hello, overrides=("stop.elapsed=100 ms",), out=tmp_path)
    before = events[:events.index("renamed")]
    assert {*before} == {os.path.basename(name) for name in run.manifest["files"]} | {
        "manifest.json", f"{run.path.name}.partial"}
    assert events[-1] == "hello"


def emptied(file):
    file.write_bytes(b"")


def cut(file):
    file.write_bytes(file.read_bytes()[:-3])


def turned(file):
    """As large as before."""
    text = bytearray(file.read_bytes())
    text[len(text) // 2] ^= 1
    file.write_bytes(text)


def garbage(file):
    file.write_bytes(b"\x00\xff[]{}" * 40)


def a_list(file):
    file.write_text("[]")


def nested(file):
    file.write_text("[" * 100_000)


def a_folder(file):
    file.unlink()
    file.mkdir()


def a_pipe(file):
    file.unlink()
    os.mkfifo(file)


def without_end(file):
    file.unlink()
    file.symlink_to("/dev/zero")


def gone(file):
    file.unlink()


KINDS = (emptied, cut, turned, garbage, a_list, nested, a_folder, a_pipe, without_end, gone)
READ = {"manifest.json": ("figure", "trace", "diff", "graph"),
        "summary.json": ("figure",), "samples.parquet": ("figure",), "robots.parquet": ("figure",),
        "map/merged.pgm": ("figure",), "map/truth.yaml": ("figure",),
        "scenario.resolved.yaml": ("figure", "graph"), "names.json": ("trace",),
        "trace.parquet": ("trace", "diff"), "messages.parquet": ("trace",)}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("name", READ)
def test_a_damaged_file_is_named(path, finished, kind, name):
    kind(path / name)
    more = {"trace": ["--message", "1"], "diff": [str(finished)]}
    for command in READ[name]:
        if kind is gone and (name, command) in RUN_AGAIN:
            continue
        result = CliRunner().invoke(app, [command, str(path), *more.get(command, [])])
        text = (result.exit_code, result.output)
        assert isinstance(result.exception, SystemExit), text
        assert result.exit_code == 2 and len(result.output.splitlines()) == 1, text
        assert result.output.startswith(f"{path}: ") and name in result.output, text
    assert desim.Run(finished).metrics


# Rows that are not there any more are made by running the scenario again.
RUN_AGAIN = {("trace.parquet", "trace"), ("trace.parquet", "diff"), ("messages.parquet", "trace")}


def test_a_trace_of_garbage_is_not_equal(path, finished):
    garbage(path / "trace.parquet")
    for pair in ((path, finished), (finished, path), (path, path)):
        result = CliRunner().invoke(app, ["diff", *map(str, pair)])
        assert (result.exit_code, result.output) == (2, (
            f"{path}: damaged: trace.parquet is not what desim wrote; running its scenario again "
            "mends it\n"))


def test_the_seal_covers_the_manifest(path):
    manifest = manifest_of(path)
    assert damage(path, manifest) is None and "summary.json" in manifest["files"]
    text = json.loads((path / "manifest.json").read_text())
    (path / "manifest.json").write_text(json.dumps({**text, "status": "failed"}))
    assert manifest_of(path) is None
