"""The folder of a run: complete or not there, and every number covered by what was kept."""

from __future__ import annotations

import resource
import signal
from contextlib import contextmanager

import numpy as np
import pytest
import yaml

import desim
from desim.engine.kernel import Phase
from desim.engine.trace import ROW, Names, Trace
from desim.errors import InputError
from desim.ports import GridSpec
from desim.results import folder as results
from desim.results import maps, traces
from desim.results.folder import RunFolder
from desim.results.seal import seal
from desim.results.traces import first_difference, kept, simulated, spools, trace_of

SHORT = ("stop.elapsed=6 s",)
S = 1_000_000_000


@pytest.fixture(scope="module")
def hello(repository):
    return repository / "scenarios" / "hello.yaml"


@pytest.fixture(scope="module")
def finished(hello, tmp_path_factory):
    """Six seconds of hello with every row kept."""
    return desim.run(hello, overrides=(*SHORT, "trace.keep=all"),
                     out=tmp_path_factory.mktemp("results"), command="desim run hello")


def meanwhile(time_s: float, do):
    """A ``watch`` that calls ``do(simulation)`` at an instant of the run."""
    @contextmanager
    def watch(simulation, folder):
        simulation.kernel.at(round(time_s * S), Phase.WORLD, 0, lambda _: do(simulation))
        yield

    return watch


def interrupt(_):
    signal.raise_signal(signal.SIGINT)


def test_a_mapping_is_as_good_as_a_file(hello):
    data = yaml.safe_load(hello.read_text())
    assert desim.from_mapping(data, SHORT, 7).scenario == desim.load(hello, SHORT, 7).scenario


def test_the_contract(finished):
    assert finished.path.name == finished.manifest["run_id"]
    assert sorted(file.name for file in finished.path.iterdir()) == [
        "events.parquet", "growth.parquet", "latency.parquet", "links.parquet", "manifest.json",
        "map", "messages.parquet", "moving_obstacles.parquet", "names.json", "plans.parquet",
        "poses.parquet", "robots.parquet", "samples.parquet", "scenario.resolved.yaml",
        "summary.json", "trace.parquet", "walls.parquet"]
    assert sorted(file.name for file in (finished.path / "map").iterdir()) == [
        "merged.pgm", "merged.yaml", "truth.pgm", "truth.yaml"]
    assert set(finished.manifest) >= {
        "desim_version", "versions", "seed", "run_id", "digest", "digest_by_entity", "status",
        "simulated_s", "wall_s", "cpu_s", "real_time_factor", "peak_memory_mb", "events",
        "command", "machine", "plugins"}
    assert (finished.manifest["status"], finished.manifest["simulated_s"]) == ("finished", 6.0)
    assert set(finished.metrics) >= {
        "stop_reason", "exploration_time_s", "union_time_s", "fleet_time_s", "exploration_cost_m",
        "exploration_efficiency_m2_per_m", "safety", "collisions", "recoveries",
        "map_completeness", "map_quality", "explored_area_m2", "messages_sent",
        "messages_delivered", "messages_dropped", "bytes_on_air", "control_bytes", "digest",
        "partitions", "traffic", "latency_by_topic"}
    assert set(finished.metrics["robots"]) == {"robot_0", "robot_1", "robot_2"}
    assert set(finished.metrics["robots"]["robot_0"]) >= {"rx_kBps", "tx_kBps"}


def test_the_peak_of_memory_is_that_of_the_run_alone(hello, tmp_path):
    """Not of what the process did before."""
    np.ones(50_000_000)  # 400 MB
    before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    run = desim.run(hello, overrides=SHORT, out=tmp_path)
    assert run.manifest["peak_memory_mb"] < before_mb - 200


def test_the_digest_is_that_of_the_rows(finished, tmp_path):
    rows, names = kept(finished, tmp_path / "spool")
    log = Trace(Names())
    log.put(rows[::-1].tobytes())
    assert log.digest() == finished.manifest["digest"]
    assert set(finished.manifest["digest_by_entity"]) \
        == {names[entity] for entity in np.unique(rows["entity"]).tolist()}


def test_messages_are_those_of_the_summary(finished):
    table, metrics = finished.table("messages"), finished.metrics
    arrived = table["fate"] == "delivered"
    assert arrived.sum() == metrics["messages_delivered"]
    assert len(table["fate"]) == metrics["messages_sent"] - metrics["messages_in_flight"]
    assert (table["latency_ns"][arrived] == (table["end_ns"] - table["born_ns"])[arrived]).all()
    assert (table["born_ns"] <= table["first_ns"]).all()
    assert (table["first_ns"] <= table["last_ns"]).all()
    assert (table["last_ns"] <= table["end_ns"]).all()
    histogram = finished.table("latency")
    assert histogram["count"].sum() == arrived.sum()
    assert sum(kind["bytes"] for kind in metrics["traffic"].values()) \
        == table["size_bytes"][arrived].sum()


