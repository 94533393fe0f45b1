"""The table and the map of the campaign gives_in."""

import importlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest


@pytest.fixture
def table(monkeypatch, repository):
    monkeypatch.syspath_prepend(str(repository / "scenarios" / "studies"))
    return importlib.import_module("gives_in_table")


def run(speed, rate, time_s, first):
    return {"speed": speed, "rate": rate, "exploration_time_s": time_s, "simulated_s": 2000.0,
            "gives_in_first": first}


def test_a_cell_has_its_mean_time_and_what_gave_in(table, tmp_path, capsys):
    runs = [run(0.1, "20 Mb/s", None, "port"), run(0.1, "20 Mb/s", 500.0, "processor"),
            run(0.1, "1 Gb/s", 410.0, "processor"), run(1.0, "1 Gb/s", 300.0, None)]
    parquet.write_table(pa.Table.from_pylist(runs), tmp_path / "runs.parquet")
    table.main(tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "| speed | 20 Mb/s | 1 Gb/s |", "|---|---|---|",
        "| 0.1 | > 1250 (port 1, processor 1) | 410 (processor 1) |",
        "| 1.0 | – | 300 (nothing 1) |"]
    assert (tmp_path / "gives_in.png").exists()


def test_the_knee_parts_slow_cells_from_those_that_are_as_fast(table):
    times = np.array([[900.0, 700.0, 500.0], [800.0, 355.0, 350.0], [800.0, 320.0, 300.0]])
    assert table.knee(times) == [((0.5, 0.5), (0.5, 1.5)), ((0.5, 1.5), (0.5, 2.5)),
                                 ((0.5, 0.5), (1.5, 0.5)), ((1.5, 0.5), (2.5, 0.5))]
    assert table.knee(np.full((2, 2), 300.0)) == []
