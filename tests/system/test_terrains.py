"""All four terrains are explored by fleets of any size, and nobody is ever inside anything."""

import numpy as np
import pytest
from collisions import Ticks, clearance_m
from runs import MAZE_30, built, finished

ALLOWED_M = 0.01

# Each terrain, and each size of a fleet; `make validate` plays the other pairs. The ten roads of
# zigzag are explored one after the other; thirty robots do three of them, which takes a quarter of
# the time to compute.
CASES = [("maze", 30, 0.99), ("zigzag", 1, 0.99), ("cross", 4, 0.99), ("loop", 1, 0.99), *(
    pytest.param(*case, marks=pytest.mark.validation) for case in (
        ("zigzag", 30, 0.3), ("zigzag", 8, 0.99), ("maze", 4, 0.99), ("maze", 1, 0.99),
        ("cross", 30, 0.99), ("cross", 1, 0.99), ("loop", 30, 0.99), ("loop", 4, 0.99)))]


@pytest.mark.parametrize("terrain, size, share", CASES)
def test_terrain_is_explored_in_time_and_nobody_is_in_a_wall(terrain, size, share):
    simulation = built(MAZE_30, f"environment.terrain={terrain}", f"fleet.size={size}",
                       f"stop.explored={share:.0%}")
    ticks = Ticks(simulation)
    outcome = finished(simulation)
    assert outcome.stop_reason == "explored"
    assert outcome.simulated_ns < 2000 * 10**9
    assert len(ticks) >= outcome.simulated_ns * 60 // 10**9
    deepest = ticks.deepest()
    assert deepest.wall_m <= ALLOWED_M
    assert deepest.body_m <= ALLOWED_M


def test_a_body_in_a_wall_is_seen():
    walls = np.array([[0.0, 0.0, 4.0, 0.0], [2.0, 5.0, 2.0, 9.0]])
    solids, bounds = np.array([[6.0, 6.0, 8.0, 8.0]]), (-1.0, -1.0, 10.0, 10.0)

    def near(*points):
        return clearance_m(np.array(points), walls, solids, bounds)

    assert near((1.0, 3.0)) == 1.0  # as far as it looks
    assert near((1.0, 3.0), (3.0, 0.25)) == 0.25
    assert near((4.3, 0.4)) == pytest.approx(0.5)  # past the end
    assert near((7.0, 7.0)) == near((1.0, 1.0), (11.0, 1.0)) == -np.inf


def test_bodies_in_each_other_are_seen():
    simulation = built(MAZE_30, "fleet.size=3", "stop.elapsed=1 s")
    ticks = Ticks(simulation)
    bodies = simulation.world.snapshot().poses.copy()
    bodies[1] = bodies[0] + (0.3, 0.4, 0.0)  # 0.5 m from the first, radii 0.26 m
    ticks.note(bodies)
    assert ticks.deepest().body_m == pytest.approx(0.02)
    bodies[2, 0] = -39.9
    ticks.note(bodies)
    assert ticks.deepest().wall_m == pytest.approx(0.16)


@pytest.mark.parametrize("terrain", [
    "{maze: {size: [40 m, 40 m], cell: 4 m, seed: 2}}", "{office: {size: [40 m, 30 m], seed: 2}}",
    "{warehouse: {size: [40 m, 50 m], seed: 2}}"])
def test_robots_explore_a_generated_terrain(terrain):
    """No door is too narrow, and no aisle: three robots that start at the lower side see it all."""
    simulation = built(MAZE_30, f"environment.terrain={terrain}", "fleet.size=3",
                       "fleet.start={apart: 1 m, within: [[-20 m, -25 m], [20 m, -10 m]]}")
    outcome = finished(simulation)
    assert outcome.stop_reason == "explored"
