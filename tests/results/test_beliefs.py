"""The rows of a run, folded into what its hosts believe of each other at an instant."""

from __future__ import annotations

import pytest
from believers import TOPICS, Two, of
from toy_middlewares import Late, Naive

from desim.errors import InputError
from desim.results.beliefs import BeliefSnapshot
from desim.results.beliefs import PairBelief as Pair


def test_before_anybody_heard_everything_is_missing():
    known = Two(Naive()).at(0.5)
    assert of(known, "robot_0", "robot_1") == Pair("robot_0", "robot_1", "never", (), TOPICS, ())
    assert (known.known, known.missing, known.ghosts, known.divergence) == (0, 4, 0, 1.0)
    # Who has to learn nothing has nothing missing.
    assert of(known, "robot_1", "robot_0") == Pair("robot_1", "robot_0", "never", (), (), ())


def test_rows_up_to_and_with_the_instant_count():
    known = Two(Naive()).at(1.0)
    assert of(known, "robot_0", "robot_1") == Pair("robot_0", "robot_1", "online", TOPICS, (), ())
    assert (known.known, known.missing, known.ghosts, known.divergence) == (4, 0, 0, 0.0)


@pytest.mark.parametrize(("middleware", "sees", "ghosts"), [(Naive, "online", TOPICS),
                                                            (Late, "offline", ())])
def test_a_stopped_host_is_a_ghost_to_whoever_has_not_noticed(middleware, sees, ghosts):
    known = Two(middleware()).at(10.0)
    assert known.up == {"robot_0": True, "robot_1": True, "robot_2": False}
    assert of(known, "robot_0", "robot_2") == Pair("robot_0", "robot_2", sees, (), (), ghosts)
    assert of(known, "robot_2", "robot_0").sees == "never"  # nothing is left of it
    assert known.divergence == len(ghosts) / (2 + len(ghosts))


def test_the_account_is_that_of_the_run():
    two = Two(Naive())
    beliefs, known = two.net.graph.context.beliefs, two.at(20.0)
    assert (known.known + known.missing, known.missing, known.ghosts, known.divergence) == (
        beliefs.matches, beliefs.missing, beliefs.ghosts, beliefs.divergence)


def test_one_topic():
    known = Two(Naive()).at(10.0)
    assert of(known.of("/news"), "robot_0", "robot_2").ghosts == ("/news",)
    with pytest.raises(InputError, match="'/new' then.*did you mean '/news'"):
        known.of("/new")


@pytest.mark.parametrize(("count", "end"), [(8, "/7"), (9, "/7, ...")])
def test_an_unknown_topic_is_refused_with_eight_of_those_known(count, end):
    view = Pair("a", "b", "online", tuple(f"/{i}" for i in range(count)), (), ())
    with pytest.raises(InputError, match=f"; topics: /0, /1, /2, /3, /4, /5, /6, {end}$"):
        BeliefSnapshot(0, "publisher", {"a": True, "b": True}, (view,)).of("/x")
