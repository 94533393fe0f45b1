"""The tool on standing robots changes no run, names one reason for each, and knows a convoy."""

import math

import numpy as np
import pytest
from standing import EVERY_NS, REASONS, Watch  # a tool

from desim.engine.kernel import Phase
from desim.scenario.load import load
from desim.simulation.simulation import Simulation


def simulation(sink=None):
    scenario = load("scenarios/hello.yaml", ["stop.elapsed=6 s"], 1).scenario
    return Simulation(scenario) if sink is None else Simulation(scenario, trace_sink=sink)


def test_a_watched_run_is_the_same_run_and_who_stands_has_one_reason():
    box = []
    watched = simulation(lambda rows: box[0].rows_of_trace(rows))
    watch = Watch(watched)
    box.append(watch)
    watched.kernel.process(watch.process(), Phase.OBSERVE, 2**30)
    assert watched.run().digest == simulation().run().digest
    robots = len(watched.world.robots)
    stands = [sum(row[reason] for reason in REASONS) for row in watch.rows]
    assert watch.rows[0]["no goal"] > 0  # its costmap is not announced yet
    assert all(count <= robots for count in stands)
    assert all(row["speed"] > 0.0 or count == robots
               for row, count in zip(watch.rows, stands, strict=True))
    assert sum(row["goal"] for row in watch.rows) >= robots


@pytest.mark.parametrize(("other", "share"), [
    ((2.0, 0.0, 0.0), 0.5),  # ahead of the first, the same way: one of two follows
    ((2.0, 0.0, math.pi), 0.0),  # it comes towards the first
    ((0.0, 2.0, 0.0), 0.0),  # beside it
    ((5.0, 0.0, 0.0), 0.0),  # too far ahead
])
def test_a_convoy_is_near_ahead_and_alike(other, share):
    watch = Watch.__new__(Watch)
    watch._way_m = watch._convoy_m = 0.0
    step_m = EVERY_NS / 1e9
    watch._follow(np.array([(0.0, 0.0, 0.0), other]), np.array([step_m, step_m]))
    assert watch.convoy_share() == pytest.approx(share)
