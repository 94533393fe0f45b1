"""Places of a patrol to which no path leads: the warning at the end of a run."""

from types import SimpleNamespace

import numpy as np
import pytest

from desim.advice import warnings
from desim.ports.tasks import Place
from desim.scenario.load import from_mapping


class Visits:
    def __init__(self, *unvisited):
        self._unvisited = list(unvisited)

    def briefing(self):
        return SimpleNamespace(places=(Place(3.0, -4.0), Place(8.0, 1.5)))

    def unvisited(self):
        return self._unvisited


def said(monkeypatch, task, explorers=("robot_1",)):
    """The warnings where (3.05, -4) m is free ground that can be reached, and nothing else is."""
    asked = []
    monkeypatch.setattr(warnings, "free_cells", lambda ground, starts_m, radius_m: asked.append(
        starts_m.tolist()) or np.array([[3.05, -4.0], [-8.0, -1.5]]))
    scenario = from_mapping({"name": "two", "fleet": {"size": 2}}).scenario
    found = warnings._out_of_reach(task, SimpleNamespace(
        scenario=scenario, explorers=explorers, robots=("robot_0", "robot_1"),
        ground=None, poses=lambda: np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]])))
    assert asked in ([], [[[1.0, 2.0]]]), "where the robots that move are"
    return found


@pytest.mark.parametrize(("unvisited", "places"), [([], []), ([0], []), ([0, 1], [1])])
def test_a_place_to_which_nobody_can_get_is_warned_of(monkeypatch, unvisited,
                                                         places):
    assert said(monkeypatch, Visits(*unvisited)) == [
        f"task.places.{i}: nobody has been at 8 m, 1.5 m: no path leads there from where the "
        "robots are" for i in places]


def test_nobody_is_warned_of_another_task_or_where_nobody_moves(monkeypatch):
    assert said(monkeypatch, object()) == said(monkeypatch, Visits(1), ()) == []
