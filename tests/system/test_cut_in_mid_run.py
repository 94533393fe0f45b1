"""Each local planner and each kind of localization goes on while the network carries nothing."""

import tomllib

import pytest
from runs import HELLO, built, finished

from desim.monitor.summary import summarize

FIELD = ("deployment=field", "stop.elapsed=300 s")
CUT = ("network.media.air={model: ideal, rules: [{rule: loss, probability: 1, from: 5 s, until: "
       "20 s}]}")
PLANNERS = ["dwb", "dynamic_window", "orca", "regulated_pure_pursuit"]
LOCALIZATION = ["gmapping", "ground_truth", "odometry", "pose_graph", "scan_matching"]


def played(*changes, air=CUT):
    simulation = built(HELLO, *FIELD, air, *changes)
    outcome = finished(simulation)
    return outcome.stop_reason, summarize(simulation.monitor, outcome.simulated_ns)


@pytest.mark.parametrize("name", PLANNERS)
def test_robots_whose_neighbours_are_not_heard_see_them(name):
    """They touch as often as those who hear: ``dwb``'s, which ask nobody, do in either case."""
    reason, summary = played(f"robot.navigation.local={name}")
    heard = played(f"robot.navigation.local={name}", air="network.media.air={model: ideal}")[1]
    assert reason == "explored" and summary["collisions"] == heard["collisions"]
    assert name == "dwb" or not heard["collisions"]


@pytest.mark.parametrize("name", LOCALIZATION)
def test_robots_know_where_they_are_without_their_team(name):
    reason, summary = played(f"robot.localization={name}", "robot.odometry.model=random_walk")
    assert reason == "explored"
    assert (summary["ate_m"] or 0.0) < 0.1


def test_all_are_tried_here(repository):
    points = tomllib.loads((repository / "pyproject.toml").read_text())["project"]["entry-points"]
    assert sorted(points["desim.local_planners"]) == PLANNERS
    assert sorted(points["desim.localization"]) == LOCALIZATION
