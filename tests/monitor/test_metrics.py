"""The knowledge of a fleet, counted change by change; the equations on maps drawn by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.monitor.coverage import Coverage, Reached, evaluate, states
from desim.monitor.meters.map_age import map_age_s
from desim.ports import GridSpec
from desim.ports.tasks import Ground
from desim.robot.mapping.tiles import FREE, OCCUPIED, raster, tiles_of

GRID = GridSpec(0.5, 40, 70, -10.0, -17.5)  # 2 x 3 tiles, none of them full
TILES = 6


def ground(seed: int = 0) -> Ground:
    draw = np.random.default_rng(seed)
    solid = (draw.random((GRID.height, GRID.width)) < 0.2).astype(np.uint8)
    return Ground(GRID, solid, (solid == 0) & (draw.random(solid.shape) < 0.9))


def known_inside(fused: np.ndarray, of: Ground) -> int:
    return int(((states(raster(GRID, fused)) >= 0) & of.reachable).sum())


changes = st.lists(st.tuples(st.integers(0, 2), st.sets(st.integers(0, TILES - 1), min_size=1),
                             st.integers(0, 2**32 - 1)), max_size=12)


@given(changes)
def test_incremental_counts_equal_counting_everything(steps):
    truth = ground()
    coverage = Coverage(truth, ("robot_0", "robot_1", "robot_2"))
    fused = [np.zeros((TILES, 1024), np.int16) for _ in range(3)]
    tile_version, row_version = np.zeros(TILES, np.int64), np.zeros((3, TILES, 32), np.int32)
    ever_known = np.zeros_like(truth.reachable)
    for version, (robot, tiles, seed) in enumerate(steps, 1):
        changed, draw = np.array(sorted(tiles), np.int32), np.random.default_rng(seed)
        tile_version[changed] = version
        for tile in changed:
            rows = draw.random(32) < 0.5
            row_version[robot, tile, rows] = version
            fused[robot][tile].reshape(32, 32)[rows] = draw.integers(-40, 71, (rows.sum(), 32))
        coverage.update(robot, fused[robot], tile_version, row_version[robot], changed)
        ever_known |= states(raster(GRID, fused[robot])) >= 0
        assert coverage.known == [known_inside(own, truth) for own in fused]
        assert coverage.union_known == int((ever_known & truth.reachable).sum())


def test_a_restarted_robot_knows_nothing_and_the_union_keeps_what_was_known():
    truth = ground()
    coverage = Coverage(truth, ("robot_0",))
    own = (np.full((TILES, 1024), FREE, np.int16), np.zeros(TILES, np.int64),
           np.zeros((TILES, 32), np.int32))
    coverage.update(0, *own, np.arange(TILES, dtype=np.int32))
    assert coverage.known == [coverage.cells]
    coverage.restart(0)
    assert (coverage.known, coverage.union_known) == ([0], coverage.cells)
    coverage.update(0, *own, np.array([0], np.int32))
    assert coverage.known == [int(tiles_of(GRID, truth.reachable)[0].sum())]


def test_thresholds_of_known_are_where_the_maps_have_them():
    assert states(np.array([FREE - 1, FREE, FREE + 1, 0, OCCUPIED - 1, OCCUPIED], np.int16)) \
        .tolist() == [0, 0, -1, -1, -1, 100]


@given(st.integers(1, 10**6), st.integers(0, 100))
def test_the_fewest_cells_for_a_share(cells, percent):
    coverage = Coverage(Ground(GRID, np.zeros((70, 40), np.uint8), np.ones((70, 40), bool)), ())
    coverage.cells = cells
    fewest = coverage.cells_for(percent / 100)
    assert fewest == -(-percent * cells // 100)


def test_first_instants_by_some_robot_by_the_union_and_by_all_at_once():
    reached = Reached(10, 2)
    log = []
    for now_ns, (robot, known, union) in enumerate([(0, 5, 5), (1, 6, 11), (0, 10, 12), (0, 9, 12),
                                                    (1, 10, 12), (0, 10, 12)]):
        reached.update(robot, known, union, now_ns)
        log.append(tuple(reached.first_ns.values()))
    # Robot 0 forgets a cell at 3, so that all know enough at the same time only at 5.
    assert log == [(None, None, None), (None, 1, None), (2, 1, None), (2, 1, None), (2, 1, None),
                   (2, 1, 5)]
    assert reached.first_robot == 0


def drawn(*rows: str) -> np.ndarray:
    """Log-odds from characters, the top row first: '.' free, '#' wall, ' ' unknown."""
    return np.array([[{".": -8, "#": 17, " ": 0}[c] for c in row] for row in reversed(rows)],
                    np.int16)


def test_equations_of_the_paper_on_a_small_map():
    truth = drawn("#####",
                  "#...#",
                  "#####")
    grid = GridSpec(2.0, 5, 3, 0.0, 0.0)
    solid = (truth > 0).astype(np.uint8)
    # Known: two of three free cells; one wall cell taken for free, one free cell for a wall.
    believed = drawn("# .##",
                     "#.# #",
                     "#####")
    result = evaluate(Ground(grid, solid, solid == 0), believed, [3.0, 5.0], 4, 100, 1.0)
    assert result["exploration_cost_m"] == 8.0
    assert result["explored_area_m2"] == 2 * 4.0
    assert result["exploration_efficiency_m2_per_m"] == 1.0
    assert result["safety"] == 0.96
    assert result["map_completeness"] == pytest.approx(2 / 3)
    assert result["map_error_cells"] == 2
    assert result["map_quality"] == pytest.approx((2 * 4.0 - 2 * 4.0) / (3 * 4.0))


def test_a_perfect_map_has_quality_and_completeness_one():
    truth = ground(3)
    perfect = np.where(truth.solid != 0, OCCUPIED, FREE).astype(np.int16)
    result = evaluate(truth, perfect, [1.0], 0, 100, 1.0)
    assert (result["map_completeness"], result["map_quality"], result["safety"]) == (1.0, 1.0, 1.0)


def test_the_twin_a_wrong_cell_size_shows_in_the_area_alone():
    truth = ground(3)
    perfect = np.where(truth.solid != 0, OCCUPIED, FREE).astype(np.int16)
    coarse = Ground(truth.grid._replace(resolution_m=0.55), truth.solid, truth.reachable)
    areas = [evaluate(g, perfect, [1.0], 0, 100, 1.0)["explored_area_m2"] for g in (truth, coarse)]
    assert areas[0] == truth.reachable.sum() * 0.25
    assert areas[1] > 1.1 * areas[0]


def test_who_never_moves_has_no_efficiency():
    result = evaluate(ground(), np.zeros((70, 40), np.int16), [0.0, 0.0], 0, 100, 1.0)
    assert result["exploration_efficiency_m2_per_m"] is None
    assert result["explored_area_m2"] == 0.0
    assert not math.isnan(result["map_quality"])


def test_maps_are_as_old_as_the_newest_part_that_was_heard():
    def robot_map(**newest_s):
        return SimpleNamespace(received={name: SimpleNamespace(newest=seconds * 10**9)
                                         for name, seconds in newest_s.items()})

    maps = {"a": robot_map(b=30), "b": robot_map(a=20, c=35), "c": None}
    assert map_age_s(maps, 40 * 10**9) == (10 + 20) / 2  # c is down: nobody waits for it
    assert map_age_s({"a": robot_map(), "b": robot_map(a=40)}, 40 * 10**9) == (40 + 0) / 2
    assert map_age_s({"a": robot_map()}, 40 * 10**9) is None
