"""Whole runs with a ledger: they are the same as without, and each message's parts sum up."""

from functools import cache

import pytest
from ledgers import sums
from runs import MAZE_8, MAZE_30, SCENARIOS, built

from desim.middleware.message_ledger import MessageLedger
from desim.network import passages
from desim.network.passages import Passages

FIELD_30 = SCENARIOS / "field_30.yaml"
OFTEN = "coordination.exchange.period=1 s"
LAN = "network.media.lan"
LOSSY = ("rules: [{rule: loss, probability: 2 %}, {rule: reordering, probability: 5 %, "
         "delay: 20 ms}]")
CASES = {
    "testbed": (MAZE_30, "stop.elapsed=2 s"),
    "field": (FIELD_30, "stop.elapsed=3 s", OFTEN),
    "ros1": (MAZE_8, "stop.elapsed=6 s", "middleware.model=ros1",
             f"network.media={{lan: {{model: switch, rate: 12 Mb/s, buffer: 60 kB, {LOSSY}}}}}"),
    "dds": (MAZE_8, "stop.elapsed=6 s", "middleware={model: dds, preset: cyclonedds}",
            f"network.media={{lan: {{model: switch, rate: 20 Mb/s, {LOSSY}}}}}"),
    "multihop": (FIELD_30, "stop.elapsed=3 s", OFTEN, "network.fidelity=multihop"),
}
MORE = {
    "a port that loses some": (MAZE_8, "stop.elapsed=10 s", f"{LAN}.queue=fq_codel",
                               f"{LAN}.rate=7 Mb/s", f"{LAN}.buffer=20 kB"),
    "relays of Zenoh": (
        MAZE_8, "stop.elapsed=6 s", "middleware={model: zenoh, routers: [robot_3]}",
        f"network.media={{lan: {{model: switch, rate: 12 Mb/s, {LOSSY}}}}}"),
    "masters, and hosts that stop and start": (
        MAZE_8, "stop.elapsed=6 s", "middleware.model=multimaster",
        "faults=[{at: 3 s, host: robot_3, down_for: 700 ms}, {at: 4 s, host: robot_1}]"),
    "hosts that stop and start": (
        MAZE_8, "stop.elapsed=6 s", f"{LAN}.rate=20 Mb/s",
        "faults=[{at: 1003 ms, host: robot_3, down_for: 700 ms}, "
        "{at: 2400 ms, host: workstation, down_for: 10 ms}, {at: 3 s, host: robot_1}]"),
    "computers that get busy": (MAZE_8, "stop.elapsed=3 s", "computers=measured"),
    "a radio whose transmissions are judged": (
        MAZE_8, "stop.elapsed=15 s", "deployment=field",
        "network.media={lan: null, air: {model: radio, rules: [{rule: loss, probability: 10 %}]}}"),
}
MESSAGES = 1500  # at least, of the first cases


@cache
def played(case):
    """The ledger of a case, and the digest of its run."""
    ledger = MessageLedger(Passages())
    return ledger, built(*(CASES | MORE)[case], ledger=ledger).run().digest


@pytest.mark.parametrize("case", CASES | MORE)
def test_a_ledger_changes_nothing(case):
    assert played(case)[1] == built(*(CASES | MORE)[case]).run().digest


@pytest.mark.parametrize("case", CASES | MORE)
def test_the_parts_of_a_message_sum_up_to_its_latency(case):
    found = sums(played(case)[0])
    assert len(found.latency_ns) >= (MESSAGES if case in CASES else 100)
    assert (found.latency_ns == found.parts_ns).all()


def test_one_wrong_stamp_does_not_sum_up(monkeypatch):
    """The twin of the test above."""
    stamps = passages.Passage.stamps
    monkeypatch.setattr(passages.Passage, "stamps", lambda self, receiver: [
        stamp._replace(time_ns=stamp.time_ns + (number == 0))
        for number, stamp in enumerate(stamps(self, receiver))])
    ledger = MessageLedger(Passages())
    built(*MORE["a port that loses some"], ledger=ledger).run()
    found = sums(ledger)
    assert (found.latency_ns != found.parts_ns).mean() > 0.9
