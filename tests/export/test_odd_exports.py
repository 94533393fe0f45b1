"""Runs that are not as most are: each exporter gives a whole file or one clear error."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import pytest
from captures import records
from PIL import Image
from recorded import made, quiet
from typer.testing import CliRunner

import desim
from desim.api import recording_of
from desim.cli import app
from desim.engine.kernel import Phase
from desim.errors import InputError, ModelError
from desim.export.animation.animation_file import write_animation
from desim.export.csv_tables import write_csv
from desim.export.graphml import write_graphml
from desim.export.pcap.capture import write_pcap
from desim.results.run import Run
from desim.results.status import RunStatus
from desim.units import NS_PER_S


def mcap(run: Run, folder: Path) -> int:
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from desim.export.ros.recording_files import write_mcap

    write_mcap(recording_of(run), folder / "run.mcap", quiet)
    with (folder / "run.mcap").open("rb") as file:
        return reader.make_reader(file, validate_crcs=True).get_summary().statistics.message_count


def bag(run: Run, folder: Path) -> int:
    highlevel = pytest.importorskip("rosbags.highlevel", reason="rosbags is not installed")
    pytest.importorskip("mcap", reason="mcap is not installed")
    from desim.export.ros.recording_files import write_bag

    write_bag(recording_of(run), folder / "run.bag", quiet)
    with highlevel.AnyReader([folder / "run.bag"]) as reader:
        return sum(1 for _ in reader.messages())


def graphml(run: Run, folder: Path) -> int:
    write_graphml(recording_of(run), folder / "net.graphml")
    return len(ElementTree.parse(folder / "net.graphml").getroot())


def animation(kind: str) -> Callable[[Run, Path], int]:
    def write(run: Run, folder: Path) -> int:
        write_animation(recording_of(run), folder / f"run.{kind}", quiet)
        with Image.open(folder / f"run.{kind}") as image:
            image.seek(image.n_frames - 1)
            image.load()
            return image.n_frames

    write.__name__ = kind
    return write


def csv(run: Run, folder: Path) -> int:
    return len(write_csv(run, folder / "csv", quiet))


def pcap(run: Run, folder: Path) -> int:
    count = write_pcap(run, next(iter(run.scenario.network.media)), folder / "run.pcap", quiet)
    assert count == len(records(folder / "run.pcap")[1])
    return count + 1  # an empty capture is one, too


EXPORTERS = (mcap, bag, csv, graphml, animation("gif"), animation("apng"), pcap)
every = pytest.mark.parametrize("export", EXPORTERS, ids=lambda export: export.__name__)
of_a_recording = pytest.mark.parametrize(
    "export", [one for one in EXPORTERS if one not in (csv, pcap)], ids=lambda one: one.__name__)


def refused(export: Callable[[Run, Path], int], run: Run, folder: Path) -> str:
    """The one line with which a run is refused. Nothing is left behind."""
    before = sorted(folder.rglob("*"))
    with pytest.raises(InputError) as error:
        export(run, folder)
    assert "\n" not in str(error.value)
    assert sorted(path for path in folder.rglob("*") if path.name != "csv") == before
    return str(error.value)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def instant(repository, home):
    """A run that ends when it has begun."""
    return made(repository, home, "stop.elapsed=1 ms")


@pytest.fixture(scope="module")
def alone(repository, home):
    """One robot, which talks to nobody."""
    return made(repository, home, "fleet.size=1", "stop.elapsed=1 s", "deployment=field")


@pytest.fixture(scope="module")
def stopped(repository, home):
    """A run that was interrupted, and a host that stopped before."""
    @contextmanager
    def watch(simulation, folder):
        simulation.kernel.at(NS_PER_S + 7, Phase.WORLD, 0,
                             lambda _: signal.raise_signal(signal.SIGINT))
        yield

    with pytest.raises(KeyboardInterrupt) as interrupted:
        desim.run(repository / "scenarios" / "hello.yaml", out=home, watch=watch, overrides=(
            "faults=[{at: 400 ms, host: robot_1, down_for: 300 ms}]", "robot.passive=[robot_2]"))
    run = Run(interrupted.value.args[0])
    assert run.manifest["status"] == RunStatus.INTERRUPTED
    return run


@pytest.fixture(scope="module")
def unkept(repository, home):
    """A run of which nothing was kept."""
    return made(repository, home, "trace.keep=none", "stop.elapsed=1 s")


def broken(frame, receivers):
    """A rule that fails at the hundredth frame."""
    broken.asked = getattr(broken, "asked", 0) + 1
    if broken.asked == 100:
        raise RuntimeError("enough")
    return desim.ports.Pass()


@pytest.fixture(scope="module")
def failed(repository, tmp_path_factory):
    out = tmp_path_factory.mktemp("failed")
    with pytest.raises((RuntimeError, ModelError)):
        made(repository, out, f"network.media.lan={{model: switch, rules: [{{rule: '{__name__}:"
                              "broken'}]}")
    (folder,) = (out / "hello").iterdir()
    return Run(folder)


@every
@pytest.mark.parametrize("name", ["instant", "alone", "stopped", "unkept"])
def test_odd_runs_give_a_whole_file(export, name, request, tmp_path):
    assert export(request.getfixturevalue(name), tmp_path) >= 1


@every
def test_a_failed_run_gives_what_it_has_or_one_line(export, failed, tmp_path):
    if export is pcap:
        assert refused(export, failed, tmp_path) == (
            f"{failed.path}: the run failed, it has no digest and no end to compare or repeat; its "
            "manifest.json has the error")
    else:
        assert export(failed, tmp_path) >= 1


def command(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """``desim`` in a process of its own, which has not loaded any plug-in yet."""
    return subprocess.run([sys.executable, "-m", "desim.cli", *words], cwd=folder, timeout=300,
                          capture_output=True, text=True)


def test_what_a_failed_run_has_kept_needs_no_plugin(repository, tmp_path):
    """The file of the rule that made it fail is gone."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    rule = tmp_path / "gone.py"
    rule.write_text("import desim\n\nfates = [desim.ports.Pass()] * 99\n\n\n"
                    "def broken(frame, receivers):\n    return fates.pop()\n")
    made = command(tmp_path, "run", str(repository / "scenarios" / "hello.yaml"), "--set",
                   "network.media.lan={model: switch, rules: [{rule: 'gone:broken'}]}")
    assert made.returncode == 1 and "IndexError: pop from empty list" in made.stderr
    rule.unlink()
    run, = (tmp_path / "results" / "hello").iterdir()
    again = command(tmp_path, "run", str(run / "scenario.resolved.yaml"))
    assert again.returncode == 2 and "gone" in again.stderr  # it cannot be loaded any more
    done = command(tmp_path, "export", str(run), "--mcap", "a.mcap", "--bag", "a.bag", "--csv",
                   "csv", "--graphml", "a.graphml", "--animation", "a.gif")
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} >= {
        "a.mcap", "a.bag", "csv", "a.graphml", "a.gif"}


