"""The table of the paper's Table 2."""

import importlib

import pyarrow as pa
import pyarrow.parquet as parquet
import pytest


@pytest.fixture
def table(monkeypatch, repository):
    monkeypatch.syspath_prepend(str(repository / "scenarios" / "paper"))
    return importlib.import_module("table2_table")


def run(processors, seed, time_s):
    return {"processors": processors, "robots_per_node": 8 // processors, "seed": seed,
            "exploration_time_s": time_s, "simulated_s": 2000.0, "mean_cpu_percent": 80.0,
            "mean_node_cpu_percent": 40.0, "mean_ram_percent": 6.0, "missed_ticks": 12,
            "messages_replaced": 3000, "mean_rx_kBps": 1300.0,
            "saturated_first": "processor" if processors == 1 else None}


def test_columns_of_the_paper_are_compared_with_the_runs_seed_by_seed(table, tmp_path, capsys):
    shares = {1: 1.5, 2: 1.0, 4: 1.0, 8: 1.1}
    runs = [run(processors, seed, share * (340 + 10 * seed))
            for processors, share in shares.items() for seed in (1, 2, 3)]
    runs[-1]["exploration_time_s"] = None
    parquet.write_table(pa.Table.from_pylist(runs), tmp_path / "runs.parquet")
    table.main(tmp_path)
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith(
        "| 1 | 8 | 489 | 540 ± 37 | +10 % | 80 | 6 | processor 3 | 1.50 (1.50 to 1.50) | ")
    assert lines[3:5] == [
        "| 2 | 4 | 349 | 360 ± 25 | +3 % | 80 | 6 | nothing 3 | 1 |  |",
        "| 4 | 2 | 350 | 360 ± 25 | +3 % | 80 | 6 | nothing 3 | 1.00 (1.00 to 1.00) | 1 |"]
    assert lines[5].startswith(
        "| 8 | 1 | 384 | 927 ± 2308 (1 late) | +141 % | 80 | 6 | nothing 3 | ")
    assert lines[9] == "| 1 | 40 | 12 | 3000 | 1300 |"


def test_slower_processors_show_when_one_is_too_few(table, tmp_path, capsys):
    for name in ("table2", "slower"):
        (tmp_path / name).mkdir()
    parquet.write_table(pa.Table.from_pylist(
        [run(count, seed, 350.0) for count in (1, 2) for seed in (1, 2)]),
        tmp_path / "table2/runs.parquet")
    times = {(1, 0.1): (800, 900), (2, 0.1): (400, 450),
             (1, 0.3): (330, 380), (2, 0.3): (330, 380)}
    parquet.write_table(pa.Table.from_pylist(
        [run(count, seed, time_s) | {"speed": speed} for (count, speed), own in times.items()
         for seed, time_s in enumerate(own)]), tmp_path / "slower/runs.parquet")
    table.main(tmp_path / "table2", tmp_path / "slower")
    lines = capsys.readouterr().out.splitlines()
    head = ("| speed | time with 1, s | against 2 | p (Holm) | CPU with 1, % | missed ticks "
            "| CPU with 2, % | missed ticks |")
    assert lines[lines.index(head):] == [
        head, "|---|---|---|---|---|---|---|---|",
        "| 0.1 | 850 | 2.00 | 1 | 80 | 12 | 80 | 12 |",
        "| 0.3 | 355 | 1.00 | 1 | 80 | 12 | 80 | 12 |",
        "",
        "| 1 processor, against 2 | time, s | share of time | p (Holm) | faster |",
        "|---|---|---|---|---|",
        "| all speeds | 549 | 1.41 | 1 | 0 of 2 |"]
