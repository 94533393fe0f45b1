"""The list of events: late messages by episode, the first full queue, the rest in words."""

import numpy as np
import pytest

from desim.report.replay import events
from desim.report.replay.events import listed_events
from desim.report.replay.traffic import BornMessages
from desim.results.recording import Event
from desim.units import NS_PER_S

HOSTS = ["base", "robot_0", "robot_1"]


def messages(*rows):
    """Rows: born and end in s, reason (0 delivered, 1 queue_full, 2 collision)."""
    born, end, reason = np.array(rows, float).reshape(-1, 3).T
    nothing = np.zeros(len(born), int)
    return BornMessages(("/map",), ("/map",), np.zeros(1, int), np.zeros(1, int),
                        ("delivered", "queue_full", "collision"), nothing, nothing, nothing + 1,
                        nothing + 2, nothing + 100, (born * NS_PER_S).astype(int),
                        (born * NS_PER_S).astype(int), (end * NS_PER_S).astype(int),
                        reason.astype(int))


def listed(rows=(), table=None, partitions_s=()):
    found, note = listed_events(rows, messages() if table is None else table, HOSTS, partitions_s)
    assert note is None
    return [(one.time_ns / NS_PER_S, one.kind, one.text) for one in found]


def test_late_messages_are_one_event_until_there_is_a_pause():
    table = messages((0, 0.9, 0), (1, 2, 0), (2, 5, 0), (3, 14.9, 0), (4, 25, 0), (5, 99, 2))
    assert listed(table=table) == [
        (2.0, "late", "/map to robot_1 took 1.0 s, 2 more follow"),
        (25.0, "late", "/map to robot_1 took 21.0 s")]


def test_saturation_is_the_first_full_queue():
    table = messages((0, 0.1, 2), (0, 0.3, 1), (0, 0.2, 1))
    assert listed(table=table) == [(0.2, "saturation", "first message dropped for a full queue: "
                                    "queue_full, /map to robot_1")]


@pytest.mark.parametrize(("event", "words"), [
    (("collision", "robot_0", "robot_1  0  0"), "robot_0 hits robot_1"),
    (("collision", "robot_0", "0  0  0"), "robot_0 hits a wall"),
    (("recovery", "robot_1", "3  2  0"), "robot_1 backs off"),
    (("host_stopped", "base", "0  0  0"), "base stops"),
    (("host_started", "base", "0  0  0"), "base starts again"),
    (("out_of_memory", "robot_1", "slam  133000000  132000000"),
     "robot_1 runs out of memory: slam is killed, the rest dies with it"),
    (("associated", "robot_0", "ap_3  medium/air  0"), "robot_0 joins ap_3"),
    (("disassociated", "robot_0", "ap_3  medium/air  0"), "robot_0 leaves ap_3"),
    (("goal_aborted", "robot_0", "25  32.6  0"), "robot_0 gives up its goal"),
    (("visit", "robot_1", "3  61800000000  0"), "robot_1 visits place 3, alone for 61.8 s"),
    (("stop", "monitor", "0  0  0"), "the run ends"),
    (("map_redrawn", "robot_0", "57  0  0"), "robot_0 corrects its path, and draws its map anew"),
    (("joins_domain", "robot_0", "7  robot_1  0"), "robot_0 joins domain 7 robot_1")])
def test_words(event, words):
    kind, entity, detail = event
    assert listed([Event(NS_PER_S, kind, entity, detail)]) == [(1.0, kind, words)]


def test_what_happens_by_the_thousand_is_not_listed():
    rows = [Event(5, kind, "robot_0", "robot_1  online  0")
            for kind in ("sees", "believes", "advertises", "subscribes", "goal", "goal_reached",
                         "localized", "believed")]
    rows += [Event(0, "host_started", "base", "0  0  0"),
             Event(0, "associated", "robot_0", "ap_3  medium/air  0"),
             Event(0, "disassociated", "robot_1", "0  medium/air  0")]
    assert listed(rows) == []


def test_partitions_begin_and_end():
    assert listed(partitions_s=[[60.0, 180.5]]) == [
        (60.0, "partition", "the fleet is split for 120 s"),
        (180.5, "partition", "the fleet is whole again")]


def seconds(*missed):
    """The table of two robots, once a second: the ticks that robot_1 has missed until then."""
    count = len(missed)
    return {"time_s": np.repeat(np.arange(count, dtype=float), 2),
            "robot": np.array(["robot_0", "robot_1"] * count),
            "missed_ticks": np.stack([np.zeros(count, int), missed], axis=1).ravel()}


MISSED = [0, 0, 3, 3, 10, *[10] * 10, 12]


def listed_ticks(table):
    found, _ = listed_events([], messages(), HOSTS, [], table)
    return [(one.time_ns / NS_PER_S, one.text, one.subjects) for one in found]


def test_missed_ticks_are_one_event_until_there_is_a_pause():
    assert listed_ticks(seconds(*MISSED)) == [
        (2.0, "robot_1: busy nodes miss 10 ticks of their timers until 4 s", ("robot_1",)),
        (15.0, "robot_1: busy nodes miss 2 ticks of their timers until 15 s", ("robot_1",))]
    assert listed_ticks(seconds(0, 0, 0)) == []


def test_with_another_pause_the_episodes_are_others(monkeypatch):
    """The twin of the test above."""
    monkeypatch.setattr(events, "_APART_NS", 11 * NS_PER_S)
    assert len(listed_ticks(seconds(*MISSED))) == 1
