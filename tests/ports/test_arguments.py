"""Arguments of plug-ins: the least and the most that is allowed, and a clear error just beyond."""

import math
import re

import numpy as np
import pytest

from desim.errors import ModelError
from desim.ports import Frontier, Mark, Place, Pose2D, arguments
from desim.ports.sharing import Contribution

NAN, INF = math.nan, math.inf
HERE = Pose2D(1.0, 2.0, 3.0)


class Sized:
    def __init__(self, size_bytes):
        self.size_bytes = size_bytes


class Stubborn:
    """A callable object without a name."""

    def __call__(self, context):
        """Take what is given."""

    def __repr__(self):
        return "<stubborn>"


def two(context, message):
    """Be a callback of two arguments."""


def frontiers(count):
    return [Frontier(float(i), 0.0, 1.0, 3) for i in range(count)]


RIGHT = [
    (arguments.check_topic, "bid", 0), (arguments.check_topic, "b1/best_2/x", 5),
    (arguments.check_sources, None, ("a", "b")), (arguments.check_sources, ["b"], ("a", "b")),
    (arguments.check_callback, two, "context", "message"),
    (arguments.check_callback, Stubborn(), "context"),
    (arguments.check_callback, max, "context"),  # a built-in function does not say what it takes
    (arguments.check_period, 1_000_000),
    (arguments.check_work, "a", {"bytes": 0, "cells": 1}),
    (arguments.check_kept, "a", {"patches": 0}),
    (arguments.check_delay, 0, 9999), (arguments.check_timers, 9999),
    (arguments.check_advertised, "bid", ["bid"]), (arguments.check_new_topic, "bid", ["ask"]),
    (arguments.check_content, Sized(0)),
    (arguments.check_contribution, Contribution("a", 0, None, ()), ["a"]),
    (arguments.check_contribution, Contribution("a", 7, HERE, ()), ["a"]),
    (arguments.check_frame, "a", None, ["a"]), (arguments.check_frame, "a", HERE, ["a"]),
    (arguments.check_goal, (1, 2.0)), (arguments.check_goal, Frontier(1.0, 2.0, NAN, 1)),
    (arguments.check_limit, None), (arguments.check_limit, 1),
    (arguments.check_body, "a", True),
]


@pytest.mark.parametrize("check, arguments", [(check, given) for check, *given in RIGHT])
def test_what_is_allowed_passes(check, arguments):
    check(*arguments)


NO_TOPIC = "a topic is called as ROS names are, 'bid' or 'bid/best', not "
NO_QUEUE = "a queue is an int >= 0 of messages (0: no bound), not "
NO_PERIOD = "a timer's period is an int >= 1000000 of ns (1 ms), not "
NO_DELAY = "a timer's delay is an int >= 0 of ns, not "
NO_SIZE = "size_bytes of a content is an int >= 0, not "
TOO_MANY = ("10000 timers of this strategy wait on this host: do they set more than one new timer "
            "each?")
NO_POSE = "a Contribution's pose is a Pose2D of three finite numbers, or None, not "
NO_FRAME = "a frame lies at a Pose2D of three finite numbers, or None, not "
NO_GOAL = "a robot drives to a place of two finite numbers, not to "
NO_LIMIT = "a limit is an int >= 1 of frontiers, or None, not "
WORK = "known: bytes, scans, beams, particles, cells, candidates, plans"

