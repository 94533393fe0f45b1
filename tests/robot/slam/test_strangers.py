"""Strangers: a path is laid through what was seen of it, and scans decide."""

import numpy as np
import pytest

from desim.robot.slam import strangers
from desim.robot.slam.closures import ScanMatcher
from desim.robot.slam.fleet_graph import Closure, FleetGraph
from desim.robot.slam.settings import SlamSettings
from desim.robot.slam.sightings import Sighting
from desim.robot.slam.strangers import Strangers
from desim.robot.transforms import compose, motion_between

FRAME = np.array((7.0, -3.0, 0.8))  # of the stranger, in the robot's coordinates


def met(bodies=6, stretched=1.0):
    """A robot that stands, and a stranger that drives a bent way and was seen ``bodies`` times;
    ``stretched``: what it says of its way is so many times as long."""
    known, said = Strangers(ScanMatcher(SlamSettings())), np.zeros(3)
    step = np.array((1.0, 0.1, 0.15))
    for k in range(bodies + 1):
        known.fleet.add("other", k, np.zeros(3) if k == 0 else step * (stretched, stretched, 1.0),
                        np.eye(3), None)
        if k > 0:
            said = compose(said, step)
        if k < bodies:
            seen = compose(FRAME, said)
            known.saw(k, np.zeros(3), [Sighting(seen[0], seen[1], 0.02, 0.02)])
    places = [(body, known.fleet.place("other", body.stamp_ns)) for body in known._bodies]
    return list(strangers._frames([one for one in places[::-1] if one[1] is not None]))


def test_two_sightings_lay_the_path_of_a_stranger():
    frames = met()
    assert len(frames) > 5
    for frame in frames:
        assert frame == pytest.approx(FRAME, abs=1e-9)


def test_but_not_the_path_of_another_one():
    assert met(stretched=1.3) == []


def test_two_sightings_alone_could_be_of_anybody():
    assert met(bodies=2) == []


def test_they_would_do_without_others_that_must_be_explained(monkeypatch):
    monkeypatch.setattr(strangers, "_LEAST_M", 0.5)
    monkeypatch.setattr(strangers, "_EXPLAINED", 2)
    assert len(met(bodies=2)) == 1


@pytest.mark.parametrize("turned", [False, True])
def test_a_closure_with_somebody_known_introduces_a_stranger(turned):
    """Both where the stranger has found the known one (``turned``), and the other way round."""
    known, fleet = Strangers(ScanMatcher(SlamSettings())), FleetGraph()
    for k in range(4):
        step = np.array((1.0, 0.0, 0.2)) if k else np.array((2.0, 5.0, 0.3))
        fleet.add("friend", k, step, np.eye(3), None)
        known.fleet.add("other", k, step if k else np.zeros(3), np.eye(3), None)
    friend, other = fleet.path("friend")[2], compose(FRAME, known.fleet.path("other")[3])
    if turned:
        name, tie = "other", Closure(3, "friend", 2, motion_between(friend, other), np.eye(3))
    else:
        name, tie = "friend", Closure(2, "other", 3, motion_between(other, friend), np.eye(3))
    (who, frame), = known.introduced(fleet, name, tie)
    assert who == "other" and frame == pytest.approx(FRAME, abs=1e-9)
    assert not known.fleet.tracks


def bodies_left(near_m):
    """The bodies that may be strangers, where a friend was ``near_m`` from one of them."""
    known, fleet = Strangers(ScanMatcher(SlamSettings())), FleetGraph()
    for name, at in (("robot", np.zeros(3)), ("friend", np.array((5.0, near_m, 0.0)))):
        for k in range(2):
            fleet.add(name, k, at if k == 0 else np.zeros(3), np.eye(3), None)
    known.saw(0, np.zeros(3), [Sighting(5.0, 0.0, 0.02, 0.02), Sighting(9.0, 0.0, 0.02, 0.02)])
    list(known.found(fleet, "robot", np.zeros(181)))
    return [body.x_m for body in known._bodies]


def test_a_friend_is_no_stranger():
    assert bodies_left(near_m=0.5) == [9.0]
    assert bodies_left(near_m=2.0) == [5.0, 9.0]


def introduced_by(bodies_of):
    """The strangers that four scans introduce; ``bodies_of``: those that each of two explains."""
    known, fleet = Strangers(ScanMatcher(SlamSettings())), FleetGraph()
    for k in range(2):
        fleet.add("robot", k, np.zeros(3), np.eye(3), None)
        for other in bodies_of:
            known.fleet.add(other, k, np.zeros(3), np.eye(3), None)
    known._closure = lambda source, path, ranges: (
        Closure(0, source, 0, np.zeros(3), np.eye(3)), bodies_of[source])
    return [closures[-1].source for _ in range(4)
            for closures in known.found(fleet, "robot", np.zeros(181))]


def test_a_body_that_two_could_have_been_introduces_neither():
    assert introduced_by({"one": {1, 2, 3}, "two": {4, 5, 6}}) == ["one", "two"]
    assert introduced_by({"one": {1, 2, 3}, "two": {3, 4, 5}}) == []
