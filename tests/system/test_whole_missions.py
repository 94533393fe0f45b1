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


def cut(from_s, until_s):
    return (f"network.media.air.rules=[{{rule: loss, probability: 1, from: {from_s} s, "
            f"until: {until_s} s}}]")


@pytest.mark.parametrize("trouble", [
    cut(20, 200), "faults=[{at: 20 s, host: base, down_for: 40 s}]",
    "faults=[{at: 40 s, host: robot_0, down_for: 20 s}]"])
def test_a_search_that_is_cut_off_for_a_time_reports_all(trouble):
    """Robots carry home reports that nobody confirmed; a base that starts again hears all anew."""
    reason, summary = played("search", trouble)
    assert reason == "found" and summary["victims_reported"] == 5


def test_robots_that_hear_nobody_from_some_time_on_cover_the_rest():
    """Cells that were covered before the cut stay covered: it takes less time than alone."""
    reason, late = played("coverage", cut(40, 900))
    assert reason == "covered" and 182.5 < late["coverage_time_s"] < 300
    reason, one_less = played("coverage", "faults=[{at: 40 s, host: robot_0}]")
    assert reason == "covered" and one_less["coverage_time_s"] > 182.5


def test_a_formation_that_is_cut_off_for_a_time_closes_again():
    """Followers stand for 20 s, while the leader drives 10 m, and catch up."""
    simulation = built(SCENARIOS / "formation.yaml", cut(20, 40))
    simulation.graph.start()
    errors_m, ways_m = {}, {}
    for at_s in (20, 22, 40, 90):
        simulation.kernel.run(at_s * 10**9)
        errors_m[at_s] = simulation.monitor.task.measure()["formation_error_m"]
        ways_m[at_s] = simulation.world.travelled_m()[1:].sum()
    assert errors_m[20] < 1.0 < 5.0 < errors_m[40] and errors_m[90] < 0.5
    assert ways_m[40] == pytest.approx(ways_m[22], abs=0.01)


def test_pursuers_that_are_cut_off_hunt_alone():
    reason, summary = played("pursuit", cut(5, 300))
    assert reason == "caught" and summary["caught"] == 1
