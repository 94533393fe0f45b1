"""The predicted cost of a campaign, from its known runs."""

import pytest
from designs import planned, row

from desim.campaign.running import probes
from desim.campaign.running.agenda import Agenda
from desim.campaign.running.prediction import (
    Cost,
    Model,
    extrapolated_s,
    finished_costs,
    forecast,
)
from desim.campaign.running.probes import _start_s, probed

TEXT = """parameters:
  robots: {key: fleet.size, values: [1, 2, 4]}
  beams: {key: robot.laser.beams, values: [10, 20]}
stop: {elapsed: 100 s}
iterations: 2
"""
OVERHEAD_S = 0.015


@pytest.fixture
def plan(tmp_path):
    return planned(tmp_path, TEXT)


def test_a_vector_that_has_run_costs_what_it_cost(plan):
    model = Model(plan, {0: [Cost(1, 10, True), Cost(3, 30, True)]})
    assert model.expected_s(plan.vectors[0]) == pytest.approx(OVERHEAD_S + 2)
    assert model.longest_s(plan.vectors[0]) == pytest.approx(OVERHEAD_S + 10)


def test_fleets_in_between_and_beyond(plan):
    """1 robot costs 0.1 s and 2 robots 0.3 s a simulated second; 4 robots twice as much as 2."""
    model = Model(plan, {0: [Cost(1, 10, True)], 2: [Cost(6, 20, True)]})
    assert model.longest_s(plan.vectors[4]) == pytest.approx(OVERHEAD_S + 0.6 * 100)
    between = Model(plan, {0: [Cost(1, 10, True)], 4: [Cost(7, 10, True)]})
    assert between.longest_s(plan.vectors[2]) == pytest.approx(OVERHEAD_S + 0.3 * 100)


def test_what_did_not_end_is_expected_to_last_as_long_as_its_neighbours(plan):
    cut_off = {0: [Cost(1, 10, True)], 1: [Cost(2, 10, False)]}
    assert Model(plan, cut_off).expected_s(plan.vectors[1]) == pytest.approx(OVERHEAD_S + 2)
    assert Model(plan, {1: cut_off[1]}).expected_s(plan.vectors[1]) == pytest.approx(
        OVERHEAD_S + 20)  # nothing is known but the time limit


def test_how_much_a_run_has_explored_says_how_long_it_lasts(plan):
    """A fifth of what is wanted in 30 s: the rest, with its last corners, takes 1.3 times as long
    as in proportion. Before 20 s nothing can be told."""
    assert extrapolated_s(0.18, 30.0, 0.9) == pytest.approx(1.3 * 150)
    assert extrapolated_s(0.88, 30.0, 0.9) == pytest.approx(1.3 * 30 * 0.9 / 0.88)
    assert extrapolated_s(0.89, 30.0, 0.5) == 30.0, "it has lasted so long already"
    assert extrapolated_s(0.18, 19.0, 0.9) is extrapolated_s(0.01, 30.0, 0.9) is None
    assert extrapolated_s(0.02, 20.0, 0.9) == pytest.approx(1.3 * 900), "the earliest that tells"
    early = Cost(1, 10, False, 0, 50.0)
    assert Model(plan, {0: [early]}).expected_s(plan.vectors[0]) == pytest.approx(OVERHEAD_S + 5)
    ended = Cost(2, 20, True)
    assert Model(plan, {0: [early, ended]}).expected_s(plan.vectors[0]) == pytest.approx(
        OVERHEAD_S + 0.1 * 20)  # which is known better


def test_lengths_follow_the_fleet_and_do_not_grow_beyond_it(plan):
    """1 robot takes 80 s, 4 robots 20 s; for each simulated second 0.1 s of CPU."""
    between = Model(plan, {0: [Cost(8, 80, True)], 4: [Cost(2, 20, True)]})
    assert between.expected_s(plan.vectors[2]) == pytest.approx(OVERHEAD_S + 0.1 * 60)
    beyond = Model(plan, {0: [Cost(8, 80, True)], 2: [Cost(8, 40, True)]})
    assert beyond.expected_s(plan.vectors[4]) == pytest.approx(OVERHEAD_S + 0.4 * 40)


