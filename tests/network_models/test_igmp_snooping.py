"""IGMP snooping without a querier: after 260 s multicast reaches nobody, and discovery fails."""

import math

import pytest

from desim.scenario.load import from_mapping
from desim.simulation.simulation import Simulation
from desim.testing import Bench
from netmodels.radio.radio import Radio

S = 10**9


def fates(times_s, restart_s=None, **infrastructure):
    """The fates of multicasts from ``base`` to ``a`` and ``b`` at these times; ``a`` may stop for a
    second at ``restart_s``."""
    model = Radio.build(Radio.Params(
        access_points=[{"at": ["0 m", "0 m"]}], infrastructure={
            "wired": ["base"], "multicast": "snooping", "constants": {"beacon_frame": None},
            **infrastructure}))
    bench = Bench(model, {"a": (5, 0), "b": (0, 5), "base": (math.nan, math.nan)})
    for time_s in times_s:
        bench.send(time_s * S, "base", ["a", "b"], 1046, label=time_s, broadcast=True)
    for at_s, up in () if restart_s is None else ((restart_s, False), (restart_s + 1, True)):
        bench.book(at_s * S, lambda up: bench.medium.switched(0, up), up)
    return {(label, to): fate for _, label, _, to, fate in bench.run((max(times_s) + 1) * S)}


def test_without_a_querier_memberships_end_after_260_s():
    """RFC 3376, 8.4: twice 125 s, and 10 s."""
    assert fates([1, 260, 261], querier=False) == {
        (1, "a"): "arrived", (1, "b"): "arrived", (260, "a"): "arrived", (260, "b"): "arrived",
        (261, "a"): "membership_ended", (261, "b"): "membership_ended"}


@pytest.mark.parametrize("twin", [
    {}, {"querier": False, "multicast": "flood"}, {"querier": False, "membership": "261 s"}])
def test_the_twins_with_one_or_without_snooping_hear_all(twin):
    assert {*fates([1, 260, 261], **twin).values()} == {"arrived"}


def test_who_starts_again_is_a_member_again():
    """And may join its access point, within 5 s, before the next multicast."""
    found = fates([270, 300], restart_s=280, querier=False)
    assert found == {(270, "a"): "membership_ended", (270, "b"): "membership_ended",
                     (300, "a"): "arrived", (300, "b"): "membership_ended"}


def heard_late(querier):
    """Messages between two robots that arrive after an outage, of 20 s and longer than a lease, at
    whose end memberships have ended (after 20 s instead of 260 s) unless there is a querier."""
    scenario = from_mapping({
        "name": "lost", "deployment": "field", "stop": {"elapsed": "90 s", "explored": "100 %"},
        "environment": {"terrain": {"size": ["40 m", "20 m"]}},
        "fleet": {"size": 2, "start": {"from": ["-3 m", "0 m"], "step": ["3 m", "0 m"]}},
        "task": {"model": "patrolling", "drawn": 4},
        "coordination": {"strategy": "expected_reactive", "exchange": {"period": "2 s"}},
        "middleware": {"model": "dds", "lease": "10 s"},
        "network": {"media": {"air": {
            "model": "radio", "access_points": [{"at": ["0 m", "0 m"]}],
            "infrastructure": {"multicast": "snooping", "querier": querier, "membership": "20 s"},
            "rules": [{"rule": "outage", "hosts": ["robot_1"], "from": "25 s",
                       "until": "45 s"}]}}}}).scenario
    arrived = []
    simulation = Simulation(scenario, on_fate=lambda message, receiver, time_ns, reason, *_: (
        reason is None and arrived.append(time_ns / S)))
    simulation.run()
    return sum(1 for time_s in arrived if time_s < 25), sum(1 for time_s in arrived if time_s > 60)


def test_discovery_does_not_recover_without_a_querier():
    """Their leases end in the outage, and announcements are multicasts."""
    before, after = heard_late(False)
    assert before > 10 and after == 0


def test_the_twin_with_a_querier_finds_each_other_again():
    before, after = heard_late(True)
    assert before > 10 and after > 10
