"""Runs that take long, or their workers' lives, and the vectors that are tried before."""

from types import SimpleNamespace

import pytest

from desim.campaign.running import crew as crews
from desim.campaign.running.crew import Crew
from desim.campaign.running.probes import _spread


def test_a_long_run_is_mentioned_once_a_minute(monkeypatch):
    clock, said = [0.0], []
    monkeypatch.setattr(crews, "monotonic", lambda: clock[0])
    crew = Crew(0, slow=lambda run_id, seconds: said.append((run_id, seconds)))
    crew._busy = [SimpleNamespace(task=SimpleNamespace(run_id=name), begun_s=begun_s)
                  for name, begun_s in (("a", 0.0), ("b", 30.0))]
    for now_s in (59.0, 60.0, 61.0, 119.0, 120.0):
        clock[0] = now_s
        crew._mention()
    assert said == [("a", 60.0), ("a", 120.0), ("b", 90.0)]


@pytest.mark.parametrize("wall_ns, left_s", [(None, 60.0), (20 * 10**9, 15.0), (4 * 10**9, 0.0),
                                             (500 * 10**9, 60.0)])
def test_the_driver_wakes_up_when_the_first_run_is_due(monkeypatch, wall_ns, left_s):
    monkeypatch.setattr(crews, "monotonic", lambda: 10.0)
    crew = Crew(0, wall_ns)
    assert crew._left_s() == 60.0
    crew._busy = [SimpleNamespace(begun_s=begun_s) for begun_s in (8.0, 5.0)]
    assert crew._left_s() == left_s


def vectors(*robots):
    return [SimpleNamespace(robots=count) for count in robots]


def test_probes_are_of_different_fleets_with_the_largest_among_them():
    made = vectors(4, 1, 9, 2, 7)
    assert [one.robots for one in _spread(made, 1)] == [4]  # the middle one
    for most in (2, 3, 4):
        fleets = [one.robots for one in _spread(made, most)]
        assert len(fleets) == most and fleets == sorted(set(fleets)) and fleets[-1] == 9
    assert [one.robots for one in _spread(made, 9)] == [1, 2, 4, 7, 9]


def test_a_run_that_takes_its_workers_lives_says_how_many():
    cluster = pytest.importorskip("desim.campaign.running.cluster")

    def fails():
        raise cluster.KilledWorker("run", SimpleNamespace(address="here"), 1)

    row = cluster._outcome(SimpleNamespace(run_id="x"), SimpleNamespace(result=fails))
    assert (row["run_id"], row["error"]) == ("x", "its worker died 2 times")
