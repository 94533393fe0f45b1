"""Two campaigns side by side, from one column of their tables after the other."""

import subprocess
import sys
from math import isfinite

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from designs import written
from hypothesis import given
from hypothesis import strategies as st

import desim

DESIGN = "parameters: {where: {key: a, values: [1, 2]}, how: {key: b, values: [1, 2]}}\n"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    made = [tmp_path_factory.mktemp(name) for name in ("first", "second")]
    for folder in made:
        written(folder, DESIGN)
    return made


def table(count, **columns):
    """The columns that each table of a campaign has, and others."""
    texts = {name: pa.array([name] * count, pa.string()) for name in ("run_id", "error", "digest")}
    numbers = {name: range(count) for name in ("vector", "iteration", "seed")}
    return pa.table(texts | numbers | columns)


def rows(levels):
    """Rows of a table: status, two levels, two metrics."""
    return st.lists(st.tuples(
        st.sampled_from(["finished", "failed"]), levels, st.booleans(),
        st.none() | st.integers(0, 9), st.none() | st.floats(-1e3, 1e3)), min_size=1, max_size=20)


@given(both=st.sampled_from([st.sampled_from("abc"), st.integers(-1, 1),
                             st.sampled_from([0.5, 1.5])]).flatmap(
    lambda levels: st.tuples(rows(levels), rows(levels))))
def test_each_vector_has_the_means_of_its_own_runs(folders, both):
    """As a plain loop finds them: vectors in the order of the first campaign's runs."""
    for folder, own in zip(folders, both, strict=True):
        status, where, how, whole, real = zip(*own, strict=True)
        pq.write_table(table(len(own), status=status, where=where, how=how,
                             whole=pa.array(whole, pa.int64()), real=pa.array(real, pa.float64())),
                       folder / "runs.parquet", row_group_size=3)
    groups = [{}, {}]
    for own, group in zip(both, groups, strict=True):
        for status, where, how, *metrics in own:
            if status == "finished":
                group.setdefault((where, how), []).append(metrics)
    found = desim.compare(*folders)
    assert found.parameters == ("where", "how")
    assert found.metrics == ("whole", "real")
    for number, metric in enumerate(found.metrics):
        wanted = []
        for levels in groups[0]:
            if levels in groups[1]:
                own = [[metrics[number] for metrics in group[levels]
                        if metrics[number] is not None and isfinite(metrics[number])]
                       for group in groups]
                wanted.append((levels, [sum(part) / len(part) if part else None for part in own],
                               tuple(map(len, own))))
        pairs = [(tuple(pair.levels.values()), [pair.metric.first, pair.metric.second], pair.runs)
                 for pair in found.pairs(metric)]
        assert [(levels, [one if one is None else pytest.approx(one) for one in means], runs)
                for levels, means, runs in wanted] == pairs


def test_truth_values_are_a_metric_if_all_runs_have_them(folders):
    for folder in folders:
        pq.write_table(table(2, status=["finished"] * 2, where=[1, 1], how=[2, 2],
                             all_have=[True, False], one_has=[True, None],
                             word=["x", "y"], none=pa.nulls(2)), folder / "runs.parquet")
    found = desim.compare(*folders)
    assert found.metrics == ("all_have",)
    assert [(pair.metric.first, pair.runs) for pair in found.pairs("all_have")] == [(0.5, (2, 2))]


_COMPARED = """\
import sys
import desim
desim.compare(sys.argv[1], sys.argv[2]).json_object()
print(*(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def test_large_tables_of_equal_rows_take_less_than_400_mb(folders):
    """Small files of 160 000 equal rows and 140 columns, 180 MB each in memory: both as a whole
    took 975 MB, column by column they take 240 to 290 MB, as Arrow's allocator likes."""
    part = table(10_000, status=["finished"] * 10_000, where=["here"] * 10_000,
                 how=["so"] * 10_000, **{f"m{number}": [0.5] * 10_000 for number in range(130)})
    for folder in folders:
        with pq.ParquetWriter(folder / "runs.parquet", part.schema, compression="zstd") as writer:
            for _ in range(16):
                writer.write_table(part)
    done = subprocess.run([sys.executable, "-c", _COMPARED, *map(str, folders)], check=True,
                          text=True, capture_output=True)
    assert 0 < int(done.stdout) < 400_000, "kB at the most, everything that is imported included"
