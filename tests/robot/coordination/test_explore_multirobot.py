"""The published explore: its formula, its blacklist, its end."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim import ports
from desim.robot.coordination.strategies.explore_multirobot import ExploreMultirobot
from desim.testing import StrategyBench, check_strategy

CELL_M = 0.5  # of the bench


def explore(**params):
    return ExploreMultirobot(ExploreMultirobot.Params(**params))


def frontier(x_m, cells, path_m=None, y_m=0.0):
    return ports.Frontier(float(x_m), y_m, abs(float(x_m)) if path_m is None else path_m, cells)


def test_it_keeps_the_contract_of_strategies():
    check_strategy(ExploreMultirobot)
    check_strategy(ExploreMultirobot, done="until_news")


@given(st.floats(1, 60), st.floats(1, 60), st.integers(4, 200), st.integers(4, 200))
def test_at_the_published_scales_a_metre_of_way_costs_1_25_and_one_of_frontier_pays_1(
        near_m, far_m, cells, more):
    one, two = frontier(near_m, cells), frontier(-far_m, more)
    context = StrategyBench([one, two])
    context.grid = context.grid._replace(resolution_m=0.2)  # of the launch file
    costs = [1.25 * path_m - 0.2 * size for path_m, size in ((near_m, cells), (far_m, more))]
    big = [cost for cost, at in zip(costs, (one, two), strict=True) if at.cells * 0.2 >= 1.8]
    chosen = explore().choose(context)
    if not big:
        assert chosen is None
    elif len(big) == 1 or not math.isclose(*costs, abs_tol=1e-9):
        assert chosen == (one if costs[0] == min(big) else two)


def test_a_better_goal_replaces_the_present_one_when_the_map_changes():
    strategy, context = explore(), StrategyBench([frontier(10, 20)])
    assert context.go(strategy.choose(context))
    context.known.append(frontier(-12, 60))
    strategy.on_map(context)  # in the same instant: no more than once in a period
    context.now_ns += 1_000_000_000
    strategy.on_map(context)
    strategy.on_map(context)
    assert context.goals == [(10.0, 0.0), (-12.0, 0.0)]


def test_a_goal_that_is_obsolete_while_frontiers_are_known_costs_no_second_search():
    class Counting(StrategyBench):
        searches = 0

        def frontiers(self, *args):
            self.searches += 1
            return super().frontiers(*args)

    strategy, context = explore(), Counting([frontier(10, 20)])
    assert context.go(strategy.choose(context))
    context.now_ns += 1_000_000_000
    strategy.on_map(context)
    assert strategy.choose(context) == frontier(10, 20)
    assert context.searches == 2
    strategy.choose(context)  # that choice was refused
    context.now_ns += 1_000_000_000
    strategy.choose(context)
    assert context.searches == 4


def test_frontiers_of_an_earlier_instant_are_not_chosen_after_the_watch_has_searched():
    strategy, context = explore(), StrategyBench([frontier(10, 20)])
    strategy.on_start(context)
    context.go(strategy.choose(context))
    context.now_ns += 1_000_000_000
    strategy.on_map(context)
    context.known[:] = [frontier(-20, 20)]
    seconds(strategy, context, [0] * 5)  # the watch gives the goal up
    assert strategy.choose(context) == frontier(-20, 20)


def seconds(strategy, context, moves):
    for x_m in moves:
        context.now_ns += 1_000_000_000
        context.pose = ports.Pose2D(x_m, 0.0, 0.0)
        context.run_timers()


@pytest.mark.parametrize("moves, goal", [([0] * 4, 10), ([0] * 6, -20), ([0, 1, 2, 3, 4, 5], 10)])
def test_a_goal_without_progress_for_more_than_three_seconds_is_avoided_for_good(moves, goal):
    strategy, context = explore(), StrategyBench([frontier(10, 20), frontier(-20, 20)])
    strategy.on_start(context)
    context.go(strategy.choose(context))
    seconds(strategy, context, moves)
    assert context.goal == (goal, 0.0)
    assert strategy.choose(context) == frontier(goal, 20)


def test_a_failed_goal_is_avoided_within_two_cells_in_x_and_y():
    strategy = explore()
    strategy.on_goal(None, ports.Place(10.0, 0.0), ports.GoalEnd.FAILED)
    alike, beside = frontier(10 + 1.9 * CELL_M, 20), frontier(10, 20, 30.0, y_m=2 * CELL_M)
    assert strategy.choose(StrategyBench([alike, beside])) == beside


@pytest.mark.parametrize("done, then", [("for_good", None), ("until_news", frontier(9, 20))])
def test_without_a_goal_it_is_done_for_good(done, then):
    strategy = explore(done=done)
    assert strategy.choose(StrategyBench([frontier(3, 2)])) is None  # 1 m is too short
    assert strategy.choose(StrategyBench([frontier(9, 20)])) == then
