"""A base sends robots; they obey, and go on alone when it is silent."""

import numpy as np
import pytest
from benches import Team
from hypothesis import given
from hypothesis import strategies as st

from desim import ports
from desim.robot.coordination.strategies.centralized import Centralized, _greedy
from desim.testing import check_strategy


def central(robots, *points, **params):
    return Team(lambda: Centralized(Centralized.Params(**params)), {**robots, "base": None}, points)


def test_a_coordinator_keeps_its_contract():
    check_strategy(Centralized)
    check_strategy(Centralized, assignment="greedy", failsafe_after="0 s")


@pytest.mark.parametrize(("assignment", "sent"), [
    # Together 9 + 1 m, or 0 + 10 m: the shortest way first would leave the other the long one.
    ("hungarian", {"a": (-9.0, 0.0), "b": (6.0, 0.0)}),
    ("greedy", {"a": (6.0, 0.0), "b": (-9.0, 0.0)})])
def test_the_base_assigns_the_frontiers_of_its_map(assignment, sent):
    team = central({"a": (0, 0), "b": (14, 0)}, (-9, 0), (6, 0), assignment=assignment)
    assert (team.choose("a"), team.choose("b")) == (None, None)
    team.wait()
    assert team.goals() == sent
    assert [topic for _, topic, _ in team.sent] == ["report", "report", "tasks"]


@given(st.lists(st.lists(st.integers(0, 99), min_size=3, max_size=3), min_size=1, max_size=5))
def test_greedy_takes_the_cheapest_pair_of_those_left(rows):
    costs = np.array(rows, float)
    robots, places = _greedy(costs)
    assert len(set(robots)) == len(set(places)) == len(robots) == min(costs.shape)
    taken = costs[robots, places].tolist()
    assert taken == sorted(taken)
    assert taken[0] == costs.min()


def test_a_robot_that_has_done_its_task_gets_another_and_nobody_gets_the_old_one():
    team = central({"a": (0, 0), "b": (100, 0)}, (5, 0), (90, 0))
    team.wait()
    assert team.goals() == {"a": (5.0, 0.0), "b": (90.0, 0.0)}
    team.drive("a")
    team.know((5, 0), (90, 0), (20, 0))  # the base's map is late
    team.wait()
    assert team.goals() == {"a": (20.0, 0.0), "b": (90.0, 0.0)}
    team.drive("a", ports.GoalEnd.FAILED)
    team.wait(3)
    assert team.goals()["a"] is None  # it stands: what is left is avoided for a while, or b's
    team.know((90, 0), (20, 0))
    team.wait(27)
    assert team.goals()["a"] == (20.0, 0.0)


def test_a_robot_whose_task_is_explored_on_the_way_gets_the_frontier_ahead():
    """Not the robot behind it, although that one has nothing to do."""
    team = central({"front": (0, 0), "behind": (-20, 0)}, (10, 0))
    team.wait()
    assert team.goals() == {"front": (10.0, 0.0), "behind": None}
    team.know((25, 0))
    team.wait()
    assert team.goals() == {"front": (25.0, 0.0), "behind": None}


def test_a_robot_refuses_a_place_that_is_not_free_in_its_own_map(monkeypatch):
    team = central({"a": (0, 0)}, (5, 0), (30, 0))
    monkeypatch.setattr(team.benches["a"], "go", lambda place: False)
    team.wait(3)
    asked = [content["a"] for source, topic, content in team.sent
             if topic == "tasks" and "a" in content]
    assert asked[:2] == [[5.0, 0.0], [30.0, 0.0]]


def test_the_task_of_a_lost_robot_is_given_to_another():
    team = central({"a": (0, 0), "b": (50, 0)}, (5, 0))
    team.wait()
    assert team.goals() == {"a": (5.0, 0.0), "b": None}
    team.deaf.add("a")
    team.strategies["base"].on_teammate(team.benches["base"], "a", False)
    team.wait()
    assert team.goals()["b"] == (5.0, 0.0)


def test_without_a_word_of_the_base_a_robot_goes_on_alone_until_it_hears_it_again():
    team = central({"a": (0, 0), "b": (2, 0)}, (5, 0), (-30, 0))
    team.deaf.add("base")
    assert team.choose("a") is None
    team.wait(14)
    assert team.choose("a") is None
    team.wait()
    assert team.goals()["a"] == (5.0, 0.0)  # b is heard, but it is no base
    assert team.choose("a") == (5.0, 0.0)
    team.deaf.clear()
    team.wait(2)
    team.drive("a")
    assert team.choose("a") is None


def test_robots_go_on_alone_when_the_base_is_heard_but_has_tasks_for_nobody():
    """As when its map lacks what they have seen: messages arrive, and maps do not."""
    team = central({"a": (0, 0), "b": (40, 0)}, (5, 0), (38, 0))
    team.benches["base"].known = []
    assert team.choose("a") is None
    team.wait(14)
    assert team.goals() == {"a": None, "b": None}
    team.wait(2)
    assert team.goals() == {"a": (5.0, 0.0), "b": (38.0, 0.0)}
    team.know((60, 0))
    team.wait()  # the base has a map now
    assert team.goals() == {"a": (5.0, 0.0), "b": (60.0, 0.0)}
    team.drive("a")
    assert team.choose("a") is None  # and obeys again


def test_a_robot_waits_as_long_as_others_have_tasks():
    team = central({"a": (0, 0), "b": (-3, 0)}, (5, 0))
    team.wait(40)
    assert team.goals() == {"a": (5.0, 0.0), "b": None}
