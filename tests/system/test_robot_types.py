"""Fleets of several types of robots: each carries and runs its own."""

from pathlib import Path

import numpy as np
from runs import MAZE_8, outcome_of

from desim.scenario.load import from_mapping, load
from desim.scenario.resolved import resolved
from desim.scenario.robot_types import equipment_of, strategies_of
from desim.simulation.simulation import Simulation

TWO = {
    "name": "two", "environment": {"terrain": "maze"},
    "fleet": {"robots": [{"type": "scout", "count": 1}, {"type": "mapper", "count": 1}],
              "types": {"scout": {"radius": "0.2 m", "max_speed": "2 m/s", "strategy": "minpos",
                                  "robot": {"laser": {"max_range": "5 m", "rate": "10 Hz"},
                                            "odometry": {"rate": "20 Hz"}}},
                        "mapper": {"max_speed": "0.5 m/s"}}},
    "robot": {"laser": {"beams": 90}}, "stop": {"elapsed": "20 s"}}


def test_a_type_is_laid_over_the_fleet_key_by_key(tmp_path):
    scenario = from_mapping(TWO).scenario
    scout, mapper = equipment_of(scenario)
    assert (scout.scanner.max_range_m, scout.scanner.beams) == (5.0, 90)
    assert (mapper.scanner.max_range_m, mapper.scanner.beams) == (26.0, 90)
    assert [choice.strategy for choice in strategies_of(scenario)] == ["minpos",
                                                                      "nearest_frontier"]
    file = Path(tmp_path, "again.yaml")
    file.write_text(resolved(scenario, tmp_path))
    assert resolved(load(file).scenario, tmp_path) == file.read_text()


def test_each_type_has_its_own_sensors_at_their_own_rates():
    simulation = Simulation(from_mapping(TWO).scenario)
    simulation.run()
    simulation.graph.catch_up()
    published = {name: topic.counts.intended for name, topic in simulation.graph.topics.items()}
    assert [published[f"/robot_{i}/scan"] for i in (0, 1)] == [20 * 10 + 1, 20 * 25 + 1]
    assert [published[f"/robot_{i}/true_pose"] for i in (0, 1)] == [20 * 20 + 1, 20 * 10 + 1]
    snapshot, world = simulation.world.snapshot(), simulation.world
    far = [float(world.scan(snapshot, np.array([i]), 0).max()) for i in (0, 1)]
    assert far[0] <= 5.0 < far[1] <= 26.0


def test_a_type_that_says_what_the_fleet_says_is_the_fleet():
    types = "fleet.types={same: {robot: {laser: {beams: 180}}, strategy: nearest_frontier}}"
    alike = ("fleet.robots=same", types, "stop.elapsed=5 s")
    assert outcome_of(MAZE_8, *alike).digest == outcome_of(MAZE_8, "stop.elapsed=5 s").digest