@of_a_recording
def test_damage_is_named(export, repository, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    run = made(repository, tmp_path / "results", "stop.elapsed=1 s")
    read = ("poses", "messages") if export.__name__ in ("gif", "apng") else (
        "poses", "links", "messages")
    for name in read:
        whole = (run.path / f"{name}.parquet").read_bytes()
        (run.path / f"{name}.parquet").write_bytes(whole[:-9])
        assert refused(export, Run(run.path), out) == (
            f"{run.path}: damaged: {name}.parquet is not what desim wrote; running its scenario "
            "again mends it")
        (run.path / f"{name}.parquet").unlink()  # which is not the same as an empty table
        assert refused(export, Run(run.path), out) == (
            f"{run.path}: damaged: {name}.parquet is missing; running its scenario again mends it")
        (run.path / f"{name}.parquet").write_bytes(whole)


@every
def test_a_file_that_cannot_be_written(export, alone, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    line = refused(export, alone, tmp_path / "file")
    assert line.startswith("--") and line.endswith("cannot be written: Not a directory")


@pytest.mark.parametrize("option", ["--mcap", "--bag", "--graphml", "--animation", "--pcap"])
def test_folders_and_pipes_are_no_files_to_replace(option, alone, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.gif")
    Path("folder.gif").mkdir()
    for target, why in (("folder.gif", "Is a directory"), ("pipe.gif", "is no regular file")):
        done = CliRunner().invoke(app, ["export", str(alone.path), option, target])
        assert (done.exit_code, done.output) == (2, f"{option}: {target} cannot be written: "
                                                    f"{why}\n")
    if option != "--animation":  # it has no ending
        done = CliRunner().invoke(app, ["export", str(alone.path), option, "."])
        assert (done.exit_code, done.output) == (
            2, f"{option}: . cannot be written: Is a directory\n")
    assert Path("pipe.gif").is_fifo() and sorted(os.listdir()) == ["folder.gif", "pipe.gif"]


def test_two_formats_want_two_files(alone, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["export", str(alone.path), "--mcap", "a", "--bag", "./a"])
    assert (done.exit_code, done.output) == (2, "--bag: a is the file of --mcap, too\n")
    assert not os.listdir()


@pytest.fixture(scope="module")
def huge(repository, home):
    """Fifty robots: two thousand links and more."""
    return made(repository, home, "fleet.size=50", "stop.elapsed=200 ms",
                file="warehouse_300.yaml")


@every
def test_a_large_fleet(export, huge, tmp_path):
    assert export(huge, tmp_path) >= 1
