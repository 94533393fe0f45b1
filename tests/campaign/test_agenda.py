"""The runs of an agenda, and their order."""

from collections import deque
from itertools import pairwise

import pytest
from designs import planned, row
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from desim.campaign.design.design import Until
from desim.campaign.running.agenda import Agenda, spread, stopping_rule

ROBOTS = "parameters: {robots: {key: fleet.size, values: [1, 2, 3]}}\n"
UNTIL = ROBOTS + "iterations: {metric: explored, width: %s, at_least: 3, at_most: 12}\n"


def played(plan, jobs, picks=(), value=lambda row: row["metrics"]["explored"],
           draw=lambda vector, iteration: 0.0, rows=None):
    """All runs that an agenda asks for, with ``jobs`` at once that end as ``picks`` say."""
    agenda = Agenda(plan, {} if rows is None else rows, (), value)
    picks, busy, asked = deque(picks), [], []
    while True:
        while len(busy) < jobs and (run := agenda.next()) is not None:
            busy.append(run)
            asked.append(run)
        if not busy:
            return agenda, [(vector.number, iteration) for vector, iteration, _ in asked]
        vector, iteration, run_id = busy.pop((picks.popleft() if picks else 0) % len(busy))
        agenda.add(row(run_id, explored=draw(vector, iteration)))


def draw(vector, iteration):
    """Vector 0 hardly varies, 1 does somewhat, 2 a lot."""
    return 100 + (0.1, 4, 50)[vector.number] * (-1) ** iteration


def test_the_whole_design_first_then_again(tmp_path):
    plan = planned(tmp_path, ROBOTS + "iterations: 2\n")
    agenda, asked = played(plan, jobs=1)
    assert asked == [(0, 0), (2, 0), (1, 0), (0, 1), (2, 1), (1, 1)]
    assert agenda.progress == (6, 0, 6)


@given(count=some.integers(1, 300), share=some.floats(0, 1))
def test_each_beginning_of_the_order_covers_the_design_evenly(count, share):
    """The largest gap is at most 2.62 (1 + golden ratio) times the mean one."""
    order = spread(range(count))
    assert sorted(order) == list(range(count))
    begun = sorted(order[:max(round(share * count), 1)])
    gaps = [after - before for before, after in pairwise([-1, *begun, count])]
    assert max(gaps) <= 2.62 * count / len(begun)


def test_sequential_stopping(tmp_path):
    """The 95 % interval of n values m + d, m - d, m + d, ...: see statistics/test_sequential."""
    agenda, asked = played(planned(tmp_path, UNTIL % "10 %"), 1, draw=draw)
    counts = [sum(number == vector for number, _ in asked) for vector in range(3)]
    assert counts[0] == 3  # enough at once
    assert 3 < counts[1] < 12
    assert counts[2] == 12  # never enough
    assert len(agenda.runs) == len(asked) == sum(counts)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(jobs=some.integers(1, 9), picks=some.lists(some.integers(0, 8), max_size=40),
       known=some.sets(some.integers(0, 20)))
def test_what_is_run_depends_neither_on_workers_nor_on_interruptions(tmp_path, jobs, picks, known):
    plan = planned(tmp_path, UNTIL % "10 %")
    alone, _ = played(plan, 1, draw=draw)
    expected = sorted(run_id for _, _, run_id in alone.runs)
    rows = {run_id: found for i, (run_id, found) in enumerate(alone.rows.items()) if i in known}
    some_workers, asked = played(plan, jobs, picks, draw=draw, rows=dict(rows))
    assert sorted(run_id for _, _, run_id in some_workers.runs) == expected
    assert len(asked) == len(expected) - len(rows)
    assert some_workers.progress == (len(expected), 0, len(expected))


def test_runs_without_a_value_are_not_waited_for_for_ever(tmp_path):
    agenda, asked = played(planned(tmp_path, UNTIL % "10 %"), 2, value=lambda row: None)
    assert len(asked) == 3 * 12


def test_a_run_that_two_vectors_ask_for_is_made_once(tmp_path):
    plan = planned(tmp_path, "parameters: {robots: {key: fleet.size, values: [1, 2]}}\n"
                             "iterations: 2\nvectors: {latin_hypercube: 4}\n")
    robots = [vector.robots for vector in plan.vectors]
    agenda, asked = played(plan, 3)
    assert asked == [(robots.index(n), iteration) for iteration in (0, 1)
                     for n in dict.fromkeys(spread(robots))]
    assert sorted(robots) == [1, 1, 2, 2]
    assert len(agenda.runs) == 8  # each vector has its row in the table
    assert agenda.progress == (4, 0, 4)


def test_vectors_that_stay_too_wide_are_reported(tmp_path):
    plan = planned(tmp_path, UNTIL % "10 %")
    agenda, asked = played(plan, jobs=2, draw=draw)
    assert [vector.number for vector in agenda.wide] == [2]
    assert asked.count((2, 11)) == 1
    assert not played(planned(tmp_path, ROBOTS), jobs=1)[0].wide


def test_only(tmp_path):
    plan = planned(tmp_path, ROBOTS + "iterations: 1\n")
    agenda = Agenda(plan, {}, ("robots=1", "robots=3"))
    assert [vector.number for vector, _, _ in agenda.runs] == [0, 2]


@pytest.mark.parametrize("width, expected", [
    ("10 %", (0.05, True)), (12.5, (6.25, False)), (3, (1.5, False))])
def test_the_width_of_an_interval_is_twice_what_stands_behind_plus_minus(width, expected):
    assert stopping_rule(Until(metric="explored", width=width))[:2] == expected
