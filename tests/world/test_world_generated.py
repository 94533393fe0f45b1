"""Generated terrains: all that is free can be reached, and a seed always makes the same one."""

import json

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt, label

from desim.errors import InputError
from desim.scenario import generated_terrain
from desim.scenario.schema.environment import Environment, Shape
from desim.world.sources import load

CELL_M = 0.1
SEEDS = st.integers(0, 2**63 - 1)


def terrain_of(name, **plan):
    return load(source(name, **plan))


def source(name, **plan):
    written = {"terrain": {name: plan}}
    return Environment.model_validate_json(json.dumps(written), strict=True).terrain


def metres(low, high):
    return st.integers(round(low * 10), round(high * 10)).map(lambda tenths: f"{tenths / 10} m")


MAZES = st.fixed_dictionaries({
    "size": st.tuples(metres(3, 40), metres(3, 40)), "cell": metres(2, 9), "seed": SEEDS,
    "loops": st.integers(0, 100).map(lambda share: f"{share} %")})
OFFICES = st.fixed_dictionaries({
    "size": st.tuples(metres(8, 60), metres(8, 60)), "seed": SEEDS, "corridor": metres(1, 3),
    "room": st.sampled_from([("2 m", "4 m"), ("3 m", "8 m"), ("4 m", "10 m")]),
    "door": metres(0.9, 1.9)})
WAREHOUSES = st.fixed_dictionaries({
    "size": st.tuples(metres(8, 60), metres(25, 60)), "seed": SEEDS, "aisle": metres(1, 4),
    "rack": st.tuples(metres(0.5, 3), metres(2, 15)), "cross_aisle": metres(1, 5),
    "docks": metres(1, 9), "missing": st.integers(0, 100).map(lambda share: f"{share} %")})
PLANS = (MAZES.map(lambda plan: ("maze", plan)) | OFFICES.map(lambda plan: ("office", plan))
         | WAREHOUSES.map(lambda plan: ("warehouse", plan)))


def regions(terrain, radius_m):
    """The places [rows, cols] where a body of this radius fits, by region, and their number. A wall
    takes the cells that it touches, so that a body has up to a cell less on either side."""
    truth = terrain.truth(terrain.grid(CELL_M))
    clear_m = distance_transform_edt(truth == 0) * CELL_M
    return label(clear_m > radius_m - CELL_M, np.ones((3, 3)))


@settings(max_examples=50, deadline=None)
@given(PLANS)
def test_a_body_as_wide_as_the_doors_reaches_everything(plan):
    """A body that fits through each passage by the numbers finds a way between any two places."""
    name, written = plan
    drawn = source(name, **written)
    assume(not list(generated_terrain.complaints((), drawn)))
    passages = [width_m for _, width_m in generated_terrain._passages(drawn)]
    terrain = load(drawn)
    assert regions(terrain, min(passages) / 2)[1] == 1
    spec = terrain.grid(CELL_M)
    truth = terrain.truth(spec)
    row, col = np.argwhere(truth == 0)[0]
    start = np.array([[spec.x_m + (col + 0.5) * CELL_M, spec.y_m + (row + 0.5) * CELL_M]])
    assert (terrain.reachable(spec, start) == (truth == 0)).all(), "no free cell is walled in"


def test_a_closed_door_is_noticed():
    """The twin of the test before: a terrain with a room that nobody can enter."""
    terrain = load(Shape(size=("9 m", "9 m"), walls=[{"from": ("0 m", "-4.5 m"),
                                                      "to": ("0 m", "3.5 m")}]))
    assert regions(terrain, 0.45)[1] == 1
    assert regions(terrain, 0.65)[1] == 2


@settings(max_examples=100, deadline=None)
@given(PLANS)
def test_walls_and_racks_lie_inside_the_bounds(plan):
    name, written = plan
    drawn = source(name, **written)
    assume(not list(generated_terrain.complaints((), drawn)))
    terrain = load(drawn)
    x0, y0, x1, y1 = terrain.bounds
    assert (x1 - x0, y1 - y0) == tuple(getattr(drawn, name).size_m)
    for rows in (terrain.walls, terrain.solids):
        assert (rows >= np.array([x0, y0, x0, y0]) - 1e-6).all()
        assert (rows <= np.array([x1, y1, x1, y1]) + 1e-6).all()


@settings(max_examples=30, deadline=None)
@given(PLANS)
def test_the_same_plan_makes_the_same_terrain(plan):
    name, written = plan
    assume(not list(generated_terrain.complaints((), source(name, **written))))
    first, second = (terrain_of(name, **written) for _ in range(2))
    assert (first.walls == second.walls).all() and (first.solids == second.solids).all()


def test_terrains_stay_as_they_are():
    """A change here moves every result that is made in a generated terrain."""
    def seen(terrain):
        return len(terrain.walls), float(np.round(np.abs(terrain.walls).sum(), 3))

    size = ["60 m", "40 m"]
    assert seen(terrain_of("maze", size=size, seed=1)) == (15, 917.143)
    assert seen(terrain_of("office", size=size, seed=1)) == (107, 5347.191)
    assert seen(terrain_of("warehouse", size=size, seed=1)) == (44, 2574.545)


