"""The table and the map of the campaign saturation."""

import importlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest


@pytest.fixture
def table(monkeypatch, repository):
    monkeypatch.syspath_prepend(str(repository / "scenarios" / "studies"))
    return importlib.import_module("saturation_table")


def run(speed, rate, time_s, **from_s):
    """``from_s``: when each resource saturated, None if it did not."""
    return {"speed": speed, "rate": rate, "seed": 1, "exploration_time_s": time_s,
            "simulated_s": 2000.0,
            **{f"saturation_{name}_from_s": from_s.get(name) for name in ("port", "processor")}}


def test_a_cell_has_its_mean_time_and_what_gave_in(table, tmp_path, capsys):
    runs = [run(0.1, "20 Mb/s", None, port=10.0, processor=15.0),
            run(0.1, "20 Mb/s", 500.0, processor=5.0),
            run(0.1, "1 Gb/s", 410.0, processor=5.0), run(1.0, "1 Gb/s", 300.0)]
    parquet.write_table(pa.Table.from_pylist(runs), tmp_path / "runs.parquet")
    table.main(tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "| speed | 20 Mb/s | 1 Gb/s |", "|---|---|---|",
        "| 0.1 | > 1250 (port 1, processor 1) | 410 (processor 1) |",
        "| 1 | – | 300 (nothing 1) |", "",
        "Runs in which nothing saturated took 300 s in the mean.", "",
        "| speed, against 1 | share of time | p (Holm) | slower | over seeds |",
        "|---|---|---|---|---|", "",
        "| rate, against 1 Gb/s | share of time | p (Holm) | slower | over seeds |",
        "|---|---|---|---|---|"]
    assert (tmp_path / "saturation.png").exists()


def test_times_are_shares_of_those_at_the_highest_value_where_all_runs_finished(table, capsys):
    runs = [run(speed, rate, 1000.0 / speed * slower + 10 * seed, port=None) | {"seed": seed}
            for speed in (1, 2) for rate, slower in (("1 Mb/s", 1.5), ("9 Mb/s", 1))
            for seed in (1, 2, 3)]
    late = [run(speed, "0.1 Mb/s", None) for speed in (1, 2)]
    table.shares(late + runs, "speed", "rate")
    table.shares(late + runs, "rate", "speed")
    head = "share of time | p (Holm) | slower | over seeds |", "|---|---|---|---|---|"
    lines = capsys.readouterr().out.splitlines()
    assert lines[:3] == ["", f"| speed, against 2 | {head[0]}", head[1]]
    assert lines[3].startswith("| 1 | 1.97 (1.95 to 1.98) | ")
    assert lines[3].endswith(" | 6 of 6 | 1.93 to 2.01 |")
    assert lines[4:7] == ["", f"| rate, against 9 Mb/s | {head[0]}", head[1]]
    assert lines[7].startswith("| 1 Mb/s | 1.49 (1.48 to 1.49) | ")


def test_a_map_has_the_resource_that_gave_in_first_most_often_alone_or_with_others(table):
    assert table.most_often(table.Counter({"lan": 1, "processor": 1})) == "lan or processor"
    assert table.most_often(table.Counter(
        {"lan": 1, "lan + processor": 1, "cluster_node": 1})) == "lan"


def test_of_resources_that_saturate_at_once_none_is_the_first(table):
    tied = run(0.1, "20 Mb/s", 500.0, port=15.0, processor=15.0)
    assert table.gave_in([tied, run(0.1, "20 Mb/s", 500.0, port=5.0, processor=15.0)]) == {
        "port + processor": 1, "port": 1}


def test_the_knee_parts_slow_cells_from_those_that_are_as_fast(table):
    times = np.array([[900.0, 700.0, 500.0], [800.0, 355.0, 350.0], [800.0, 320.0, 300.0]])
    assert table.knee(times, 300.0) == [((0.5, 0.5), (0.5, 1.5)), ((0.5, 1.5), (0.5, 2.5)),
                                 ((0.5, 0.5), (1.5, 0.5)), ((1.5, 0.5), (2.5, 0.5))]
    assert table.knee(np.full((2, 2), 300.0), 300.0) == []