def test_only_what_was_dropped_has_a_reason(hello, tmp_path):
    run = desim.run(hello, overrides=(
        "stop.elapsed=2 s",
        "network.media.lan={model: ideal, rules: [{rule: loss, probability: 50 %}]}"), out=tmp_path)
    table = run.table("messages")
    dropped = table["fate"] == "dropped"
    assert 0 < dropped.sum() < len(dropped)
    assert (np.array([reason is not None for reason in table["reason"]]) == dropped).all()
    assert (np.isnan(table["latency_ns"]) == dropped).all()


def test_the_maps_say_what_the_summary_says(finished):
    known, truth, metrics = finished.map.cells, finished.truth.cells, finished.metrics
    reachable = truth == 0
    assert (known >= 0)[reachable].sum() / reachable.sum() == metrics["map_completeness"]
    cell_m2 = finished.map.grid.resolution_m ** 2
    assert reachable.sum() * cell_m2 == pytest.approx(metrics["reachable_area_m2"])
    assert finished.map.grid == finished.truth.grid


def test_tables_end_where_the_run_ends(finished):
    assert finished.samples["time_s"][-1] == 6.0
    assert finished.samples["cause"].tolist() == ["period", "period", "end"]
    assert finished.robots["time_s"].tolist() == np.repeat(np.arange(7.0), 3).tolist()
    last = finished.robots["distance_m"][-3:].sum()
    assert last == pytest.approx(finished.metrics["exploration_cost_m"])


def test_what_is_kept_changes_no_digest(finished, hello, tmp_path):
    for keep, file in (("none", None), ("messages", "messages.parquet")):
        run = desim.run(hello, overrides=(*SHORT, f"trace.keep={keep}"), out=tmp_path)
        assert run.manifest["digest"] == finished.manifest["digest"]
        assert {entry.name for entry in run.path.glob("[mt]*s*e*.parquet")} == \
            ({file} if file else set())


def test_the_resolved_scenario_gives_the_same_run(finished, tmp_path):
    again = desim.run(finished.path / "scenario.resolved.yaml", out=tmp_path)
    assert again.manifest["run_id"] == finished.manifest["run_id"]
    assert again.manifest["digest"] == finished.manifest["digest"]
    assert "differs_from_earlier" not in again.manifest


# --------------------------------------------------------------------------- what is not finished


def test_an_interrupted_run_keeps_its_results(hello, tmp_path):
    with pytest.raises(KeyboardInterrupt) as stopped:
        desim.run(hello, out=tmp_path, watch=meanwhile(2.5, interrupt))
    run = desim.Run(stopped.value.args[0])
    assert run.manifest["status"] == run.metrics["stop_reason"] == "interrupted"
    assert run.metrics["simulated_s"] == run.samples["time_s"][-1] == 2.5
    assert run.metrics["censored"]


def test_part_of_a_run_does_not_replace_the_finished_one(hello, tmp_path):
    run = desim.run(hello, overrides=SHORT, out=tmp_path)
    with pytest.raises(KeyboardInterrupt) as stopped:
        desim.run(hello, overrides=SHORT, out=tmp_path, watch=meanwhile(1.0, interrupt))
    assert stopped.value.args == ()
    assert desim.Run(run.path).manifest == run.manifest
    assert [entry.name for entry in run.path.parent.iterdir()] == [run.path.name]


def test_a_finished_run_replaces_an_interrupted_one(hello, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        desim.run(hello, overrides=SHORT, out=tmp_path, watch=meanwhile(1.0, interrupt))
    run = desim.run(hello, overrides=SHORT, out=tmp_path)
    assert run.manifest["status"] == "finished"
    assert [entry.name for entry in run.path.parent.iterdir()] == [run.path.name]


def test_a_failed_run_says_why(hello, tmp_path):
    def fail(_):
        raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError):
        desim.run(hello, out=tmp_path, watch=meanwhile(1.5, fail))
    (path,) = (tmp_path / "hello").iterdir()
    run = desim.Run(path)
    assert run.manifest["status"] == "failed"
    assert run.manifest["simulated_s"] == 1.5
    assert run.manifest["events"] > 0
    assert "on purpose" in run.manifest["error"]
    assert run.manifest["error"].endswith(" (1.5 s)")
    with pytest.raises(InputError, match="no summary.json .its status is 'failed'"):
        run.metrics  # noqa: B018 - reading it raises


def test_a_wrong_scenario_leaves_nothing(hello, tmp_path):
    with pytest.raises(InputError):
        desim.run(hello, overrides=("fleet.start.step=[0.1 m, 0 m]",), out=tmp_path)
    assert not list(tmp_path.rglob("*.json"))
    assert not list(tmp_path.rglob("*.partial"))


