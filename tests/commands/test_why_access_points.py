"""``desim why`` under access points: queues, losses and waits have the access point's name."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from desim import api, ports
from desim.commands.views.message import show_story
from desim.commands.views.why import json_object, show
from desim.middleware.message_ledger import ROW, STAMP
from desim.network.passages import KnownMedium
from desim.results.association_waits import association_waits
from desim.results.run import Run
from desim.results.why import AssociationWait, MessageFate, MessagePart, Query, breakdown
from desim.results.why_causes import grouped

S = 10**9


class Known:
    """Handovers of a model of two access points."""

    def __init__(self, *handovers):
        self.handovers = handovers


def answer(run, **query):
    """The text and the JSON of ``desim why``."""
    found = breakdown(run.ledger, Query(**query))
    out = Console(file=StringIO(), width=100)
    show(found, {}, out)
    return out.file.getvalue(), json_object(found, {})


def fate(association, latency_s=10):
    return MessageFate(1, "/map", "a", "b", 100, 0, latency_s * S, None, None, (),
                       (MessagePart("retransmission", "a", latency_s * S),), None,
                       "receiver's queue", None, association)


# ------------------------------------------------------------------------- waits for associations


def test_the_wait_is_what_a_message_and_a_gap_have_in_common():
    """Host 1 hung on nothing from 2 s until 5 s and from 7 s until 8 s, on medium 0. Messages from
    1 to 0: before, through, within, behind, on another medium, lost above all media."""
    known = Known(ports.Handover(5 * S, 1, "ap_0", "ap_1", 3 * S),
                  ports.Handover(8 * S, 1, "ap_1", "ap_0", S))
    media = [KnownMedium("air", ("a", "b", "ap_0", "ap_1"), known),
             KnownMedium("lan", ("a", "b"), None)]
    spans = [(0, 1), (1, 9), (3, 4), (9, 10), (1, 9), (6, 9)]
    rows, stamps = np.zeros(len(spans), ROW), np.zeros(5, STAMP)
    rows["source"], rows["medium"] = 1, -1
    rows["born_ns"], rows["end_ns"] = (np.array(spans) * S).T
    stamps["medium"][4] = 1
    assert [column.to_pylist() for column in association_waits(
            rows, media, stamps, [1, 1, 1, 1, 1, 0])] == [
        [None, "b", "b", None, None, "b"], [None, "ap_1", "ap_1", None, None, "ap_0"],
        [None, 2 * S, 3 * S, None, None, 7 * S], [None, 5 * S, 4 * S, None, None, 8 * S]]


@pytest.mark.parametrize(("wait_s", "cause"), [
    (5, "b waited for association with ap_1"), (4, "retransmission, a")])
def test_a_wait_of_half_of_the_time_is_the_cause(wait_s, cause):
    (group,) = grouped([fate(AssociationWait("b", "ap_1", 0, wait_s * S))])
    assert group.cause == cause


@pytest.fixture(scope="module")
def joining(repository, tmp_path_factory):
    """Robots that have to find their access point first."""
    return api.run(repository / "scenarios" / "one_access_point.yaml",
                   out=tmp_path_factory.mktemp("joining"), overrides=(
        "stop.elapsed=6 s", "coordination.exchange.period=1 s", "fleet.size=2", "trace.ledger=true",
        "network.media.air.infrastructure.associated=false"))


def test_it_says_who_waited_for_whom_and_how_long(joining):
    """Of the first map a robot is associated when the scan is over; it comes a little later."""
    text, found = answer(joining, late=1)
    first = found["messages"][0]
    wait = AssociationWait(**first["association"])
    assert f"{wait.host} waited for association with ap_0; born at" in text
    assert (f"{wait.host} waited {wait.time_ns / S:.3f} s for association with ap_0, from "
            f"{first['born_ns'] / S:.6f} s until {wait.until_ns / S:.6f} s\n") in text
    assert 0 < first["end_ns"] - first["born_ns"] - wait.time_ns < 0.3 * S


def test_trace_says_so_too(joining):
    _, found = answer(joining, late=1)
    out = Console(file=StringIO(), width=200)
    show_story(Run(joining.path), found["messages"][0]["number"], out)
    assert " for association with ap_0, from " in out.file.getvalue()


def test_events_have_their_names(joining):
    rows = joining.table("events")
    said = {kind: {*rows["words"][rows["kind"] == kind]} for kind in (
        "associated", "disassociated")}
    assert said == {"associated": {"ap_0  medium/air  0"}, "disassociated": {"0  medium/air  0"}}


# ------------------------------------------------------------------------- queues of access points


def test_time_and_losses_in_its_queue_are_at_the_access_point(repository, tmp_path):
    """Maps of 3 robots at 1 Mb/s, each of which goes down to two others: CoDel drops packets."""
    run = api.run(repository / "scenarios" / "one_access_point.yaml", out=tmp_path, overrides=(
        "stop.elapsed=20 s", "coordination.exchange.period=1 s", "fleet.size=3",
        "coordination.exchange.encoding=raw", "trace.ledger=true",
        "network.media.air={model: radio, standard: 11b, rate: 1 Mb/s, access_points: [{at: [0 m, "
        "0 m]}]}"))
    text, found = answer(run, late=1000)
    causes = {row["cause"]: row for row in found["causes"]}
    assert {"CoDel at the access point, air at ap_0", "CoDel at the sender, air at robot_2"} <= {
        *causes}
    at_it = [row for row in found["messages"] if row["frames_lost"] is not None
             and row["frames_lost"].place == "air at ap_0"]
    assert all(row["born_ns"] < row["frames_lost"].from_ns <= row["end_ns"] for row in at_it)
    assert any(f"most for downlink_codel on air at ap_0, at {row['frames_lost'].from_ns / S:.6f} s"
               in text for row in at_it)
    waited_ns = sum(part["time_ns"] for row in found["messages"] for part in row["parts"]
                    if (part["part"], part["place"]) == ("queue", "air at ap_0"))
    assert waited_ns > S
