"""Tables of runs: read as desim writes them, and refused where they are not so."""

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import desim
from desim.results import tables
from desim.results.ledger import read_ledger
from desim.results.parquet import read_table
from desim.results.row import failure


@pytest.fixture(scope="module")
def folder(repository, tmp_path_factory):
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=(
        "stop.elapsed=2 s", "trace.keep=all", "trace.ledger=true"),
        out=tmp_path_factory.mktemp("results")).path


def test_what_desim_writes_is_read_as_it_is(folder):
    names = {file.name for file in folder.glob("*.parquet")} - {"ledger.parquet"}
    assert names == tables._schemas().keys()
    for name in names:
        known, written = tables.read(folder / name), read_table(folder / name)
        assert known.select(written.column_names).to_pylist() == written.to_pylist()
    ledger = folder / "ledger.parquet"
    assert read_ledger(ledger).select(read_table(ledger).column_names).to_pylist() \
        == read_table(ledger).to_pylist()


BIG = 2**62
WRONG = [
    ("messages", "destination", None, "it has no column destination"),
    ("events", "t_ns", ["x"], "Failed to parse string: 'x' as a scalar of type int64"),
    ("poses", "x_mm", [BIG], f"Integer value {BIG} not in range: -2147483648 to 2147483647"),
    ("poses", "robot", [None], "Casting field 'robot' with null values to non-nullable"),
    ("growth", "width", [BIG], f"Integer value {BIG} not in range: -2147483648 to 2147483647"),
    ("growth", "started_ns", None, "it has no column started_ns"),
    ("samples", "distance_m", ["far"], "its column distance_m has no numbers"),
    ("samples", "distance_m", [[1]], "its column distance_m has no numbers"),
    ("robots", "x_m", ["far"], "Failed to parse string: 'far' as a scalar of type double"),
    ("links", "linked", [b"\xff"], "Failed to parse value: \ufffd"),
]


@pytest.mark.parametrize(("name", "column", "values", "text"), WRONG)
def test_what_desim_does_not_write_is_refused(folder, tmp_path, name, column, values, text):
    path = tmp_path / f"{name}.parquet"
    table = read_table(folder / path.name).drop_columns([column])
    if values is not None:
        table = table.append_column(column, pa.array(values * len(table)))
    pq.write_table(table, path)
    with pytest.raises((ValueError, pa.ArrowException)) as caught:
        tables.read(path)
    assert str(caught.value) == text


def test_a_column_that_is_twice_there_is_refused(folder, tmp_path):
    table = read_table(folder / "links.parquet")
    path = tmp_path / "links.parquet"
    pq.write_table(pa.Table.from_arrays([*table.columns, table["host"]],
                                        names=[*table.column_names, "host"]), path)
    with pytest.raises(ValueError, match="it has two columns of one name"):
        tables.read(path)


@pytest.mark.parametrize(("text", "rows", "says"), [
    ("x" * 2_000_000, 1, "a text of 2 MB is none of desim's"),
    ("x" * 100_000, 9000, "it would take 900 MB of memory, as no table of desim's does")])
@pytest.mark.parametrize("nested", [False, True])
def test_texts_that_pack_well_are_refused_before_they_are_unpacked(tmp_path, text, rows, says,
                                                                   nested):
    path = tmp_path / "a.parquet"
    texts = pa.DictionaryArray.from_arrays(pa.array([0] * rows, pa.int32()), pa.array([text]))
    pq.write_table(pa.table({"a": pa.ListArray.from_arrays(range(rows + 1), texts)
                             if nested else texts}), path, store_schema=False)
    with pytest.raises(ValueError, match=f"^{says}$"):
        read_table(path)


def test_the_rows_of_runs_that_failed_have_the_beginning_of_a_long_error():
    assert failure("a", "x" * 10_000)["error"] == "x" * 10_000
    assert failure("a", "x" * 10_001)["error"] == "x" * 10_000 + "... (10,001 letters)"
