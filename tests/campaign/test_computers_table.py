"""The table of the study of weak computers."""

import importlib

import pyarrow as pa
import pyarrow.parquet as parquet


def test_speeds_are_compared_run_by_run_and_over_the_means_of_seeds(monkeypatch, repository,
                                                                    tmp_path, capsys):
    monkeypatch.syspath_prepend(str(repository / "scenarios" / "studies"))
    table = importlib.import_module("computers_table")
    shares = {1: (1.1, 1.3), 2: (1.2, 1.2), 3: (1.1, 1.1)}  # by seed, of fleets of 1 and 8
    runs = [{"speed": speed, "robots": robots, "localization": "gmapping", "seed": seed,
             "exploration_time_s": 100.0 * robots * (share if speed == 0.1 else 1.0),
             "simulated_s": 900.0, "mean_cpu_percent": robots / speed}
            for seed, own in shares.items() for robots, share in zip((1, 8), own, strict=True)
            for speed in (0.1, 10)]
    runs[0]["exploration_time_s"], runs[0]["simulated_s"] = None, 110.0  # not explored in time
    parquet.write_table(pa.Table.from_pylist(runs), tmp_path / "runs.parquet")
    table.main(tmp_path)
    assert capsys.readouterr().out.splitlines() == [
        "", "| speed, against 10 | share of time | p (Holm) | slower | over seeds |",
        "|---|---|---|---|---|",
        "| 0.1 | 1.16 (1.08 to 1.25) | 0.0029 | 6 of 6 | 1.03 to 1.32 |", "",
        "| mean time, s | speed | 1 | 8 robots | CPU, % |", "|---|---|---|---|---|",
        "| gmapping | 0.1 | 113 | 960 | 10 to 80 |", "| gmapping | 10 | 100 | 800 | 0.1 to 0.8 |"]
