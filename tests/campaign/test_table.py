"""runs.parquet: types and order."""

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from designs import planned, row

from desim.campaign.design.metrics import Metrics
from desim.campaign.folder.table import read, write_table
from desim.campaign.running.agenda import Agenda
from desim.errors import InputError

TEXT = """parameters:
  rate: {key: network.media.lan.rate, values: [1 Gb/s, 10 Mb/s]}
  beams: {key: robot.laser.beams, values: [10]}
set: {network.media: {lan: {model: switch}}}
iterations: 2
metrics: {twice: 2 * explored}
"""


@pytest.fixture
def written(tmp_path):
    """The table of four runs that were done in another order; one of them failed."""
    plan = planned(tmp_path, TEXT)
    metrics, agenda = Metrics(plan), Agenda(plan, {})
    for number, (_, _, run_id) in reversed([*enumerate(agenda.runs)]):
        failed = {"run_id": run_id, "status": "failed", "error": "boom\x1b[31m"}
        agenda.add(failed if number == 3 else
                   row(run_id, explored=number / 4, collisions=number, exploration_time_s=None,
                       map_quality=1 if number else 0.5, messages_dropped_lost=7))
    write_table(tmp_path / "runs.parquet", plan, metrics, agenda.rows, agenda.runs)
    return pq.read_table(tmp_path / "runs.parquet")


def test_values(written):
    found = written.to_pydict()
    assert found["vector"] == [0, 0, 1, 1] and found["iteration"] == [0, 1, 0, 1]
    assert found["rate"] == ["1 Gb/s"] * 2 + ["10 Mb/s"] * 2
    assert found["rate_bps"] == [1e9, 1e9, 1e7, 1e7]
    assert found["beams"] == [10] * 4 and "beams_" not in found
    assert found["explored"] == [0, 0.5, 0.25, None] and found["twice"] == [0, 1, 0.5, None]
    assert found["collisions"] == [0, 2, 1, None] and found["map_quality"] == [0.5, 1, 1, None]
    assert found["error"] == [None, None, None, "boom\\x1b[31m"]  # no colour for a terminal
    assert found["messages_dropped_lost"] == [7, 7, 7, None]  # which the rehearsal did not have


def test_types(written):
    types = {name: written.schema.field(name).type for name in written.column_names}
    assert types["exploration_time_s"] == types["map_quality"] == pa.float64()  # one has no value
    assert types["collisions"] == types["seed"] == types["beams"] == pa.int64()
    assert types["run_id"] == types["error"] == types["rate"] == pa.string()


def test_a_table_with_an_iteration_twice_is_refused(written, tmp_path):
    path = tmp_path / "runs.parquet"
    assert read(path).num_rows == 4
    pq.write_table(pa.concat_tables([written, written.slice(2, 1)]), path)
    with pytest.raises(InputError, match=f"^{path}: not the table of a campaign: a vector has an "
                                         "iteration twice$"):
        read(path)


def test_a_disk_that_is_full_leaves_the_table_as_it_was(tmp_path, monkeypatch):
    from desim.campaign.running.sweep import Sweep

    plan = planned(tmp_path, TEXT)
    out = tmp_path / "out"

    class Nobody:
        has_idle_worker = is_busy = False

    with Sweep(plan, Metrics(plan), out) as sweep:
        sweep.run(Nobody())
        before = (out / "runs.parquet").read_bytes()

        def full(table, path, **options):
            path.write_bytes(b"PAR1")
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(pq, "write_table", full)
        with pytest.raises(InputError, match="No space left on device; what is finished stays"):
            sweep.run(Nobody())
    assert (out / "runs.parquet").read_bytes() == before
    assert not [path for path in out.iterdir() if path.name.endswith(".new")]
