"""A new meter is one file and one line: here a class, and a line in place of the monitor's."""

from collections import Counter

import numpy as np
import pytest
from runs import HELLO, built

from desim.monitor.meters.meter import Meter
from desim.monitor.monitor import Monitor
from desim.monitor.periods import all_due
from desim.monitor.summary import robots_table, samples_table, summarize


class Turning(Meter):
    """The angle by which robots have turned, as of full seconds; a test adds it."""

    def __init__(self, truth):
        self.names, self.listeners = truth.robots, {"recovery": self.frees_itself}
        self.turned_rad, self.before_rad = np.zeros(len(truth.robots)), None
        self.starts, self.recoveries = [], 0

    def watch(self, robot, robot_map, now_ns):
        self.starts.append(robot)

    def frees_itself(self, robot, *_):
        self.recoveries += 1

    def each_second(self, second):
        yaw_rad = second.poses[:, 2]
        if self.before_rad is not None:
            self.turned_rad = self.turned_rad + abs(yaw_rad - self.before_rad)
        self.before_rad = yaw_rad

    def sample(self, now_ns, due):
        return {"turned_rad": float(self.turned_rad.sum())}

    def track(self, second):
        return {"turned_rad": self.turned_rad}

    def by_host(self, now_ns):
        return {name: {"turned_rad": float(turned)} for name, turned
                in zip(self.names, self.turned_rad, strict=True)}

    def summary(self, now_ns):
        return {"turned_rad": float(self.turned_rad.sum()), "robots_started": self.starts}


@pytest.fixture
def results(monkeypatch):
    """The digest, summary and tables of a run, with and without the meter."""
    def run():
        simulation = built(HELLO, "stop.elapsed=12 s")
        outcome, monitor = simulation.run(), simulation.monitor
        return (outcome.digest, summarize(monitor, outcome.simulated_ns), samples_table(monitor),
                robots_table(monitor))

    before, made = run(), Monitor._new_meters
    monkeypatch.setattr(Monitor, "_new_meters", lambda own: [*made(own), Turning(own.truth)])
    return before, run()


def test_a_new_meter_has_its_place_in_every_result(results):
    _, (_, summary, samples, robots) = results
    assert summary["turned_rad"] > 1 and summary["robots_started"] == [*summary["robots"]]
    assert sum(own["turned_rad"] for own in summary["robots"].values()) == pytest.approx(
        summary["turned_rad"])
    assert samples["turned_rad"][0] == 0 and samples["turned_rad"][-1] == summary["turned_rad"]
    assert robots["turned_rad"].shape == robots["x_m"].shape
    assert robots["turned_rad"][-len(summary["robots"]):].sum() == pytest.approx(
        summary["turned_rad"])


def test_rows_go_to_all_meters_that_listen(monkeypatch):
    made = Monitor._new_meters
    monkeypatch.setattr(Monitor, "_new_meters", lambda own: [*made(own), Turning(own.truth)])
    simulation = built(HELLO)
    monitor = simulation.monitor
    simulation.graph.listeners["recovery"]("robot_1", 0, 0, 0)
    assert (monitor.incidents.recoveries_of[1], monitor.meters[-1].recoveries) == (1, 1)


def test_it_changes_nothing_else_and_no_order(results):
    (digest, *before), (with_meter, *after) = results
    assert digest == with_meter
    for table, other in zip(before, after, strict=True):
        own = [name for name in other if name not in ("turned_rad", "robots_started")]
        assert own == list(table)
    summary, other = before[0], after[0]
    assert [name for name in summary if name != "robots" and summary[name] != other[name]] == []
    assert [*after[1]].index("turned_rad") == [*after[1]].index("cause") - 1


def keys_of_two(meters, now_ns):
    """The quantities, columns and keys of the summary that two meters have."""
    found = []
    for parts in ([meter.quantities(now_ns) for meter in meters],
                  [meter.sample(now_ns, all_due) for meter in meters],
                  [meter.summary(now_ns) for meter in meters]):
        names = Counter(name for part in parts for name in part)
        found += [name for name, count in names.items() if count > 1]
    return found


def test_no_two_meters_have_one_key():
    """With a twin: a meter that is there twice."""
    simulation = built(HELLO, "stop.elapsed=1 s", "computers=measured", "robot.power={}")
    now_ns, meters = simulation.run().simulated_ns, simulation.monitor.meters
    assert keys_of_two(meters, now_ns) == []
    assert "collisions" in keys_of_two([*meters, simulation.monitor.incidents], now_ns)
