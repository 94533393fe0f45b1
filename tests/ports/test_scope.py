"""The scope of a rule: hosts, links, topics and times."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, ValidationError

from desim.errors import InputError
from desim.ports import Params, Targets, TimeWindow, Topics, scope_beside, with_scope
from desim.ports.scope import is_topic, matching

S = 10**9
HOSTS = ("robot_0", "base", "robot_1")


def window(**keys):
    """A window whose beginning is the keyword ``start``."""
    return TimeWindow(**{"from" if key == "start" else key: f"{value} s"
                         for key, value in keys.items()})


@given(start_s=st.integers(0, 20), length_s=st.integers(1, 5), pause_s=st.integers(1, 5),
       now_s=st.integers(0, 60), repeats=st.booleans())
def test_a_window_changes_when_it_says_so(start_s, length_s, pause_s, now_s, repeats):
    every = {"every": length_s + pause_s} if repeats else {}
    held_in = window(start=start_s, until=start_s + length_s, **every)
    phase_s = (now_s - start_s) % (length_s + pause_s) if repeats else now_s - start_s
    assert held_in.holds(now_s * S) == (now_s >= start_s and phase_s < length_s)
    change_ns = held_in.changes_ns(now_s * S)
    held = [held_in.holds(at_s * S) for at_s in range(now_s, now_s + 90)]
    first = next((i for i, now in enumerate(held) if now != held[0]), None)
    assert change_ns == (None if first is None else (now_s + first) * S)


def test_a_window_without_an_end_changes_once():
    late = window(start=3)
    assert not late.holds(3 * S - 1) and late.holds(3 * S) and late.holds(90 * S)
    assert late.changes_ns(0) == 3 * S
    assert late.changes_ns(3 * S) is None
    always = TimeWindow()
    assert always.holds(0) and always.changes_ns(0) is None


def test_a_window_holds_from_its_first_to_before_its_last_nanosecond():
    first = TimeWindow(**{"from": "1 ns", "until": "2 ns"})
    assert [first.holds(now_ns) for now_ns in range(4)] == [False, True, False, False]


@pytest.mark.parametrize("keys, bounded", [
    ({}, False), ({"start": 0}, False), ({"start": 1}, True), ({"until": 1}, True),
    ({"start": 1, "until": 2}, True)])
def test_a_window_is_bounded_by_either_end(keys, bounded):
    assert window(**keys).bounded == bounded
    assert not TimeWindow(**{"from": "0 ns"}).bounded and TimeWindow(**{"from": "1 ns"}).bounded


@pytest.mark.parametrize("keys, says", [
    ({"every": 5}, "what happens every so often needs until"),
    ({"start": 2, "until": 2}, "until must be later than from, got 2 s to 2 s"),
    ({"start": 2, "until": 5, "every": 3},
     "every must be longer than what lies between from and until, 3 s, got 3 s")])
def test_a_window_that_never_opens_or_never_closes_is_none(keys, says):
    with pytest.raises(ValidationError, match=re.escape(says)):
        window(**keys)


def test_a_window_may_open_and_close_for_the_least_time():
    assert window(start=2, until=5, every=4).holds(6 * S)
    assert TimeWindow(**{"from": "2 ns", "until": "3 ns"}).holds(2)


@pytest.mark.parametrize("topic, pattern, named", [
    ("/robot_0/scan", "scan", True), ("/robot_0/scan", "s?an", True),
    ("/robot_0/scan", "/robot_?/scan", True), ("/robot_0/scan", "/base/*", False),
    ("/robot_0/map/parts", "map/*", True), ("/robot_0/map/parts", "map*", True),
    ("/robot_0/map/parts", "parts", False), ("/robot_0/map/parts", "/*", True),
    ("/other/scan", "scan", False),  # no host
    ("/scan", "scan", False), ("/robot_0", "*", False)])
def test_a_pattern_without_a_slash_in_front_is_that_of_every_host(topic, pattern, named):
    assert is_topic(topic, pattern, HOSTS) == named


def test_a_pattern_without_a_host_names_the_nearest():
    assert matching("robot_*", HOSTS, "x") == [0, 2]
    with pytest.raises(InputError, match=r"^rules.0.hosts: 'bse' names no host \(did you mean "
                                         r"'base'\?\); hosts are robot_0, base$"):
        matching("bse", ("robot_0", "base"), "rules.0.hosts")


@pytest.mark.parametrize("hosts, links, found", [
    ([], [], ([], [])),
    (["robot_1", "robot_*"], [], ([0, 2], [])),
    ([], [("robot_1", "base"), ("base", "robot_1")], ([], [(1, 2)])),
    (["base"], [("robot_*", "robot_*"), ("base", "robot_0")], ([1], [(0, 1), (0, 2)]))])
def test_targets_are_the_indices_of_hosts_and_of_the_ends_of_links(hosts, links, found):
    targets = Targets(hosts=hosts, links=links)
    assert targets.resolved(HOSTS) == found
    assert targets.named == bool(hosts or links)


@pytest.mark.parametrize("keys, says", [
    ({"hosts": ["base", "bas"]}, ".hosts.1: 'bas' names no host (did you mean 'base'?); hosts are "
                                 "robot_0, base, robot_1"),
    ({"links": [("base", "rob")]}, ".links.0.1: 'rob' names no host (did you mean 'robot_1'?); "
                                   "hosts are robot_0, base, robot_1"),
    ({"links": [("base", "robot_0"), ("base", "b*")]},
     ".links.1: 'base' and 'b*' name one host only")])
def test_targets_that_nobody_is_are_said(keys, says):
    with pytest.raises(InputError, match=f"^{re.escape(says)}$"):
        Targets(**keys).resolved(HOSTS)


class Late(Params):
    """Own parameters of a rule, one of which is called as one of the scope."""

    start_ns: int = Field(0, alias="from")


class Plain(Params):
    """Own parameters of a rule."""

    share: float = 0.5


def test_a_rule_has_all_of_the_scope_but_what_it_has_itself():
    assert scope_beside(Plain) == [TimeWindow, Topics, Targets]
    assert scope_beside(Late) == [Topics, Targets]
    scoped = with_scope(Plain)
    assert scoped.__name__ == "Plain" and scoped.__doc__ == Plain.__doc__
    assert scoped(share=0.2, hosts=["base"]).named