WRONG = [
    (NO_TOPIC + "3", arguments.check_topic, 3, 1),
    (NO_TOPIC + "'/bid'", arguments.check_topic, "/bid", 1),
    (NO_TOPIC + "'bid/'", arguments.check_topic, "bid/", 1),
    (NO_TOPIC + "'größe'", arguments.check_topic, "größe", 1),
    (NO_QUEUE + "-1", arguments.check_topic, "bid", -1),
    (NO_QUEUE + "True", arguments.check_topic, "bid", True),
    ("sources are hosts of the team, not 'bose' (did you mean 'base'?); the team: a, base",
     arguments.check_sources, ["bose"], ("a", "base")),
    ("a callback is a function of (context, message), not 'f'",
     arguments.check_callback, "f", "context", "message"),
    ("a callback takes (context); two takes (context, message)",
     arguments.check_callback, two, "context"),
    ("a callback takes (context, message); <stubborn> takes (context)",
     arguments.check_callback, Stubborn(), "context", "message"),
    (NO_PERIOD + "999999", arguments.check_period, 999_999),
    (NO_PERIOD + "1000000000.0", arguments.check_period, 1e9),
    (f"a worked cell=1 (did you mean 'cells'?); {WORK}", arguments.check_work, "a", {"cell": 1}),
    ("a worked cells=-1; a quantity is an int >= 0", arguments.check_work, "a", {"cells": -1}),
    ("a worked cells=1.0; a quantity is an int >= 0", arguments.check_work, "a", {"cells": 1.0}),
    ("a keeps replies=1; known: bytes, cells, patches, scans",
     arguments.check_kept, "a", {"replies": 1}),
    (NO_DELAY + "-1", arguments.check_delay, -1, 0),
    (NO_DELAY + "1.0", arguments.check_delay, 1.0, 0),
    (TOO_MANY, arguments.check_delay, 0, 10_000),
    (TOO_MANY, arguments.check_timers, 10_000),
    ("topic 'bid' is published but not advertised; advertised: nothing",
     arguments.check_advertised, "bid", []),
    ("topic 'bid' is published but not advertised; advertised: 'ask', 'offer'",
     arguments.check_advertised, "bid", ["offer", "ask"]),
    ("topic 'bid' is advertised a second time", arguments.check_new_topic, "bid", ["bid"]),
    (NO_SIZE + "-1", arguments.check_content, Sized(-1)),
    (NO_SIZE + "None", arguments.check_content, Sized(None)),
    ("a content has size_bytes, an int >= 0; 'text' has none", arguments.check_content, "text"),
    ("a robot takes in Contributions, not ('a', 1, None, ())",
     arguments.check_contribution, ("a", 1, None, ()), ["a"]),
    ("a Contribution comes from a robot that maps are shared with, not from 'robot_3' (did you "
     "mean 'robot_2'?)",
     arguments.check_contribution, Contribution("robot_3", 1, None, ()), ["robot_2"]),
    ("a Contribution's version is an int, the clock of a in ns, not 1.0",
     arguments.check_contribution, Contribution("a", 1.0, None, ()), ["a"]),
    (NO_POSE + "(1.0, 2.0, 3.0)",
     arguments.check_contribution, Contribution("a", 1, (1.0, 2.0, 3.0), ()), ["a"]),
    ("frames are those of robots that maps are shared with, not of 'robot_3' (did you mean "
     "'robot_2'?)", arguments.check_frame, "robot_3", None, ["robot_2"]),
    (NO_FRAME + "(1.0, 2.0, 3.0)", arguments.check_frame, "a", (1.0, 2.0, 3.0), ["a"]),
    (NO_GOAL + "[1.0, 2.0]", arguments.check_goal, [1.0, 2.0]),
    (NO_GOAL + "(1.0,)", arguments.check_goal, (1.0,)),
    (NO_GOAL + "(1.0, inf)", arguments.check_goal, (1.0, INF)),
    (NO_GOAL + "('1', 2.0)", arguments.check_goal, ("1", 2.0)),
    (NO_LIMIT + "0", arguments.check_limit, 0),
    (NO_LIMIT + "1.0", arguments.check_limit, 1.0),
    ("base has no body that could drive", arguments.check_body, "base", False),
    ("a place is a pair of finite numbers, x and y in m, not (1.0, nan)",
     arguments.checked_place, (1.0, NAN)),
    ("a place is a pair of finite numbers, x and y in m, not (1.0,)",
     arguments.checked_place, (1.0,)),
    ("places are pairs of finite numbers, x and y in m, not [(inf, 0)]",
     arguments.checked_places, [(INF, 0)]),
    ("ways begin somewhere: this host has no pose yet", arguments.start_of_ways, None, None, True),
    ("ways begin somewhere: this host has no pose; give an origin",
     arguments.start_of_ways, None, None, False),
    ("a mark is two finite numbers and a text, not (1.0, 2.0)",
     arguments.checked_marks, [(1.0, 2.0)]),
    ("a mark is two finite numbers and a text, not (1.0, 2.0, 'a', 'b')",
     arguments.checked_marks, [(1.0, 2.0, "a", "b")]),
    ("a mark is two finite numbers and a text, not (1.0, nan, 'a')",
     arguments.checked_marks, [(1.0, NAN, "a")]),
    ("a mark is two finite numbers and a text, not (1.0, 2.0, 3)",
     arguments.checked_marks, [(1.0, 2.0, 3)]),
]


