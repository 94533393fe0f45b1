"""The steps of a pose graph: their errors are as large as their information says."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from desim.robot.localization.kinds import pose_graph
from desim.robot.localization.kinds.pose_graph import GraphSlam
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

MAZE_8 = Path(__file__).parents[2] / "scenarios" / "maze_8.yaml"
START = ("environment.terrain=loop", "robot.odometry.model=random_walk", "stop.elapsed=12 s",
         "robot.localization={model: pose_graph, team: nothing}")


def squared_errors():
    """Of all steps of eight robots that begin beside each other in a corridor (Bar-Shalom, Li and
    Kirubarajan 2001, section 5.4): the normalized error squared. Some look at a bare wall at first,
    and find their place again."""
    simulation = Simulation(load(MAZE_8, START, 5).scenario)
    graphs, true, process = {}, {}, GraphSlam._process

    def beside_the_truth(slam, context, scan):
        robot = simulation.world.robots.index(context.name)
        true.setdefault(robot, []).append(np.array(simulation.world.snapshot().poses[robot]))
        graphs[robot] = slam._fleet.graph
        return process(slam, context, scan)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(GraphSlam, "_process", beside_the_truth)
        simulation.run()
    for robot, graph in graphs.items():
        graph.poses[:] = true[robot]
    return np.concatenate([graph.residuals() for graph in graphs.values()])


@cache
def mean_of_steps():
    return np.mean(squared_errors())


def test_steps_err_as_much_as_they_say():
    assert mean_of_steps() < 3.0  # three degrees of freedom


def test_but_not_where_a_place_found_again_counts_as_a_step(monkeypatch):
    monkeypatch.setattr(pose_graph, "on_motion", lambda one, other: one)
    assert np.mean(squared_errors()) > 10.0
