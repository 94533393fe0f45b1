"""Strategies choose as their papers say: small fleets where the answer is known."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim import ports
from desim.robot.coordination.strategies.connectivity import Connectivity
from desim.robot.coordination.strategies.explore_multirobot import ExploreMultirobot
from desim.robot.coordination.strategies.greedy_assignment import GreedyAssignment
from desim.robot.coordination.strategies.hungarian import Hungarian
from desim.robot.coordination.strategies.minpos import MinPos
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier
from desim.robot.coordination.strategies.next_best_view import NextBestView
from desim.robot.coordination.strategies.voronoi import Voronoi
from desim.testing import StrategyBench, check_strategy

ALL = (GreedyAssignment, Hungarian, MinPos, NearestFrontier, NextBestView, Voronoi)

places = st.tuples(st.integers(-40, 40), st.integers(-40, 40))


def frontiers_at(own, *points, cells=10):
    """Frontiers in the order of the way, which is straight."""
    return sorted((ports.Frontier(float(x), float(y), math.dist(own, (x, y)), cells)
                   for x, y in points), key=lambda one: one.path_m)


def bench(own, others, points, **options):
    """A robot at ``own``, teammates at ``others``, frontiers at ``points``."""
    made = StrategyBench(frontiers_at(own, *points, **options))
    made.pose = ports.Pose2D(*map(float, own), 0.0)
    made.peers = {f"robot_{k}": ports.Peer(*map(float, other), 0.0, 0)
                  for k, other in enumerate(others, 2)}
    return made


def chosen(cls, context):
    frontier = cls(cls.Params()).choose(context)
    return None if frontier is None else frontier[:2]


@pytest.mark.parametrize("cls", ALL)
def test_every_strategy_keeps_its_contract(cls):
    check_strategy(cls)


@pytest.mark.parametrize("cls", ALL)
@given(own=places, points=st.lists(places, min_size=1, max_size=6, unique=True))
def test_alone_on_a_plain_every_strategy_but_the_best_view_takes_the_nearest(cls, own, points):
    context = bench(own, [], points)
    nearest = context.known[0].path_m
    found = next(one for one in context.known if one[:2] == chosen(cls, context))
    assert cls is NextBestView or found.path_m == pytest.approx(nearest)


class MeetsTheFarther(StrategyBench):
    """Its search meets first what is last in the order of ``path_m``."""

    def frontiers(self, limit=None, origin=None):
        found = super().frontiers(None, origin)
        return found if limit is None else found[-limit:]


def test_without_teammates_most_take_the_smallest_path_m_and_one_what_the_search_meets():
    """See ``StrategyContext.frontiers``: these are not always the same."""
    context = MeetsTheFarther(frontiers_at((0, 0), (10, 0), (0, 11)))
    context.peers = {}
    for cls in (GreedyAssignment, Hungarian, MinPos, Voronoi):
        assert chosen(cls, context) == (10.0, 0.0)
    assert chosen(NearestFrontier, context) == (0.0, 11.0)


@pytest.mark.parametrize("cls, kind, texts", [
    (ExploreMultirobot, "cost", ["cost 3.0 m: way 5.0 m, gain 2.0 m",
                                 "cost 8.0 m: way 10.0 m, gain 2.0 m"]),
    (Connectivity, "way", ["way 10 m", "way 20 m"]),
    (GreedyAssignment, "value", ["value 15 m: way 10 m", "value 5 m: way 20 m"]),
    (MinPos, "rank", ["rank 0, way 10 m", "rank 1, way 20 m"]),
    (NearestFrontier, "way", ["way 10 m"]),
    (NextBestView, "utility", ["utility 0.5 m2: gain 4.0 m2, way 10 m",
                               "utility 0.1 m2: gain 4.0 m2, way 20 m"]),
    (Voronoi, "way", ["way 10 m", "way 20 m, outside by 14 m"]),
])
def test_what_a_choice_goes_by_is_shown_beside_the_frontiers(cls, kind, texts):
    context = bench((0, 0), [(16, -18)], [(10, 0), (16, -12)], cells=4)
    chosen(cls, context)
    assert [mark.text for mark in context.shown[kind]] == texts
    assert [mark[:2] for mark in context.shown[kind]] == [
        one[:2] for one in context.known][:len(texts)]


def test_minpos_leaves_a_frontier_to_teammates_that_are_nearer():
    # Two teammates are nearer to the near frontier, nobody is to the far one.
    context = bench((0, 0), [(9, 0), (11, 0)], [(10, 0), (0, 30)])
    assert chosen(MinPos, context) == (0.0, 30.0)
    assert chosen(NearestFrontier, context) == (10.0, 0.0)


def test_minpos_spreads_robots_that_stand_together():
    # Bautin et al. 2012, figure 1: four robots side by side, two branches.
    robots = [(0, 0), (1, 0), (2, 0), (3, 0)]
    branches = [(-20, 0), (20, 0)]
    sides = [chosen(MinPos, bench(own, [other for other in robots if other != own], branches))
             for own in robots]
    assert sides == [(-20.0, 0.0), (-20.0, 0.0), (20.0, 0.0), (20.0, 0.0)]


def test_a_teammates_goal_makes_frontiers_beside_it_less_useful():
    context = bench((0, 0), [(30, 30)], [(10, 0), (-14, 0)])
    assert chosen(GreedyAssignment, context) == (10.0, 0.0)
    context.peers = {"robot_2": context.peers["robot_2"]._replace(goal=ports.Place(12.0, 0.0))}
    assert chosen(GreedyAssignment, context) == (-14.0, 0.0)


@given(st.lists(places, min_size=2, max_size=4, unique=True),
       st.lists(places, min_size=4, max_size=5, unique=True))
def test_the_hungarian_assignment_is_the_cheapest_of_all(robots, points):
    picks = [chosen(Hungarian, bench(own, robots[:k] + robots[k + 1:], points))
             for k, own in enumerate(robots)]
    together = sum(math.dist(own, pick) for own, pick in zip(robots, picks, strict=True))
    cheapest = min(sum(math.dist(own, pick) for own, pick in zip(robots, order, strict=False))
                   for order in itertools.permutations(points, len(robots)))
    if len(set(picks)) == len(robots):  # equal sums may be had in several ways
        assert together == pytest.approx(cheapest)


@given(st.lists(places, min_size=2, max_size=5, unique=True),
       st.lists(places, min_size=1, max_size=6, unique=True))
def test_no_two_robots_have_a_frontier_in_both_their_voronoi_cells(robots, points):
    inside = np.array([[math.dist(point, own) < min(
        math.dist(point, other) for other in robots if other != own) for point in points]
        for own in robots])
    assert (inside.sum(axis=0) <= 1).all()
    for own, cell in zip(robots, inside, strict=True):
        pick = chosen(Voronoi, bench(own, [other for other in robots if other != own], points))
        if cell.any():
            assert cell[points.index((int(pick[0]), int(pick[1])))]


def test_the_best_view_goes_farther_for_more():
    context = bench((0, 0), [], [(5, 0)], cells=10)
    context.known.append(ports.Frontier(0.0, 8.0, 8.0, 30))  # e^0.6 = 1.8 < 3 times the area
    assert chosen(NextBestView, context) == (0.0, 8.0)
    context.known[-1] = ports.Frontier(0.0, 8.0, 8.0, 15)  # 1.5 times the area
    assert chosen(NextBestView, context) == (5.0, 0.0)
