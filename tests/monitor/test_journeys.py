"""Journeys on a made-up fleet: when they end, and goals from MovingAI's files."""

import math

import numpy as np
import pytest

from desim.errors import InputError
from desim.monitor.tasks.journeys import ManyJourneys
from desim.ports import Place
from desim.testing import TaskBench

S = 1_000_000_000
HEAD = "version 1\n"


def journeys(**params):
    return TaskBench(ManyJourneys(ManyJourneys.Params(**params)))


def scen(tmp_path, *rows):
    path = tmp_path / "hall.scen"
    path.write_text(HEAD + "".join(f"{row}\n" for row in rows))
    return str(path)


def test_goals_are_reached_in_turn(tmp_path):
    path = scen(tmp_path, *(f"0 hall.map 32 32 1 1 {x} {y} 9" for x, y in (
        (5, 26), (8, 3), (20, 26), (8, 5))))
    bench = journeys(file=path, goals=2)
    # Rows count from the top: row 26 of 32 is the sixth from below.
    assert bench.task.briefing().goals == {
        "robot_1": (Place(5.5, 5.5), Place(20.5, 5.5)),
        "robot_10": (Place(8.5, 28.5), Place(8.5, 26.5))}
    bench.move(0, 20.5, 5.5)  # the second before the first does not count
    bench.run(S)
    for second, robot, x_m, y_m in ((2, 0, 5.0, 5.0), (4, 2, 8.5, 28.5), (5, 0, 20.5, 5.0),
                                    (9, 2, 8.5, 26.0)):
        assert bench.reason is None
        bench.move(robot, x_m, y_m)
        bench.run(second * S)
    assert bench.reason == "arrived"
    assert bench.task.metrics() == {
        "goals": 4, "goals_reached": 4, "goals_per_hour": 4 * 3600 / 9.0, "makespan_s": 5.1,
        "sum_of_costs_s": pytest.approx(4.1 + 5.1)}


@pytest.mark.parametrize("rows, text", [
    (["0 hall.map 32 32 1 1 5 26 9"], ": 1 lines of starts and goals; 2 are needed"),
    (["0 hall.map 32 32 1 1 5 26 9", "goal"],
     ":3: 'goal'; allowed: bucket, map, width, height, start x, start y, goal x, goal y, length"),
    (["0 hall.map 32 32 1 1 40 26 9"] * 2,
     ":2: the goal 40, 26 is in no free cell of this terrain"),
])
def test_files_that_do_not_fit(tmp_path, rows, text):
    path = scen(tmp_path, *rows)
    with pytest.raises(InputError) as caught:
        journeys(file=path)
    assert str(caught.value) == path + text


def test_more_robots_than_places(monkeypatch):
    monkeypatch.setattr("desim.monitor.tasks.journeys.free_cells", lambda *_: np.zeros((1, 2)))
    with pytest.raises(InputError, match=r"^\.goals: there are 1 places that are 0.8 m away from "
                                         "walls, not 2$"):
        journeys()


def test_goals_of_one_number_are_apart():
    """A second goal may lie where another robot's first one does; two first ones may not."""
    goals = journeys(goals=50).task.briefing().goals.values()
    assert all(math.dist(*pair) > 10 for pair in zip(*goals, strict=True))
