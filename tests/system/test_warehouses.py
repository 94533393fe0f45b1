"""The large warehouses: all robots have a place to start, and the first seconds go by the books."""

import numpy as np
import pytest
from runs import SCENARIOS, built, finished


@pytest.mark.parametrize("name, robots", [("warehouse_300", 300), ("warehouse_1000", 1000)])
def test_the_fleet_starts_at_the_docks(name, robots):
    simulation = built(SCENARIOS / f"{name}.yaml")
    plan = simulation.scenario.environment.terrain.warehouse
    poses = simulation.world.snapshot().poses
    assert poses.shape == (robots, 3)
    assert (poses[:, 1] < plan.docks_m - plan.size_m[1] / 2).all()
    truth, reachable = simulation.world.ground(simulation.grid, range(robots))
    assert np.array_equal(reachable, truth == 0), "whatever is free is to be explored"


def test_three_hundred_robots_broadcast_what_changed():
    """Frames at each of 299 hearers, and messages, are conserved; only the air loses them, until
    the audit stops all hosts."""
    simulation = built(SCENARIOS / "warehouse_300.yaml", "stop.elapsed=1200 ms",
                       "coordination.exchange.period=1 s")
    outcome = finished(simulation)
    assert outcome.stop_reason == "elapsed"
    air, = simulation.graph.media
    assert air.delivered > 50_000
    assert set(air.dropped) <= {"collision", "channel_error", "out_of_reach", "host_down"}
