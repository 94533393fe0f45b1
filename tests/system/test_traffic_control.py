"""Whole runs on granted cells: all arrive, nobody is hit, and without messages all stand."""

import numpy as np
import pytest
from runs import SCENARIOS, audited, built, call_often, finished

from desim.monitor.summary import summarize
from desim.robot.coordination.traffic.schedule import Schedule

TRAFFIC = SCENARIOS / "traffic_grid.yaml"
each = pytest.mark.parametrize("name", ["pibt", "prioritized"])


def played(name, *changes):
    simulation = built(TRAFFIC, f"coordination.strategy={name}", f"hosts.base.strategy={name}",
                       *changes)
    apart_m = []

    def measure():
        at_m = simulation.world.snapshot().poses[:, :2]
        apart = np.hypot(*(at_m[:, None] - at_m).transpose(2, 0, 1))
        apart_m.append((apart + 1e9 * np.eye(len(apart))).min())

    call_often(simulation, measure)
    outcome = finished(simulation)
    summary = summarize(simulation.monitor, outcome.simulated_ns)
    return outcome, summary, min(apart_m)


@each
def test_all_arrive_and_keep_apart(name):
    outcome, summary, apart_m = played(name)
    assert outcome.stop_reason == "arrived"
    assert (summary["goals_reached"], summary["collisions"]) == (16, 0)
    assert apart_m > 2 * 0.25


@each
def test_with_the_network_cut_all_stand_and_go_on_later(name):
    simulation = built(TRAFFIC, f"coordination.strategy={name}", f"hosts.base.strategy={name}",
                       "network.media.air.rules=[{rule: loss, probability: 1, from: 15 s, "
                       "until: 60 s}]")
    simulation.graph.start()
    ways_m = []
    for time_s in (40, 60):
        simulation.kernel.run(time_s * 10**9)
        ways_m.append(simulation.world.travelled_m().sum())
    assert ways_m[0] == pytest.approx(ways_m[1], abs=0.01)
    simulation.kernel.run(400 * 10**9)
    assert simulation.outcome().stop_reason == "arrived"
    audited(simulation)


def restarted(name, host, at_s):
    """Of a run in which a host is down for five seconds: how it ended, and the least distance of
    two robots' centres, in m."""
    outcome, summary, apart_m = played(name, f"faults=[{{at: {at_s} s, host: {host}, "
                                       "down_for: 5 s}]", "stop.elapsed=150 s")
    return outcome.stop_reason, summary["goals_reached"], apart_m > 2 * 0.25


@pytest.mark.parametrize("at_s", [1, 4, 10, 31])
@each
def test_a_host_that_starts_again_asks_where_all_stand_and_plans_on(name, at_s):
    assert restarted(name, "base", at_s) == ("arrived", 16, True)


@each
def test_a_robot_that_starts_again_goes_on_to_where_it_was_let(name):
    assert restarted(name, "robot_2", 10) == ("arrived", 16, True)


def test_a_host_that_does_not_ask_leaves_all_standing(monkeypatch):
    """The twin."""
    monkeypatch.setattr(Schedule, "resume", lambda *args: None)
    assert restarted("pibt", "base", 10)[:2] == ("elapsed", 0)