def test_a_dear_beginning_comes_once(plan):
    """8 of its 10 s of CPU were spent on the beginning; 10 simulated seconds cost 2."""
    model = Model(plan, {0: [Cost(10, 10, False, 8)]})
    assert model.expected_s(plan.vectors[0]) == pytest.approx(OVERHEAD_S + 8 + 20)
    assert model.expected_s(plan.vectors[1]) == pytest.approx(OVERHEAD_S + 8 + 20)
    assert _start_s(10, 10, [(5, 1), (10, 10)]) == pytest.approx(10 - 5 / 9 * 10)
    assert _start_s(10, 10, [(5, 5), (10, 10)]) == 0
    assert _start_s(10, 10, [(5, 0), (10, 0)]) == 0, "nothing has happened: nothing is known"


def test_a_forecast_counts_what_is_left(plan):
    runs = Agenda(plan, {}).runs
    rows = {run_id: {**row(run_id), "cost": {"cpu_s": 1, "simulated_s": 10}}
            for _, _, run_id in runs[:6]}
    agenda = Agenda(plan, rows)
    found = forecast(plan, agenda, finished_costs(agenda))
    assert found.expected_s == pytest.approx(6 * (OVERHEAD_S + 1))
    assert found.longest_s == pytest.approx(6 * (OVERHEAD_S + 10))


def test_at_most_counts_all_iterations_that_there_may_be(tmp_path):
    plan = planned(tmp_path, "iterations: {metric: explored, width: 1 %, at_most: 40}\n")
    agenda = Agenda(plan, {}, (), lambda row: row["metrics"]["explored"])
    found = forecast(plan, agenda, {0: [Cost(0.1, 0.1, True)]})
    assert found.expected_s == pytest.approx(5 * (OVERHEAD_S + 0.1))
    assert found.longest_s == pytest.approx(40 * (OVERHEAD_S + 0.1))


def test_probes_are_real_runs_and_leave_nothing(plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    plan = planned(tmp_path, TEXT.replace("100 s", "100 ms").replace("2, 4]", "2, 3]"))
    costs = probed(plan, Agenda(plan, {}))
    assert [plan.vectors[number].robots for number in costs] == [2]
    assert all(cost.ended and cost.simulated_s == 0.1 for own in costs.values() for cost in own)
    assert sorted(tmp_path.iterdir()) == before


def test_a_probe_that_takes_too_long_is_stopped(tmp_path):
    plan = planned(tmp_path, "stop: {elapsed: 100000 s, when: time_s > 90000}\n"
                             "set: {robot.passive: [robot_0, robot_1]}\n")
    (cost,), = probed(plan, Agenda(plan, {}), budget_s=0.2).values()
    assert not cost.ended and 0 < cost.simulated_s < 100_000
    assert 0 <= cost.start_s < cost.cpu_s


def test_a_probe_whose_half_was_not_marked_has_the_rate_of_all_of_it():
    assert _start_s(3.0, 40.0, [(1.0, 0.0), (2.0, 20.0), (4.0, 60.0)]) == 1.0
    assert _start_s(3.0, 40.0, [(1.0, 0.0), (4.0, 60.0)]) == 1.0
    assert _start_s(3.0, 40.0, [(1.0, 0.0), (4.0, 0.0)]) == 0.0


def test_a_probe_that_is_stopped_says_how_long_it_would_have_explored(tmp_path, monkeypatch):
    """Of robots that stand, and with another task, nothing is known."""
    seen = []
    monkeypatch.setattr(probes, "extrapolated_s", lambda *run: seen.append(run) or 123.0)
    text = "stop: {elapsed: 100000 s, explored: 98 %}\nset: {robot.passive: [robot_0, robot_1]"
    plan = planned(tmp_path, text + "}\n")
    (cost,), = probed(plan, Agenda(plan, {}), budget_s=0.2).values()
    assert cost.lasts_s == 123.0
    (explored, simulated_s, wanted), = seen
    assert (simulated_s, wanted) == (cost.simulated_s, 0.98) and 0 <= explored < 0.98


@pytest.mark.parametrize("iterations, most", [(1, 1), (3, 1), (5, 3), (10, 6)])
def test_probes_are_a_tenth_of_the_runs(tmp_path, monkeypatch, iterations, most):
    """A prediction that takes longer than what it predicts is none."""
    monkeypatch.setattr(probes, "_probe", lambda loaded, budget_s: Cost(1, 1, True))
    plan = planned(tmp_path, TEXT.replace("iterations: 2", f"iterations: {iterations}"))
    costs = probed(plan, Agenda(plan, {}))
    assert len(costs) <= most and len(costs) >= min(most, 2)
    assert most == 1 or max(plan.vectors[number].robots for number in costs) == 4