def test_a_full_disk_is_said_clearly_and_leaves_nothing(hello, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results.parquet, "write", full)
    with pytest.raises(InputError, match="No space left on device; free some space, or"):
        desim.run(hello, overrides=("stop.elapsed=1 s",), out=tmp_path)
    assert not list((tmp_path / "hello").iterdir())


def test_a_folder_that_cannot_be_made(hello, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write results.*Not a directory; choose another"):
        desim.run(hello, out=tmp_path / "file")


def test_two_processes_do_not_write_one_run(hello, tmp_path):
    scenario = desim.load(hello).scenario
    first = RunFolder(tmp_path, scenario)
    with pytest.raises(InputError, match="another process is writing this run"):
        RunFolder(tmp_path, scenario)
    first.discard()
    RunFolder(tmp_path, scenario).discard()


def test_what_a_killed_process_left_is_swept_and_never_taken_for_a_run(hello, tmp_path):
    scenario = desim.load(hello, SHORT).scenario
    folder = RunFolder(tmp_path, scenario)
    partial = folder.path.with_name(f"{folder.run_id}.partial")
    folder.discard()
    partial.mkdir()
    (partial / "samples.parquet").write_text("half")
    with pytest.raises(InputError, match="cut off"):
        desim.Run(partial)
    run = desim.run(scenario, out=tmp_path)
    assert run.samples["time_s"][-1] == 6.0
    assert not partial.exists()


def test_another_digest_for_the_same_run_is_noticed(hello, tmp_path):
    run = desim.run(hello, overrides=SHORT, out=tmp_path)
    seal(run.path, {**run.manifest, "digest": "f" * 32}, run.manifest["files"])
    again = desim.run(hello, overrides=SHORT, out=tmp_path)
    assert again.manifest["differs_from_earlier"] == "f" * 32


# ------------------------------------------------------------------------------- maps, comparing


def test_maps_survive_being_written_and_read(tmp_path):
    cells = np.array([[0, 100, -1], [-1, 0, 100]], np.int8)
    grid = GridSpec(0.25, 3, 2, -1.5, 2.0)
    maps.save(tmp_path, "map", cells, grid)
    loaded = maps.parsed(*((tmp_path / f"map.{ending}").read_bytes()
                           for ending in ("yaml", "pgm")))
    assert (loaded.cells == cells).all()
    assert loaded.grid == grid
    assert loaded.extent_m == (-1.5, -0.75, 2.0, 2.5)
    # The first row of the image is the top of the map: map_server's order.
    assert (tmp_path / "map.pgm").read_bytes() == b"P5\n3 2\n255\n" + bytes(
        [205, 254, 0, 254, 0, 205])


def test_running_again_gives_row_for_row_what_was_kept(finished, tmp_path):
    scenario = desim.load(finished.path / "scenario.resolved.yaml").scenario
    with spools() as folder:
        again, names = simulated(scenario, folder / "again")
        before, names_before = kept(finished, tmp_path / "spool")
        assert first_difference(again, before) is None
        assert names == names_before


def test_a_run_of_other_versions_is_not_repeated(hello, tmp_path):
    run = desim.run(hello, overrides=("stop.elapsed=1 s",), out=tmp_path)
    trace_of(run, tmp_path / "spool")
    manifest = {**run.manifest, "versions": {**run.manifest["versions"], "numpy": "1.0"}}
    seal(run.path, manifest, manifest["files"])
    with pytest.raises(InputError, match="versions in its manifest differ"):
        trace_of(desim.Run(run.path), tmp_path / "spool")


def test_the_first_difference_of_two_traces():
    rows = np.zeros(10, ROW)
    for at in (0, 7, 9):
        other = rows.copy()
        other["b"][at:] = 1
        assert first_difference(rows, other) == at
    assert first_difference(rows, rows[:4]) == 4
    assert first_difference(rows, rows.copy()) is None


@pytest.mark.parametrize("chunk", [2, 3, 1000])
def test_traces_are_compared_in_parts_and_the_order_inside_an_instant_does_not_count(
        monkeypatch, chunk):
    monkeypatch.setattr(traces, "_CHUNK", chunk)
    rows = np.zeros(10, ROW)
    rows["t_ns"], rows["b"] = np.arange(10) // 2, np.arange(10)
    other = rows.copy()
    other[[4, 5]] = other[[5, 4]]
    assert first_difference(rows, other) is None
    other["b"][8] = 99
    assert first_difference(rows, other) == 8


def test_what_is_shown_live_are_the_events_that_are_kept(hello, tmp_path):
    seen = []

    @contextmanager
    def watch(simulation, folder):
        folder.on_events = seen.append
        yield

    run = desim.run(hello, overrides=("stop.elapsed=1 s",), out=tmp_path, watch=watch)
    rows = np.concatenate(seen)
    kept_rows = run.table("events")
    assert len(rows) == len(next(iter(kept_rows.values()))) > 0


def test_the_names_of_a_run_are_its_ids(finished):
    ids = Names()
    assert all(ids.id(name) == id_ for id_, name in finished.names.items())
