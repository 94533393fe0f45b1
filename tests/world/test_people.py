"""People in the world: they walk their ways, in nobody and in no wall."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.engine.streams import Streams
from desim.errors import InputError
from desim.scenario.schema.environment import People, Shape
from desim.world import sources
from desim.world.geometry import point_distance
from desim.world.people import RADIUS_M, WANTED_MPS, Crowd

DT_S = 1.0 / 60.0
NOBODY, OPEN = np.zeros((0, 3)), np.zeros((0, 4))
HALL = (("-8 m", "0 m"), ("8 m", "0 m"))
RING = (("-6 m", "-6 m"), ("6 m", "-6 m"), ("6 m", "6 m"), ("-6 m", "6 m"), ("-6 m", "-6 m"))


def crowd(*groups, size=("20 m", "20 m"), walls=(), robots=NOBODY, seed=1):
    terrain = sources.load(Shape(size=size, walls=walls))
    return Crowd(groups, terrain, robots, Streams(seed))


def walked(people, seconds, others=NOBODY, doors=OPEN):
    """The places after each tick."""
    found = []
    for _ in range(round(seconds / DT_S)):
        people.advance(DT_S, others, doors)
        found.append(people.discs[:, :2])
    return np.array(found)


def test_one_person_walks_there_and_back():
    people = crowd(People(count=1, path=HALL, width="0 m"))
    wanted_mps = float(people.walkers.wanted[0])
    places = walked(people, 60.0)
    speeds_mps = np.hypot(*np.diff(places[:, 0], axis=0).T) / DT_S
    assert np.median(speeds_mps) == pytest.approx(wanted_mps, rel=1e-3)
    assert np.abs(places[:, 0, 1]).max() < 1e-9
    assert places[:, 0, 0].min() == pytest.approx(-7.5, abs=0.5)
    assert places[:, 0, 0].max() == pytest.approx(7.5, abs=0.5)
    turns = int((np.diff(np.sign(np.diff(places[:, 0, 0]))) != 0).sum())
    assert turns == pytest.approx(60.0 * wanted_mps / 15.0, abs=1.5)


def test_wanted_speeds_are_the_papers():
    wanted_mps = crowd(People(count=300, path=HALL, width="14 m")).walkers.wanted
    assert wanted_mps.mean() == pytest.approx(WANTED_MPS, abs=3 * 0.26 / math.sqrt(300))
    assert wanted_mps.std() == pytest.approx(0.26, rel=0.15)


def test_a_ring_is_walked_round_and_round():
    people = crowd(People(count=3, path=RING, width="1 m"))
    places = walked(people, 60.0)
    angles = np.unwrap(np.arctan2(places[..., 1], places[..., 0]), axis=0)
    rounds = (angles[-1] - angles[0]) / math.tau
    assert (rounds > 0.8).all()  # counterclockwise, 48 m each


def test_acceleration_between_two_by_hand():
    """Two stand 1 m apart, one behind the other, and want to walk at 1 m/s. The ellipses of those
    that stand are circles: 2.1 / 0.3 exp(-1 / 0.3), half of it from behind."""
    people = crowd(People(count=2, path=HALL, width="0 m"))
    arrays = people.walkers
    arrays.places[:], arrays.velocities[:], arrays.wanted[:] = ((0, 0), (1, 0)), 0.0, 1.0
    arrays.target[:], arrays.step[:] = 1, 1
    walked(people, DT_S)
    push = 2.1 / 0.3 * math.exp(-1.0 / 0.3)
    wall = 10.0 / 0.2 * math.exp(-10.0 / 0.2)
    assert arrays.velocities[0, 0] == pytest.approx((1.0 / 0.5 - push) * DT_S, rel=1e-9)
    assert arrays.velocities[1, 0] == pytest.approx((1.0 / 0.5 + 0.5 * push) * DT_S, rel=1e-9)
    assert np.abs(arrays.velocities[:, 1]).max() <= wall


def test_acceleration_by_a_wall_by_hand():
    people = crowd(People(count=1, path=HALL, width="0 m"), walls=[
        {"from": ["-9 m", "0.4 m"], "to": ["9 m", "0.4 m"], "thickness": "0 m"}])
    arrays = people.walkers
    arrays.places[:], arrays.velocities[:] = 0.0, 0.0
    walked(people, DT_S)
    assert arrays.velocities[0, 1] == pytest.approx(-10.0 / 0.2 * math.exp(-0.4 / 0.2) * DT_S)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 60))
def test_nobody_walks_through_robots_walls_or_closed_doors(seed, gives_way, count):
    walls = [{"from": ["0 m", "-10 m"], "to": ["0 m", "-4 m"]},
             {"from": ["0 m", "4 m"], "to": ["0 m", "10 m"]}]
    robots = np.array([[6.0, 0.0, 0.4], [-3.0, 2.0, 0.4]])
    people = crowd(People(count=count, path=HALL, width="6 m", gives_way=gives_way), walls=walls,
                   robots=robots, seed=seed)
    inside = sources.load(Shape(size=("20 m", "20 m"), walls=walls)).walls
    door = np.array([[0.0, -4.0, 0.0, 4.0]])
    sides = np.sign(people.discs[:, 0])
    free = np.abs(people.discs[:, 0]) > RADIUS_M  # of those who start in the door nothing is said
    for places in walked(people, 10.0, robots, door)[::30]:
        own = places[free]
        assert (np.hypot(*(own[:, None] - robots[:, :2]).transpose(2, 0, 1))
                >= 0.4 + RADIUS_M - 1e-9).all()
        assert (np.sign(own[:, 0]) == sides[free]).all()
        assert (point_distance(own, inside) >= RADIUS_M - 1e-9).all()


def test_who_gives_way_walks_around_a_robot():
    robot = np.array([[0.0, 0.05, 0.4]])
    past = {}
    for gives_way in (True, False):
        people = crowd(People(count=1, path=HALL, width="0 m", gives_way=gives_way))
        people.walkers.places[:], people.walkers.target[:], people.walkers.step[:] = (-7, 0), 1, 1
        places = walked(people, 12.0, robot)[:, 0]
        past[gives_way] = places[:, 0].max() > 1.0
    assert past == {True: True, False: False}


@pytest.mark.parametrize("people, text", [
    ({"count": 1, "path": [["-8 m", "0 m"], ["12 m", "0 m"]]},
     "path: with a width of 2 m it crosses a wall or leaves the terrain, or comes closer to a wall "
     "than 0.25 m"),
    ({"count": 1, "path": [["0 m", "0 m"], ["0 m", "0 m"]]},
     "path: the same way point twice in a row"),
    ({"count": 200, "path": [["0 m", "0 m"], ["3 m", "0 m"]]},
     "count: no room for 200 people; "),
])
def test_ways_that_cannot_be(people, text):
    with pytest.raises(InputError) as caught:
        crowd(People(**people))
    assert str(caught.value).startswith(f"environment.people.0.{text}")
