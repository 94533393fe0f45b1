"""Time and way towards places that a teammate has explored."""

from types import SimpleNamespace

import numpy as np
import pytest

from desim.engine.trace import bits
from desim.monitor.meters.meter import Second
from desim.monitor.meters.outdated_goals import OutdatedGoals
from desim.monitor.summary import summarize
from desim.ports import GridSpec
from desim.robot.mapping.tiles import CELLS, cell_numbers
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

S = 10**9
GRID = GridSpec(0.1, 64, 64, 0.0, 0.0)
KNOWN = -100  # log-odds: free


def goals(inside=1, union=0):
    """Two robots on four tiles, of which some robot has known all or nothing."""
    cells = [np.full((4, CELLS), value, np.uint8) for value in (inside, union)]
    return OutdatedGoals(GRID, SimpleNamespace(known_to_some=cells), ("a", "b"), ("a", "b"))


def heads_for(one, robot, x_m, y_m):
    one.listeners["goal"](robot, bits(x_m), bits(y_m), 0)


def map_of(log_odds=0):
    return SimpleNamespace(fused=np.full((4, CELLS), log_odds, np.int16))


def drive(one, seconds, m_per_s=(0.5, 0.0), own=0):
    one._maps |= {"a": map_of(own), "b": map_of()}  # as ``watch``, which ends a robot's goal
    for k in range(1, seconds + 1):
        one.each_second(Second(k * S, np.empty(0), k * np.array(m_per_s), None))
    return one.summary(seconds * S)


def test_a_goal_that_a_teammate_knows_counts_while_the_robot_moves():
    one = goals(union=1)
    heads_for(one, "a", 3.2, 3.2)
    heads_for(one, "b", 3.2, 3.2)
    assert drive(one, 4) == {"outdated_goal_s": 4.0, "outdated_goal_m": 2.0}
    assert one.by_host(4 * S) == {"a": {"outdated_goal_s": 4.0, "outdated_goal_m": 2.0},
                                  "b": {"outdated_goal_s": 0.0, "outdated_goal_m": 0.0}}
    one.listeners["goal_reached"]("a", 0, 0, 0)
    one.each_second(Second(9 * S, np.empty(0), np.array([9.0, 0.0]), None))
    assert one.summary(9 * S)["outdated_goal_m"] == 2.0


@pytest.mark.parametrize(("cells", "time_s"), [(10, 4.0), (11, 0.0)])
def test_cells_up_to_a_metre_away_are_near_a_goal(cells, time_s):
    """One cell of 0.1 m is to be explored, so many cells beside the goal."""
    one, numbers, (column, row) = goals(0, 1), cell_numbers(GRID), GRID.cell(3.2, 3.2)
    inside = one._coverage.known_to_some[0].reshape(-1)
    inside[numbers[GRID.width + row] + numbers[column - cells]] = 1
    heads_for(one, "a", 3.2, 3.2)
    assert drive(one, 4)["outdated_goal_s"] == time_s


@pytest.mark.parametrize("case", [
    {"union": 0}, {"union": 1, "inside": 0}, {"union": 1, "own": KNOWN}])
def test_a_goal_that_is_news_to_all_or_known_to_the_robot_does_not(case):
    own = case.pop("own", 0)
    one = goals(**case)
    heads_for(one, "a", 3.2, 3.2)
    assert drive(one, 4, own=own) == {"outdated_goal_s": 0.0, "outdated_goal_m": 0.0}


def test_one_cell_within_a_metre_that_nobody_knows_is_worth_the_way():
    for apart_m, counts in (0.9, 0.0), (1.2, 4.0):
        one = goals(union=1)
        heads_for(one, "a", 1.6, 1.6)
        _, union = one._coverage.known_to_some
        column, row = GRID.cell(1.6 + apart_m, 1.6)
        number = one._numbers[column] + one._numbers[GRID.width + row]
        union[number // CELLS, number % CELLS] = 0
        assert drive(one, 4)["outdated_goal_s"] == counts


def test_goals_at_the_edge_of_the_grid():
    one = goals(union=1)
    for x_m, y_m in (0.0, 0.0), (6.35, 6.35), (0.0, 6.35):
        heads_for(one, "a", x_m, y_m)
        assert len(one._cells["a"]) > 50


def test_it_grows_with_the_period_of_the_exchange(repository):
    def wasted_m(period):
        simulation = Simulation(load(repository / "scenarios" / "maze_8.yaml", [
            "stop.elapsed=40 s", f"coordination.exchange.period={period}"]).scenario)
        simulation.run()
        found = summarize(simulation.monitor, simulation.kernel.now_ns)
        robots = [robot["outdated_goal_m"] for robot in found["robots"].values()]
        assert sum(robots) == pytest.approx(found["outdated_goal_m"])
        assert found["outdated_goal_m"] <= found["exploration_cost_m"]
        return found["outdated_goal_m"]

    assert wasted_m("1 s") < wasted_m("20 s")