@pytest.mark.parametrize("says, check, arguments", [(says, check, a) for says, check, *a in WRONG],
                         ids=[says for says, *_ in WRONG])
def test_what_is_wrong_is_said(says, check, arguments):
    with pytest.raises(ModelError, match=f"^{re.escape(says)}$"):
        check(*arguments)


@pytest.mark.parametrize("pose, is_pose", [
    (HERE, True), (Pose2D(1, np.float32(2), np.float64(3)), True), ((1.0, 2.0, 3.0), False),
    (Pose2D(NAN, 0.0, 0.0), False), (Pose2D(0.0, INF, 0.0), False), (Pose2D(0.0, 0.0, NAN), False),
    (Pose2D(np.float32(NAN), 0.0, 0.0), False), (Pose2D("0", 0.0, 0.0), False)])
def test_a_pose_has_three_finite_numbers(pose, is_pose):
    assert arguments.is_pose(pose) == is_pose


def test_of_places_with_more_numbers_the_places_are_taken():
    assert arguments.checked_places([(1, 2, 9), np.array([3.0, 4.0])]) == [(1.0, 2.0), (3.0, 4.0)]
    assert arguments.checked_places([]) == []
    assert arguments.checked_place(Frontier(1.0, 2.0, 9.0, 4)) == (1.0, 2.0)
    assert arguments.checked_marks([(1.0, 2.0, "a")]) == [Mark(1.0, 2.0, "a")]


def test_ways_begin_at_the_origin_or_else_at_the_robot():
    assert arguments.start_of_ways((5.0, 6.0), HERE, True) == (5.0, 6.0)
    assert arguments.start_of_ways(None, HERE, True) == (1.0, 2.0)


@pytest.mark.parametrize("function, name", [
    (two, "two"), (arguments._check_quantities, "check_quantities"),
    (lambda context: None, "timer"), (Stubborn(), "timer")])
def test_a_timer_is_called_as_its_function_is(function, name):
    assert arguments.name_of(function) == name


def east(x_m, y_m):
    return x_m >= 0


@pytest.mark.parametrize("chosen", [None, frontiers(2)[1], Place(0.0, 1.0)])
def test_a_strategy_may_choose(chosen):
    arguments.check_choice(two, chosen, frontiers(2), east)


@pytest.mark.parametrize("chosen, what", [
    (frontiers(3)[2], "Frontier(x_m=2.0, y_m=0.0, path_m=1.0, cells=3)"),  # was not shown
    (Place(-1.0, 1.0), "Place(x_m=-1.0, y_m=1.0)"), (Place(NAN, 1.0), "Place(x_m=nan, y_m=1.0)"),
    ((0.0, 1.0), "(0.0, 1.0)"), (tuple(frontiers(1)[0]), "(0.0, 0.0, 1.0, 3)"),
    (frontiers(2), "a list of 2")])
def test_a_strategy_may_not_choose(chosen, what):
    with pytest.raises(ModelError, match=f" chose {re.escape(what)}; wanted: one of frontiers\\(\\)"
                                         ", a Place on the robot's map, or None$"):
        arguments.check_choice(two, chosen, frontiers(2), east)
