"""Patience: move_base's three triggers, in turn, and what begins the recoveries anew."""

import math

import numpy as np
import pytest
from drawn import Drawn, costmap

from desim.robot.mapping.tiles import FREE
from desim.robot.navigation.local_costmap import LocalCostmap
from desim.robot.navigation.patience import MoveBasePatience, ProgressPatience, patience
from desim.robot.navigation.recovery import Recovery
from desim.scenario.schema.navigation import Navigation, NavigationConstants

S = 10**9


def move_base(**limits):
    made = MoveBasePatience(NavigationConstants(**limits))
    made.begin_goal(0, 0)
    return made


def first_over(made, blocked, place=lambda s: (0.0, 0.0)):
    """The first of 60 seconds at which it is over; each is noted first."""
    for second in range(60):
        made.note(second * S, *place(second), 10.0, blocked)
        if made.is_over(second * S):
            return second
    return None


def test_the_kind_is_the_named_one():
    assert isinstance(patience(Navigation()), ProgressPatience)
    assert isinstance(patience(Navigation(recovery="move_base")), MoveBasePatience)


@pytest.mark.parametrize("limit", [15, 5])
def test_it_ends_after_the_controllers_patience(limit):
    made = move_base(controller_patience=f"{limit} s")
    made.begin_path(0, 0.0, 0.0)
    assert first_over(made, blocked=True) == limit + 1  # longer than, as in move_base.cpp


def test_a_clear_velocity_keeps_it_up_for_ever_unless_it_may_not_oscillate():
    made = move_base()
    made.begin_path(0, 0.0, 0.0)
    assert first_over(made, blocked=False) is None
    made = move_base(oscillation_timeout="10 s")
    made.begin_path(0, 0.0, 0.0)
    assert first_over(made, blocked=False) == 11
    made = move_base(oscillation_timeout="10 s")
    made.begin_path(0, 0.0, 0.0)
    assert first_over(made, False, lambda second: (0.1 * second, 0.0)) is None


def test_it_ends_after_the_planners_patience():
    made = move_base()
    made.miss_path()
    assert not made.is_over(5 * S)
    assert made.is_over(5 * S + 1)


def progress(**limits):
    made = ProgressPatience(NavigationConstants(**limits))
    made.begin_goal(0, 0)
    made.begin_path(0, 0.0, 0.0)
    return made


def test_a_way_that_becomes_no_shorter_is_over_after_a_while():
    made = progress(stuck_after="5 s")
    made.note(0, 0.0, 0.0, 10.0, False)
    made.note(4 * S, 0.0, 0.0, 9.75, False)  # by more than a cell of the map
    assert not made.is_over(9 * S)
    made.note(8 * S, 0.0, 0.0, 9.625, False)  # by less
    assert not made.is_over(9 * S) and made.is_over(9 * S + 1)


def test_the_first_length_of_a_new_way_is_no_progress():
    made = progress(stuck_after="5 s")
    made.note(4 * S, 0.0, 0.0, 10.0, True)
    assert made.is_over(5 * S + 1)


@pytest.mark.parametrize("moved_m, more_s", [(0.25, 0), (0.375, 4)])
def test_a_new_way_gives_time_to_who_has_moved(moved_m, more_s):
    made = progress(stuck_after="5 s")
    made.begin_path(4 * S, moved_m, 0.0)
    assert not made.is_over((5 + more_s) * S) and made.is_over((5 + more_s) * S + 1)


def test_progress_on_a_new_way_counts_from_its_own_length():
    made = progress(stuck_after="5 s")
    made.note(0, 0.0, 0.0, 10.0, False)
    made.begin_path(S, 0.0, 0.0)
    made.note(S, 0.0, 0.0, 12.0, False)
    made.note(2 * S, 0.0, 0.0, 11.0, False)
    assert not made.is_over(7 * S) and made.is_over(7 * S + 1)


def test_a_recovery_gives_the_way_new_time():
    made = progress(stuck_after="5 s")
    made.note(0, 0.0, 0.0, 10.0, False)
    made.restart(4 * S)
    made.note(4 * S, 0.0, 0.0, 12.0, False)
    assert not made.is_over(9 * S) and made.is_over(9 * S + 1)


def test_a_goal_is_given_up_after_its_recoveries_and_the_next_one_has_all_again():
    made = progress(give_up_after=4)
    kinds = [made.next() for _ in range(5)]
    assert kinds == [Recovery.REPLAN, Recovery.ROTATE, Recovery.RETREAT, Recovery.REPLAN, None]
    made.begin_goal(9 * S, 0)
    assert made.next(Recovery.RETREAT) is Recovery.RETREAT  # the one that is wanted counts, too
    assert [made.next() for _ in range(4)] == [Recovery.ROTATE, Recovery.RETREAT, Recovery.REPLAN,
                                               None]


def test_recoveries_come_in_the_published_order_and_begin_again_when_one_helped():
    made = move_base()
    made.begin_path(0, 0.0, 0.0)
    made.note(0, 0.0, 0.0, 10.0, True)
    order = []
    for _ in range(5):
        assert made.is_over(16 * S)
        order.append(made.next())
    assert order == [Recovery.CONSERVATIVE_RESET, Recovery.ROTATE, Recovery.AGGRESSIVE_RESET,
                     Recovery.ROTATE, None]
    made.begin_path(17 * S, 0.0, 0.0)  # a path does not help against what blocks the control
    assert made.next() is None
    made.note(17 * S, 0.0, 0.0, 10.0, False)
    assert made.next() is Recovery.CONSERVATIVE_RESET


def test_a_recovery_gives_the_planner_new_time_and_not_the_control():
    made = move_base()
    made.miss_path()
    made.restart(5 * S)
    assert not made.is_over(10 * S)
    made.begin_path(10 * S, 0.0, 0.0)
    made.note(16 * S, 0.0, 0.0, 10.0, True)
    made.restart(16 * S)
    assert made.is_over(16 * S)


def test_a_reset_forgets_the_remembered_points_outside_of_its_square():
    layer = LocalCostmap(6.0, 0.1, 0.55, costmap(Drawn(np.full((9, 9), FREE, np.int16))))
    layer.scan[0]["x_m"], layer.scan[0]["y_m"] = 10.0, 20.0
    layer._memory[:4, :2] = (10.5, 20.0), (10.0, 20.6), (9.6, 19.6), (10.55, 20.0)
    layer.layer[0]["remembered"] = 4
    layer.forget(3.0)
    assert layer.layer[0]["remembered"] == 4
    layer.forget(1.04)
    assert layer._memory[:layer.layer[0]["remembered"], :2].tolist() == [[10.5, 20.0], [9.6, 19.6]]
    assert math.hypot(0.4, 0.4) > 0.52  # a square: this corner is farther away than its sides
