"""The growth of maps: of which robots and when, and how coarse it is kept."""

from types import SimpleNamespace

import pytest

from desim.engine.trace import Names
from desim.monitor.map_growth import coarse, halvings
from desim.monitor.recorder import Recorder
from desim.ports import GridSpec
from desim.robot.mapping.fusion import robot_map_of
from desim.robot.mapping.tiles import TilePool

S = 10**9

LARGEST = GridSpec(0.05, 8192, 4096, -1.0, 2.0)  # 2^25 cells, as many as are kept of all robots


@pytest.mark.parametrize(("robots", "halved"), [
    (1, 0), (2, 1), (4, 1), (5, 2), (16, 2), (17, 3), (64, 3), (65, 4), (10**6, 5)])
def test_maps_are_halved_until_a_quarter_of_a_quarter_fits(robots, halved):
    assert halvings(LARGEST, robots) == halved


def test_coarse_cells_cover_the_map_and_begin_where_it_does():
    assert coarse(GridSpec(0.05, 17, 16, -1.0, 2.0), 2) == GridSpec(0.2, 5, 4, -1.0, 2.0)


def test_a_life_is_from_a_start_of_a_robots_software_to_its_end():
    kernel = SimpleNamespace(now_ns=0, ticker=lambda *_: None)
    grid = GridSpec(0.1, 32, 32, 0.0, 0.0)
    recorder = Recorder(lambda rows: None)
    recorder.begin(kernel, Names(), SimpleNamespace(robots=("a", "b")), grid,
                   SimpleNamespace(media=[]), SimpleNamespace(
                       truth=SimpleNamespace(explorers=("a", "b")), links=SimpleNamespace()))
    for at_s, robot, is_up in ((1, "a", True), (2, "b", True), (5, "a", False), (7, "a", True)):
        kernel.now_ns = at_s * S
        recorder.watch(robot, robot_map_of(grid, TilePool(), "evidence") if is_up else None)
    assert recorder.lives == [("a", S, 5 * S), ("b", 2 * S, None), ("a", 7 * S, None)]
    kernel.now_ns = 9 * S
    assert [(one.robot, one.started_ns, one.until_ns) for one in recorder.growths()] == [
        ("a", S, 5 * S), ("b", 2 * S, 9 * S), ("a", 7 * S, 9 * S)]