@pytest.mark.parametrize("name", ["maze", "office", "warehouse"])
def test_another_seed_is_another_terrain(name):
    size = ["60 m", "60 m"]
    first, second = (terrain_of(name, size=size, seed=seed) for seed in (1, 2))
    assert not np.array_equal(first.walls, second.walls)


# ----------------------------------------------------------------------------------------- mazes


@settings(max_examples=50, deadline=None)
@given(SEEDS, st.integers(1, 9), st.integers(1, 9))
def test_a_maze_without_loops_is_a_tree(seed, cols, rows):
    """n cells that are all joined by n - 1 openings are a tree: between them stand as many walls as
    the grid has edges beside these."""
    terrain = terrain_of("maze", size=[f"{2 * cols} m", f"{2 * rows} m"], cell="2 m", seed=seed,
                         loops="0 %")
    inner_m = np.abs(terrain.walls[:, 2:] - terrain.walls[:, :2]).sum() - 4 * (cols + rows)
    edges = (cols - 1) * rows + cols * (rows - 1)
    assert inner_m / 2 == pytest.approx(edges - (cols * rows - 1), abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(SEEDS)
def test_a_maze_of_loops_has_no_dead_end(seed):
    terrain = terrain_of("maze", size=["18 m", "12 m"], cell="3 m", seed=seed, loops="100 %")
    truth = terrain.truth(terrain.grid(1.0))  # three cells a road: wall, road, road
    middles = [(1 + 3 * row, 1 + 3 * col) for row in range(4) for col in range(6)]
    for row, col in middles:
        ways = [truth[row - 1, col], truth[row, col - 1], truth[row + 2, col], truth[row, col + 2]]
        assert ways.count(0) >= 2


# --------------------------------------------------------------------------------------- offices


@settings(max_examples=30, deadline=None)
@given(SEEDS)
def test_rooms_are_neither_smaller_nor_larger_than_wanted(seed):
    """A body too wide for the doors fits into regions that are the rooms and, all
    together, the corridors, which alone are longer than a room may be."""
    terrain = terrain_of("office", size=["40 m", "30 m"], room=["4 m", "9 m"], door="0.9 m",
                         corridor="2 m", seed=seed)
    radius_m = 0.6
    found, count = regions(terrain, radius_m + CELL_M)
    sides_m = []
    for region in range(1, count + 1):
        extents = [np.ptp(axis) + 1 for axis in np.nonzero(found == region)]
        sides_m.append(np.array(extents) * CELL_M + 2 * radius_m)
    rooms_m = [sides for sides in sides_m if sides.max() < 9 + 3 * CELL_M]
    assert len(rooms_m) == count - 1
    assert np.min(rooms_m) > 4 - 3 * CELL_M


# ------------------------------------------------------------------------------------ warehouses


def test_a_warehouse_by_the_numbers():
    """2 racks of 2 m in 13 m leave three aisles of 3 m; of 31 m in depth, 5 m are docks and twice
    3 m cross aisles, so that racks are 10 m long."""
    terrain = terrain_of("warehouse", size=["13 m", "31 m"], rack=["2 m", "8 m"], aisle="3 m",
                         cross_aisle="3 m", docks="5 m", missing="0 %", material="metal")
    assert terrain.bounds == (-6.5, -15.5, 6.5, 15.5)
    assert terrain.solids.tolist() == [[-3.5, -10.5, -1.5, -0.5], [1.5, -10.5, 3.5, -0.5],
                                       [-3.5, 2.5, -1.5, 12.5], [1.5, 2.5, 3.5, 12.5]]
    matter = terrain.matter()
    assert matter.block.sum() == 16, "four faces a rack, for the radio"


def test_missing_racks_are_a_share_of_all():
    whole = terrain_of("warehouse", size=["150 m", "100 m"], missing="0 %")
    partly = terrain_of("warehouse", size=["150 m", "100 m"], missing="20 %")
    none = terrain_of("warehouse", size=["150 m", "100 m"], missing="100 %")
    assert len(whole.solids) == 27 * 3 and len(none.solids) == 0
    assert 0.1 * 81 < 81 - len(partly.solids) < 0.3 * 81
    assert {*map(tuple, partly.solids.tolist())} < {*map(tuple, whole.solids.tolist())}


def test_an_unknown_material_is_an_error_at_its_key():
    with pytest.raises(InputError, match=r"^environment.terrain.warehouse.material: unknown "
                                         r"material 'wod' \(did you mean 'wood'\?\); allowed: "):
        terrain_of("warehouse", size=["60 m", "60 m"], material="wod")


def test_a_terrain_that_is_too_long_is_an_error_at_its_size():
    with pytest.raises(InputError, match=r"^environment.terrain.maze.size: the terrain is 20000 m "
                                         r"by 8 m; allowed: at most 10000 m a side"):
        terrain_of("maze", size=["20 km", "8 m"])
