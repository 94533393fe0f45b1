"""Robots stay where the team is connected, as far as they know."""

import math

import networkx
from benches import Team
from hypothesis import given
from hypothesis import strategies as st

from desim import ports
from desim.robot.coordination.strategies.connectivity import Connectivity, connected
from desim.testing import check_strategy

places = st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=1, max_size=8,
                  unique=True)


def team_of(robots, *points, **params):
    team = Team(lambda: Connectivity(Connectivity.Params(range="20 m", **params)), robots)
    team.wait(2)  # they know each other; then there are frontiers
    team.know(*points)
    return team


def test_connectivity_keeps_its_contract():
    check_strategy(Connectivity)
    check_strategy(Connectivity, range="2 m", failsafe_after="0 s")


@given(places, st.integers(1, 30))
def test_connected_is_what_networkx_says(at, range_m):
    graph = networkx.Graph()
    graph.add_nodes_from(at)
    graph.add_edges_from((one, other) for one in at for other in at
                         if math.dist(one, other) <= range_m)
    assert connected(at, float(range_m)) == networkx.is_connected(graph)


def test_a_frontier_out_of_reach_of_the_team_is_left_for_one_within():
    team = team_of({"a": (0, 0), "b": (10, 0)}, (-12, 0), (0, 15))
    assert team.choose("a") == (0.0, 15.0)  # 18 m from b; the other is 22 m off


def test_a_frontier_may_be_reached_over_others():
    team = team_of({"a": (0, 0), "b": (15, 0), "c": (34, 0)}, (-4, 0))
    assert team.choose("a") == (-4.0, 0.0)  # 19 m from b, 38 m from c
    without = team_of({"a": (0, 0), "c": (34, 0)}, (-4, 0))
    assert without.choose("a") != (-4.0, 0.0)


def test_a_robot_that_cannot_go_on_advances_as_far_as_the_team_holds():
    team = team_of({"a": (0, 0), "b": (1, 0)}, (40, 0))
    place = ports.Place(*team.choose("a"))
    assert 18 < math.dist(place, (1.0, 0.0)) <= 20
    assert place.x_m > 18


def test_a_robot_that_all_others_hang_on_holds():
    team = team_of({"a": (-19, 0), "b": (0, 0), "c": (19, 0)}, (0, 30))
    assert team.choose("b") is None


def test_places_are_known_through_others():
    team = team_of({"a": (0, 0), "b": (15, 0), "c": (34, 0)})
    team.benches["a"].deliver = lambda message: message.source == "c" or type(
        team.benches["a"]).deliver(team.benches["a"], message)  # c is out of reach
    team.benches["c"].pose = ports.Pose2D(30.0, 1.0, 0.0)
    team.wait(3)
    assert team.strategies["a"]._known["c"][1] == (30.0, 1.0)


def test_who_hears_nobody_drives_back_and_then_goes_on_alone():
    team = team_of({"a": (0, 0), "b": (10, 0)}, (0, 15), (-40, 0), failsafe_after="5 s")
    team.choose("a")
    team.deaf = {"a"}
    team.benches["a"].pose = ports.Pose2D(-9.0, 0.0, 0.0)
    team.know((-40, 0))
    team.wait(6)
    assert team.benches["a"].goal == (0.0, 0.0)  # there b was heard
    assert team.choose("a") is None
    team.drive("a")
    team.wait(5)
    assert team.benches["a"].goal == (-40.0, 0.0)
    assert team.choose("a") == (-40.0, 0.0)
