"""Counted costs: Python calls by function and event, and callgrind's instructions."""

from __future__ import annotations

import pytest
from benchmarks import calls, instructions

PROFILE = """# callgrind format
events: Ir
ob=(1) /usr/lib/libpython3.11.so
fn=(1) eval
12 40
+3 2
cob=(2) /usr/lib/libc.so.6
cfn=(2) memcpy
calls=3 9
12 600
fn=(2)
9 7
ob=(2)
fn=(3) 0x00005000'2
0 100
"""


def test_callgrinds_own_instructions_are_summed_by_object_and_function():
    assert instructions.parse(PROFILE, {0x5100: "steer", 0x4ff0: "flood"}) == {
        ("libpython3.11.so", "eval"): 42, ("libpython3.11.so", "memcpy"): 7,
        ("libc.so.6", "steer"): 100}


@pytest.fixture
def committed(tmp_path, monkeypatch):
    file = tmp_path / "calls.csv"
    monkeypatch.setattr(calls, "COMMITTED", file)
    calls.commit({"hello": 1000, "maze_30": 100_000})
    return file


def test_one_percent_more_calls_than_committed_are_too_many(committed):
    assert calls.too_many({"hello": 1010, "maze_30": 90_000}) == []
    assert calls.too_many({"hello": 1011}) == [
        "hello: 1011 Python calls in 20 s, +1.1% of the 1000 in calls.csv; at most +1% is allowed: "
        "take them back, or change the figure (`python tools/bench.py calls --write`) and say why"]


def test_counts_of_other_workloads_stay_when_some_are_written(committed):
    calls.commit({"hello": 900})
    assert calls.committed() == {"hello": 900, "maze_30": 100_000}


def test_every_workload_has_a_committed_figure():
    assert calls.committed().keys() == calls.WORKLOADS.keys()


def test_calls_are_counted_by_function_and_by_event(monkeypatch):
    monkeypatch.setattr(calls, "UNTIL_S", 1)
    calls.count("hello")  # which fills caches, such as those of typing's protocols
    first, second = calls.count("hello"), calls.count("hello")
    assert first.functions == second.functions
    assert first.total == sum(first.by_event.values())
    events = {row["what"]: row["events"] for row in calls.event_rows(first, 100)}
    assert events["desim/robot/navigation/move_base.py:MoveBase._control"] == 30.0  # three at 10 Hz
