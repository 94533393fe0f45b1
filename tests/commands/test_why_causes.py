"""``desim why``: the causes of late and lost messages come first, equal ones together."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console
from runs import SCENARIOS

from desim import api
from desim.commands.views.why import json_object, show
from desim.middleware.message_ledger import ROW
from desim.network.passages import FrameLoss
from desim.ports import Obstacles
from desim.results.frames_lost import frames_lost
from desim.results.why import FramesLost, MessageFate, MessagePart, Query, breakdown
from desim.results.why_causes import grouped

S = 10**9


def fate(number, part, lost=None, reason=None, place="lan at a", born_s=1, after_s=2):
    return MessageFate(number, "/map", "a", "b", 100, born_s * S, (born_s + after_s) * S, reason,
                       place if reason else None, (), (MessagePart(part, place, after_s * S),),
                       None, "receiver's queue", lost)


def causes(*fates):
    return [(group.cause, [message.number for message in group.messages], group.from_ns,
             group.until_ns) for group in grouped(fates)]


@pytest.mark.parametrize("reason, cause", [
    ("out_of_range", "out of reach"), ("host_down", "host down"), ("outage", "outage"),
    ("partitioned", "partition"), ("retry_limit", "no acknowledgement"),
    ("queue_full", "full queue on the way"), ("random_loss", "frames lost (random_loss)")])
def test_retransmission_has_the_cause_of_the_frames_that_were_lost(reason, cause):
    lost = FramesLost(3, reason, 2 * S, 9 * S)
    assert causes(fate(1, "retransmission", lost)) == [(cause, [1], 2 * S, 9 * S)]


@pytest.mark.parametrize("part, cause", [
    ("queue", "queue, lan at a"), ("contention", "busy channel, lan at a"),
    ("sender's queue", "held back by the sender, lan at a"), ("airtime", "airtime, lan at a"),
    ("relay", "relay, lan at a"), ("retransmission", "retransmission, lan at a")])
def test_else_the_greatest_part_is_the_cause(part, cause):
    assert causes(fate(1, part)) == [(cause, [1], None, None)]


def test_what_waits_behind_a_cut_has_its_cause_and_one_lost_frame_is_none():
    cut, stray = FramesLost(3, "outage", S, 3 * S), FramesLost(1, "random_loss", S, S)
    assert causes(fate(1, "sender's queue", cut)) == [("outage", [1], S, 3 * S)]
    assert causes(fate(1, "sender's queue", stray)) == [
        ("held back by the sender, lan at a", [1], None, None)]
    assert causes(fate(1, "queue", reason="outbox_full", lost=cut)) == [
        ("full outbox, outage", [1], S, 3 * S)]
    assert causes(fate(1, "queue", reason="send_buffer_full", place="a")) == [
        ("full send buffer, a", [1], None, None)]


def test_equal_causes_go_together_unless_their_times_are_apart():
    one, other, later = (FramesLost(2, "outage", begin * S, (begin + 3) * S)
                         for begin in (1, 3, 10))
    assert causes(fate(1, "queue"), fate(2, "retransmission", later),
                  fate(3, "retransmission", other), fate(4, "retransmission", one)) == [
        ("outage", [3, 4], S, 6 * S), ("queue, lan at a", [1], None, None),
        ("outage", [2], 10 * S, 13 * S)]


def test_frames_between_the_hosts_count_from_birth_to_fate_either_way():
    rows = np.zeros(3, ROW)
    rows["source"], rows["destination"] = (0, 1, 0), (1, 2, 1)
    rows["born_ns"], rows["end_ns"] = (10, 10, 90), (50, 50, 99)
    losses = [FrameLoss(9, 0, 1, "outage", 0, 0), FrameLoss(10, 0, 1, "outage", 0, 0),
              FrameLoss(20, 0, 1, "random_loss", 0, 0, 1), FrameLoss(50, 1, 0, "outage", 0, 1, 2),
              FrameLoss(51, 0, 1, "outage", 0, 0), FrameLoss(30, 0, 2, "outage", 0, 0)]
    assert [column.to_pylist() for column in frames_lost(
            rows, losses, lambda medium, host: f"{medium} at {host}")] == [
        [2, None, None], ["outage", None, None], [10, None, None], [50, None, None],
        ["0 at 0", None, None], [1, None, None]]


OUTAGE = ("network.media={air: {model: switch, rate: 100 Mb/s, rules: [{rule: outage, "
          "hosts: [robot_1], from: 6 s, until: 14 s}]}}", "deployment=field")


def answer(repository, tmp_path, *overrides):
    """The text and the JSON of `desim why` for the maps of twenty seconds of hello."""
    run = api.run(repository / "scenarios" / "hello.yaml", out=tmp_path, overrides=(
        "stop.elapsed=20 s", "coordination.exchange.period=2 s", "trace.ledger=true", *overrides))
    found = breakdown(run.ledger, Query(topic="/map_exchange/*"))
    out = Console(file=StringIO(), width=100)
    show(found, {}, out)
    return out.file.getvalue(), json_object(found, {})


def test_an_outage_is_named_with_its_time_and_without_it_there_is_none(repository, tmp_path):
    text, found = answer(repository, tmp_path, *OUTAGE)
    assert text.startswith(
        "10 of 46 delivered messages that match, by cause\n"
        "       4  outage from 6.583 s until 13.056 s; born from 6.583 s until 7.986 s, delivered "
        "after 6.350 s to 13.129 s\n")
    assert found["causes"][0]["cause"] == "outage" and found["causes"][0]["messages"] == 4
    calm, _ = answer(repository, tmp_path, OUTAGE[0].replace("from: 6 s", "from: 19 s").replace(
        "until: 14 s", "until: 19.001 s"), OUTAGE[1])
    assert "outage" not in calm


def causes_in_a_crowd(tmp_path, *overrides):
    """The causes of the latest messages of five robots among forty people who keep their way."""
    run = api.run(SCENARIOS / "people.yaml", out=tmp_path, overrides=(
        "deployment=field", "network.media.air={model: radio, preset: indoor}", "stop.elapsed=13 s",
        "environment.people.0.gives_way=false", "trace.ledger=true",
        "fleet.start={from: [-16 m, 0 m], step: [8 m, 0 m]}", *overrides))
    return [group.cause for group in grouped(breakdown(run.ledger, Query()).messages)]


def test_people_on_the_line_are_named(tmp_path):
    assert "no acknowledgement, people between" in causes_in_a_crowd(tmp_path / "with")
    assert not any(cause.startswith("no acknowledgement") for cause in causes_in_a_crowd(
        tmp_path / "without", "network.media.air.people=false"))


def test_where_people_are_not_counted_they_are_not_named(tmp_path, monkeypatch):
    """The twin."""
    monkeypatch.setattr(Obstacles, "people_on", lambda self, pairs, heights_m: np.zeros(len(pairs)))
    assert "no acknowledgement" in causes_in_a_crowd(tmp_path)


@pytest.mark.parametrize("reason, people, cause", [
    ("retry_limit", 3, "no acknowledgement, people between"),
    ("retry_limit", 1, "no acknowledgement"),
    ("random_loss", 2, "frames lost (random_loss), people between")])
def test_people_are_a_cause_where_most_frames_were_lost_behind_them(reason, people, cause):
    lost = FramesLost(3, reason, 2 * S, 9 * S, "air at a", people)
    assert causes(fate(1, "retransmission", lost)) == [(cause, [1], 2 * S, 9 * S)]
    dropped = fate(1, "retransmission", lost, reason=reason)
    assert causes(dropped)[0][0].endswith("people between") == (2 * people > 3)
