"""``desim why``: what is printed of a breakdown, to the letter."""

from io import StringIO

import pytest
from rich.console import Console

from desim.commands.views.why import json_object, show, show_message
from desim.results.data_age import DataAge
from desim.results.latency_by_topic import Lost, TopicBreakdown
from desim.results.why import READ, LatencyBreakdown, MessageFate, MessagePart

MS, S = 10**6, 10**9


def fate(number, *parts_ms, born_s=1.0, waited_ns=None, **more):
    """A message of two parts, whose times are given, or one that was dropped after 4 ms."""
    parts = tuple(MessagePart(part, "lan at a", ms * MS)
                  for part, ms in zip(("queue", "airtime"), parts_ms, strict=False))
    born_ns = round(born_s * S)
    return MessageFate(number, "/map", "a", "b", 100, born_ns,
                       born_ns + (sum(parts_ms) or 4) * MS, more.get("reason"), more.get("place"),
                       more.get("before", ()), parts, waited_ns, READ)


ONE = fate(1, 30, 10, waited_ns=3 * MS, before=(
    MessagePart("node's queue", "a mapping", 2 * MS),
    MessagePart("computing", "a mapping", 5 * MS)))
TWO = fate(2, 60, 20, born_s=2.5)
GONE = fate(3, born_s=3, reason="outbox_full", place="a")


def found(*messages, delivered=0, dropped=0, times_ns=None, shown_ns=None, lost=(), topics=None,
          age=None):
    return LatencyBreakdown(messages, delivered, dropped, times_ns or {}, shown_ns or {}, lost,
                            topics or {}, age)


def printed(view, *what, width=60):
    out = Console(file=StringIO(), width=width)
    view(*what, out)
    return [line.rstrip() for line in out.file.getvalue().splitlines()]


WATERFALL = [
    "message 1, /map, a -> b, 100 B",
    "node's queue     a mapping                                 2.000 ms",
    "computing        a mapping                                 5.000 ms",
    "born at 1.000000 s, delivered after 40.000 ms",
    "queue            lan at a           ███████████████       30.000 ms  75.0 %",
    "airtime          lan at a                          █████  10.000 ms  25.0 %",
    "receiver's queue b                                         3.000 ms"]


def test_the_waterfall_of_a_message_is_of_its_latency_alone():
    assert printed(show_message, ONE) == WATERFALL


def test_a_message_that_was_not_read_and_one_that_was_dropped():
    assert printed(show_message, TWO)[1:] == [
        "born at 2.500000 s, delivered after 80.000 ms",
        "queue            lan at a           ███████████████       60.000 ms  75.0 %",
        "airtime          lan at a                          █████  20.000 ms  25.0 %",
        "receiver's queue b: never read by desim"]
    assert printed(show_message, GONE) == [
        "message 3, /map, a -> b, 100 B",
        "born at 3.000000 s, dropped (outbox_full at a) after 4.000 ms"]


@pytest.mark.parametrize(("columns", "bar"), [(40, 20), (78, 20), (79, 21), (118, 60), (300, 60)])
def test_bars_are_as_wide_as_the_terminal_lets_them_within_limits(columns, bar):
    queue = printed(show_message, TWO, width=columns)[2]
    assert len(queue) == 36 + bar + len("  60.000 ms  75.0 %")


