"""A ring of sonars: what it reads, and that navigation keeps clear of it."""

import numpy as np
import pytest
from runs import SCENARIOS, built

from desim.scenario.load import from_mapping
from desim.simulation.simulation import Simulation

BLIND = "fleet.types.mapper.robot.lasers.low.height=0.6 m"  # to the low wall at x = -2 m
ALONE = ("fleet.robots=[{type: mapper, count: 1}]",
         "fleet.start={poses: [{x: -8 m, y: -4 m}]}", "stop.elapsed=60 s")


def readings(heading="0 deg", **sonar):
    """The ranges of the ring of a robot at (1, 2) in a room of 20 m x 10 m about the origin, and
    the size of the message."""
    simulation = Simulation(from_mapping({
        "name": "room", "environment": {"terrain": {"size": ["20 m", "10 m"]}},
        "fleet": {"start": {"poses": [{"x": "1 m", "y": "2 m", "heading": heading}]}},
        "robot": {"sonar": sonar}, "stop": {"elapsed": "50 ms"}}).scenario)
    simulation.run()
    simulation.graph.catch_up()
    driver = simulation._world_events._drivers[0]
    _, (sensors, _) = driver._sonars[0]
    found = driver._sonar(driver._sonars[0][0], sensors, simulation.world.snapshot(), 0, 0)
    return [float(scan.ranges[0]) for scan in found.scans], found.size_bytes


def test_a_sonar_reads_the_nearest_of_what_is_in_its_cone():
    """To the left and the right there are walls, squarely to the outer transducers; the wall on the
    left is also at the edge of the cone of 50 + 15 deg."""
    ranges, size_bytes = readings()
    assert ranges[0] == pytest.approx(5.0 - 2.0 - 0.136, abs=1e-5)
    assert ranges[1] == pytest.approx((3.0 - 0.119) / np.sin(np.radians(65)), abs=1e-5)
    assert ranges[3:] == [5.0] * 5
    assert size_bytes == 24 + len("/p3dx0_tf/base_link") + 8 * 12
    narrow, _ = readings(cone="10 deg")  # the twin
    assert narrow[1] == pytest.approx((3.0 - 0.119) / np.sin(np.radians(55)), abs=1e-5)


def collisions(*overrides):
    simulation = built(SCENARIOS / "two_types.yaml", *ALONE, *overrides)
    simulation.run()
    return simulation.monitor.incidents.collisions


def test_navigation_keeps_clear_of_what_the_sonar_alone_sees():
    without, with_one = collisions(BLIND), collisions(BLIND, "robot.sonar={}")
    assert (without > 0, with_one) == (True, 0)
