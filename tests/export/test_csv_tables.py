"""``desim export --csv``: every table of a run, value by value."""

from __future__ import annotations

import csv
import shutil

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.errors import InputError
from desim.export.csv_tables import write_csv
from desim.results.run import Run
from desim.results.seal import manifest_of, seal


@pytest.fixture(scope="module")
def run(repository, tmp_path_factory):
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=("stop.elapsed=6 s",),
                     out=tmp_path_factory.mktemp("results"))


def read(path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def shown(value: object) -> str:
    """A value as CSV has it."""
    if isinstance(value, list):
        return " ".join(map(str, value))
    return "" if value is None else str(value)


def same(text: str, value: object) -> bool:
    if isinstance(value, float):
        return float(text) == value
    return text.lower() == shown(value).lower()


def test_every_table_is_written_value_by_value(run, tmp_path):
    reports = []
    written = write_csv(run, tmp_path / "csv", lambda *at: reports.append(at))
    tables = sorted(path.stem for path in run.path.glob("*.parquet"))
    assert [path.name for path in written] == [*(f"{name}.csv" for name in tables), "metrics.csv"]
    for name in tables:
        rows = pq.read_table(run.path / f"{name}.parquet").to_pylist()
        found = read(tmp_path / "csv" / f"{name}.csv")
        assert len(found) == len(rows)
        for one, other in zip(found, rows, strict=True):
            assert list(one) == list(other)
            assert all(same(one[key], other[key]) for key in one)
    assert reports[-1][0] == reports[-1][1]


def test_metrics_are_a_name_and_a_value_a_line(run, tmp_path):
    write_csv(run, tmp_path, lambda *at: None)
    metrics = {row["metric"]: row["value"] for row in read(tmp_path / "metrics.csv")}
    assert float(metrics["exploration_cost_m"]) == run.metrics["exploration_cost_m"]
    assert metrics["exploration_time_s"] == ""  # it was not reached


def test_lists_are_written_with_spaces(run, tmp_path):
    shutil.copytree(run.path, tmp_path / "run")
    table = pa.table({"x_mm": pa.array([[1, 2], [], None], pa.list_(pa.int32()))})
    pq.write_table(table, tmp_path / "run" / "plans.parquet")
    manifest = manifest_of(tmp_path / "run")
    seal(tmp_path / "run", manifest, [*manifest["files"], "plans.parquet"])
    write_csv(Run(tmp_path / "run"), tmp_path / "csv", lambda *at: None)
    assert (tmp_path / "csv" / "plans.csv").read_text() == '"x_mm"\n"1 2"\n""\n\n'


def test_a_damaged_table_is_named(run, tmp_path):
    shutil.copytree(run.path, tmp_path / "run")
    (tmp_path / "run" / "robots.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError) as error:
        write_csv(Run(tmp_path / "run"), tmp_path / "csv", lambda *at: None)
    assert str(error.value) == (f"{tmp_path / 'run'}: damaged: robots.parquet is not what desim "
                                "wrote; running its scenario again mends it")


def test_a_file_in_the_place_of_the_folder_is_refused(run, tmp_path):
    (tmp_path / "csv").touch()
    done = CliRunner().invoke(app, ["export", str(run.path), "--csv", str(tmp_path / "csv")])
    assert done.exit_code == 2
    assert done.stderr == f"--csv: {tmp_path / 'csv'} cannot be written: File exists\n"
