"""Search, coverage, pursuit and formation on a made-up fleet, by hand."""

import math

import numpy as np
import pytest

from desim.errors import InputError, ModelError
from desim.monitor.places import unobstructed
from desim.monitor.tasks.formation import KeepFormation, wedge
from desim.monitor.tasks.pursuit import Chase
from desim.monitor.tasks.search import Searching
from desim.monitor.tasks.sweeping import Sweeping
from desim.ports import Place
from desim.ports.pursuit import Caught, Pursuit, RobotSeen
from desim.ports.search import KnowVictim, Victim
from desim.testing import TaskBench, check_task

S = 1_000_000_000
TWO = (("10 m", "4 m"), ("20 m", "4 m"))  # robot_1 of the bench starts at 4, 4, robot_10 at 28, 28


@pytest.mark.parametrize("task", [Searching, Sweeping, Chase, KeepFormation])
def test_contract(task):
    check_task(task)


def wall_at(bench, x_m):
    """A wall across the hall of the bench."""
    bench.ground.solid[:, int(x_m / bench.ground.grid.resolution_m)] = 1


# ------------------------------------------------------------------------------------------- search


def test_a_victim_is_seen_by_who_is_near_and_reported_by_the_base():
    bench = TaskBench(Searching(Searching.Params(places=TWO)))
    bench.desks = ("base",)
    bench.run(S)
    assert bench.notified == []
    bench.move(0, 7.5, 4.0)
    bench.run(2 * S)
    bench.run(3 * S)
    assert bench.notified == [("robot_1", Victim(0, Place(10.0, 4.0)))]  # it is told once
    assert bench.task.measure() == {"victims_seen": 1, "victims_reported": 0}
    bench.run(5 * S)
    bench.act("base", KnowVictim(0))
    bench.act("base", KnowVictim(0))
    assert bench.rows == [(S + S // 5, "victim_seen", "robot_1", 0, 0),
                          (5 * S, "victim_reported", None, 0, 0)]
    assert bench.reason is None and bench.task.metrics()["report_worst_s"] is None
    bench.move(2, 20.0, 6.9)
    bench.run(6 * S)
    bench.act("base", KnowVictim(1))
    assert bench.reason == "found"
    assert bench.task.metrics() == {
        "victims": 2, "victims_seen": 2, "victims_reported": 2, "seen_mean_s": 3.2,
        "report_delay_s": pytest.approx((3.8 + 0.8) / 2), "report_worst_s": 6.0}


def test_nobody_sees_through_walls():
    bench = TaskBench(Searching(Searching.Params(places=TWO)))
    wall_at(bench, 9.0)
    bench.move(0, 7.5, 4.0)
    bench.run(2 * S)
    assert bench.notified == []


def test_without_a_base_what_is_seen_is_known():
    bench = TaskBench(Searching(Searching.Params(places=TWO[:1])))
    bench.move(0, 9.0, 4.0)
    bench.run(S)
    assert bench.reason == "found"


def test_nobody_knows_of_whom_nobody_saw():
    bench = TaskBench(Searching(Searching.Params(places=TWO)))
    bench.desks = ("base",)
    with pytest.raises(ModelError) as caught:
        bench.act("base", KnowVictim(1))
    assert str(caught.value) == "base knows of victim 1, whom no robot has seen"
    with pytest.raises(ModelError) as caught:
        bench.act("robot_1", KnowVictim(0))
    assert str(caught.value) == ("robot_1 cannot do KnowVictim(number=0); allowed: KnowVictim, by "
                                 "hosts without a body")


def test_walls_hide_what_is_behind():
    bench = TaskBench(Searching(Searching.Params(places=TWO)))
    at = np.array([[4.0, 4.0], [12.0, 9.0]])
    assert unobstructed(bench.ground, *at) and unobstructed(bench.ground, at[0], at[0])
    wall_at(bench, 8.0)
    assert not unobstructed(bench.ground, *at)
    assert not unobstructed(bench.ground, *at[::-1])


# ----------------------------------------------------------------------------------------- coverage


def test_a_strip_of_the_tool_is_covered():
    """A disc that moves for 10 m covers a strip and two half discs, wherever it was looked at."""
    bench = TaskBench(Sweeping(Sweeping.Params(width="4 m")))
    bench.move(2, 28.0, 28.0)
    bench.run(S)
    before_m2 = bench.task.metrics()["covered_m2"]
    bench.move(0, 14.0, 4.0)
    bench.run(2 * S)
    after_m2 = bench.task.metrics()["covered_m2"]
    disc_m2 = math.pi * 2.0**2
    assert before_m2 == pytest.approx(2 * disc_m2, rel=0.05)  # cells of 0.5 m
    assert after_m2 - before_m2 == pytest.approx(10.0 * 4.0, rel=0.05)
    assert bench.task.metrics()["passes_mean"] == 1.0


def test_passes_are_counted_anew_when_a_tool_comes_back():
    bench = TaskBench(Sweeping(Sweeping.Params(width="4 m")))
    for second, x_m in enumerate((14.0, 4.0, 14.0), 1):
        bench.move(0, x_m, 4.0)
        bench.run(second * S)
    assert 2.0 < bench.task.metrics()["passes_mean"] < 3.0  # robot_10 stood
    own_m2 = bench.task.metrics()["covered_m2_by_robot"]
    assert own_m2["robot_1"] == pytest.approx(40.0 + math.pi * 4.0, rel=0.05)


def test_the_whole_ground_can_be_covered():
    bench = TaskBench(Sweeping(Sweeping.Params(width="2 m")))
    second = 0
    for row in range(32):
        for x_m in (0.5, 31.5)[::1 if row % 2 else -1]:
            second += 1
            bench.move(0, x_m, row + 0.5)
            bench.run(second * S)
    assert bench.reason == "covered"
    assert bench.task.measure()["covered"] == 1.0
    done_s = bench.task.metrics()["coverage_time_s"]
    assert done_s == pytest.approx(0.95 * second, abs=3)


def test_a_tool_that_is_too_narrow():
    with pytest.raises(InputError) as caught:
        TaskBench(Sweeping(Sweeping.Params(width="0.3 m")))
    assert str(caught.value) == (".width: 0.3 m is less than a cell of the terrain; allowed: from "
                                 "0.5 m on")


# ---------------------------------------------------------------------------------------- formation


def test_errors_of_a_wedge_by_hand():
    """The leader at 4, 4 faces east. Its follower belongs 2 m behind it and 2 m to its left."""
    bench = TaskBench(KeepFormation(KeepFormation.Params(places=TWO)))
    assert bench.task.briefing().offsets == {"robot_10": (-2.0, 2.0)}
    bench.move(2, 2.0, 9.0)  # 3 m from its place
    bench.run(S)
    assert bench.task.measure() == {"formation_error_m": pytest.approx(3.0)}
    bench.move(2, 2.0, 6.4)  # 0.4 m
    bench.run(2 * S)
    metrics = bench.task.metrics()
    assert metrics["formation_error_m"] == pytest.approx((3.0 + 0.4) / 2)
    assert (metrics["formation_error_worst_m"], metrics["in_formation"]) == (3.0, 0.5)
    for second, place in enumerate(((20.0, 4.0), (10.0, 4.3), (20.0, 4.0)), 3):
        assert bench.reason is None
        bench.move(0, *place)  # the second place before the first does not count
        bench.run(second * S)
    assert bench.reason == "arrived"
    assert bench.rows == [(3 * S + S // 10, "place_reached", "robot_1", 0, 0),
                          (4 * S + S // 10, "place_reached", "robot_1", 1, 0)]


def test_a_wedge():
    assert wedge(["a", "b", "c"]) == {"a": (-2.0, 2.0), "b": (-2.0, -2.0), "c": (-4.0, 4.0)}


def test_offsets_of_nobody():
    with pytest.raises(InputError) as caught:
        TaskBench(KeepFormation(KeepFormation.Params(offsets={"robot_11": ("1 m", "1 m")})))
    assert str(caught.value) == (".offsets.robot_11: no robot behind robot_1 has this name (did "
                                 "you mean 'robot_10'?); allowed: robot_10")


# ------------------------------------------------------------------------------------------ pursuit


def test_both_sides_see_each_other_and_the_nearer_one_is_caught():
    bench = TaskBench(Chase(Chase.Params()))
    assert bench.task.briefing() == Pursuit(("robot_10",), 8.0, 1.5)
    bench.run(S)
    assert bench.notified == []
    bench.move(2, 10.0, 4.0)
    bench.run(S + S // 2)
    assert bench.notified == [("robot_1", RobotSeen("robot_10", Place(10.0, 4.0))),
                              ("robot_10", RobotSeen("robot_1", Place(4.0, 4.0)))]
    wall_at(bench, 9.0)  # now there is a wall between
    bench.move(0, 9.0, 4.0)
    bench.run(2 * S)
    assert len(bench.notified) == 2 and bench.task.measure() == {"caught": 0}
    bench.move(0, 9.6, 4.0)
    bench.run(3 * S)
    assert bench.reason == "caught" and bench.held == ["robot_10"] * 2
    assert bench.notified[-2:] == [("robot_1", Caught("robot_10")),
                                   ("robot_10", Caught("robot_10"))]
    assert bench.task.metrics() == {"evaders": 1, "caught": 1, "capture_time_s": 2.5,
                                    "capture_times_s": {"robot_10": 2.5}}


@pytest.mark.parametrize("evaders, text", [
    (["robot_11"], ".evaders.0: no robot has the name 'robot_11' (did you mean 'robot_1'?); "
                   "allowed: robot_1, robot_10"),
    (["robot_1", "robot_10"], ".evaders: nobody is left to pursue; allowed: some robots, not all"),
])
def test_evaders_that_cannot_be(evaders, text):
    with pytest.raises(InputError) as caught:
        TaskBench(Chase(Chase.Params(evaders=evaders)))
    assert str(caught.value) == text
