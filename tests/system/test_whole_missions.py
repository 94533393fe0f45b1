"""Whole runs of search, coverage, formation and pursuit, also where the network is cut."""

import pytest
from runs import SCENARIOS, built, finished

from desim.monitor.summary import summarize

CUT = "network.media.air.rules=[{rule: loss, probability: 1}]"


def played(name, *changes):
    simulation = built(SCENARIOS / f"{name}.yaml", *changes)
    outcome = finished(simulation)
    return outcome.stop_reason, summarize(simulation.monitor, outcome.simulated_ns)


def test_a_search_with_and_without_a_network():
    """Without one, victims are seen and nobody knows."""
    reason, summary = played("search")
    assert reason == "found" and summary["victims_reported"] == 5
    reason, summary = played("search", CUT, "stop.elapsed=200 s")
    assert reason == "elapsed" and summary["victims_seen"] >= 1
    assert summary["victims_reported"] == 0


def test_a_house_is_covered_with_and_without_a_network():
    """Without one, each robot covers everything: that takes longer, and all is passed thrice."""
    reason, together = played("coverage")
    assert reason == "covered"
    reason, alone = played("coverage", CUT)
    assert reason == "covered"
    assert alone["coverage_time_s"] > 1.5 * together["coverage_time_s"]
    assert alone["passes_mean"] > 1.5 * together["passes_mean"]


def test_a_formation_by_delay():
    """Poses that are 300 ms late still lead: a follower counts on the leader's velocity. Where
    none come, followers stand."""
    reason, summary = played("formation")
    assert reason == "arrived" and summary["in_formation"] > 0.7
    reason, late = played("formation", "network.media.air.rules=[{rule: latency, delay: 300 ms}]")
    assert reason == "arrived"
    assert late["formation_error_m"] > summary["formation_error_m"]
    reason, alone = played("formation", CUT)
    assert reason == "arrived" and alone["formation_error_worst_m"] > 20.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_four_catch_one(seed):
    reason, summary = played("pursuit", f"seed={seed}")
    assert reason == "caught" and summary["caught"] == 1