def test_a_summary_and_the_waterfall_of_each_cause():
    topics = {
        "/map": TopicBreakdown(4, 160 * MS, {
            "rules": 5 * MS, "queue": 100 * MS, "airtime": 40 * MS, "propagation": 15 * MS},
            (Lost("outbox_full", "a", 2),)),
        "/scan_all": TopicBreakdown(0, 0, {}, (Lost("queue_full", "lan at a", 3),))}
    times_ns = {"node's queue": 8 * MS, "queue": 100 * MS, "airtime": 60 * MS, READ: 3 * MS}
    shown = found(ONE, TWO, delivered=4, dropped=5, times_ns=times_ns,
                  shown_ns={"queue": 90 * MS, "airtime": 30 * MS, READ: 3 * MS},
                  lost=(Lost("outbox_full", "a", 2), Lost("queue_full", "lan at a", 3)),
                  topics=topics, age=DataAge(4, 1, 50e6, 90 * MS,
                                             {"callback": 20e6, "sender": 30e6}))
    metrics = {"outdated_goal_m": 12.4, "exploration_cost_m": 300.2, "outdated_goal_s": 33.3}
    assert printed(show, shown, metrics) == [
        "2 of 4 delivered messages that match, by cause",
        "       2  queue, lan at a; born from 1.000 s until 2.500 s, delivered after 40.000 ms to "
        "80.000 ms",
        "all 4 delivered messages that match: mean of each part, its share, and its share in those "
        "above",
        "node's queue                                               2.000 ms",
        "queue            62.5 %             ████████████▌         25.000 ms  75.0 %",
        "airtime          37.5 %                         ████████  15.000 ms  25.0 %",
        "receiver's queue                                         750.000 us",
        "by topic: delivered, dropped, mean latency, and the shares of its parts",
        "/map             4       2  40.000 ms  queue 62.5 %, airtime 25.0 %, propagation 9.4 %",
        "/scan_all        0       3          -",
        "5 dropped messages that match",
        "       2  outbox_full      at a",
        "       3  queue_full       on lan at a",
        "since the reading on which they are based: 50.000 ms, mean of 4, 90.000 ms at most",
        "callback          20.000 ms  40.0 %",
        "sender            30.000 ms  60.0 %",
        "1 messages whose sender had read nothing of that topic",
        "12 of 300 m, in 33 s, robots drove towards places that a teammate had explored", "",
        *WATERFALL, "and 1 more: queue, lan at a"]
    answer = json_object(shown, metrics)
    assert answer["causes"] == [{
        "cause": "queue, lan at a", "messages": 2, "from_ns": None, "until_ns": None,
        "born_ns": (S, 5 * S // 2), "latency_ns": (40 * MS, 80 * MS)}]
    assert (answer["outdated_goal_s"], answer["outdated_goal_m"]) == (33.3, 12.4)
    first = answer["messages"][0]
    assert first["before"][1] == {"part": "computing", "place": "a mapping", "time_ns": 5 * MS}
    assert [part["time_ns"] for part in first["parts"]] == [30 * MS, 10 * MS]
    assert (answer["shares_ns"], answer["shares_of_messages_ns"]) == (
        shown.times_ns, shown.messages_times_ns)
    assert answer["lost"][0] == {"reason": "outbox_full", "place": "a", "messages": 2}
    assert list(answer["by_topic"]) == list(topics) and answer["age"]["blind"] == 1


def test_of_one_topic_there_is_no_line_and_of_dropped_messages_no_share():
    topics = {"/map": TopicBreakdown(4, 160 * MS, {}, ())}
    lost = (Lost("outbox_full", "a", 1),)
    assert printed(show, found(GONE, delivered=4, dropped=1, lost=lost, topics=topics), {}) == [
        "1 of 1 dropped messages that match, by cause",
        "       1  full outbox, a; born at 3.000 s, dropped after 4.000 ms",
        "1 dropped messages that match", "       1  outbox_full      at a", "",
        "message 3, /map, a -> b, 100 B",
        "born at 3.000000 s, dropped (outbox_full at a) after 4.000 ms"]
    assert json_object(found(GONE), {})["age"] is None


def test_a_model_that_gives_no_parts_is_pointed_at():
    assert printed(show, found(delivered=4, times_ns={"on the medium": 4 * MS}), {}) == [
        "none of 4 messages that match was dropped",
        "all 4 delivered messages that match: mean of each part, its share, and its share in those "
        "above",
        "on the medium    100.0 %            ████████████████████   1.000 ms       -",
        "on the medium: a network model does not give the parts of its time "
        "(docs/writing-plugins.md, Itemizes)"]


@pytest.mark.parametrize(("places", "last"), [(20, "      19  outbox_full      at r19"),
                                              (25, "     110  at other places")])
def test_twenty_places_of_losses_are_a_screen(places, last):
    lost = tuple(Lost("outbox_full", f"r{i}", i) for i in range(places))
    lines = printed(show, found(dropped=places, lost=lost), {})
    assert (len(lines), lines[-1]) == (1 + places if places <= 20 else 22, last)
    assert lines[1] == "       0  outbox_full      at r0"


def test_who_has_read_nothing_has_no_age():
    blind = DataAge(0, 4, 0.0, 0, {})
    assert printed(show, found(delivered=4, age=blind), {}) == [
        "none of 4 messages that match was dropped",
        "4 messages whose sender had read nothing of that topic"]
