"""Terrain sources and the ground truth made of them."""

import math
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from desim.errors import InputError
from desim.ports import GridSpec
from desim.ports.terrain import Wall
from desim.scenario.schema.environment import Drawing, MapFile, Shape
from desim.world.geometry import merge_collinear, outline, point_distance, segments
from desim.world.polygons import strips
from desim.world.sources import load
from desim.world.terrain import Raster, from_raster, of_free_cells

MAPS = Path(__file__).parents[3] / "shared" / "reference" / "mrs_testbed_maps"
LINE = np.array([(-38.0, 38.0 - 2 * i) for i in range(30)])  # the paper's start line
BUILTIN = ["cross", "loop", "maze", "zigzag"]


def free_m2(terrain, spec=None, starts=LINE):
    spec = spec or terrain.grid(0.2)
    return float(terrain.reachable(spec, starts).sum()) * spec.resolution_m**2


# -------------------------------------------------------------------------------- the paper's four


@pytest.mark.parametrize("name, walls", [("cross", 20), ("loop", 8), ("maze", 60), ("zigzag", 13)])
def test_number_of_straight_walls(name, walls):
    assert len(load(name).walls) == walls


@pytest.mark.parametrize("name", BUILTIN)
def test_walls_run_through_the_middle_of_cells(name):
    terrain = load(name)
    spec = terrain.grid(0.2)
    assert spec == GridSpec(0.2, 401, 401, pytest.approx(-40.1), pytest.approx(-40.1))
    truth = terrain.truth(spec)
    assert truth.dtype == np.uint8 and set(np.unique(truth)) == {0, 1}
    assert truth[[0, -1]].all() and truth[:, [0, -1]].all()


def test_areas_of_loop_and_cross_are_those_of_their_roads():
    """A wall takes the cell that it runs through: of a ring 8 m wide 39 cells are left."""
    loop, cross = load("loop"), load("cross")
    assert free_m2(loop) == pytest.approx((399**2 - 321**2) * 0.04)
    assert free_m2(cross) == pytest.approx((399**2 - 4 * 141**2) * 0.04)
    assert loop.truth(loop.grid(0.2))[200, 200] == 1, "the core is solid"


def test_all_cells_of_the_maze_are_joined_and_the_farthest_is_19_steps_away():
    terrain = load("maze")
    truth = terrain.truth(terrain.grid(8.0 / 3))  # three cells a road: wall, road, road
    steps = np.full(truth.shape, -1)
    steps[truth.shape[0] - 2, 1], queue = 0, [(truth.shape[0] - 2, 1)]
    for row, col in queue:
        for near in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
            if not truth[near] and steps[near] < 0:
                steps[near] = steps[row, col] + 1
                queue.append(near)
    assert (steps[1::3, 1::3] >= 0).sum() == 100
    assert free_m2(terrain) == pytest.approx(float((truth_of(terrain) == 0).sum()) * 0.04)


def truth_of(terrain):
    return terrain.truth(terrain.grid(0.2))


def test_zigzag_leaves_its_first_gap_at_the_top():
    truth = truth_of(load("zigzag"))
    wall_1, wall_2 = 40, 80  # columns of x = -32 and -24
    assert truth[390, wall_1] == 0 and truth[10, wall_1] == 1
    assert truth[390, wall_2] == 1 and truth[10, wall_2] == 0


# ----------------------------------------------------------------------------------------- rasters


def test_a_wall_between_two_cells_is_in_both():
    terrain = load(Shape(size=("8 m", "4 m"), walls=[{"from": ("0 m", "-2 m"),
                                                      "to": ("0 m", "2 m")}]))
    truth = terrain.truth(GridSpec(1.0, 10, 6, -5.0, -3.0))
    side, road = [1] * 10, [1, 1, 0, 0, 1, 1, 0, 0, 1, 1]
    assert truth.tolist() == [side, side, road, road, side, side]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-4.9, 4.9)] * 4), min_size=1, max_size=6), st.randoms())
def test_every_point_of_a_wall_lies_in_a_wall_cell(rows, random):
    walls = [{"from": (f"{a:.6f} m", f"{b:.6f} m"), "to": (f"{c:.6f} m", f"{d:.6f} m")}
             for a, b, c, d in rows if abs(a - c) + abs(b - d) > 0.01]
    terrain = load(Shape(size=("10 m", "10 m"), walls=walls))
    spec = terrain.grid(0.37)
    truth = terrain.truth(spec)
    for x1, y1, x2, y2 in terrain.walls.tolist():
        share = random.random()
        col, row = spec.cell(x1 + share * (x2 - x1), y1 + share * (y2 - y1))
        assert truth[row, col] == 1


def test_a_start_in_a_wall_cell_counts_on_its_own_side():
    terrain = load(Shape(size=("20 m", "20 m"), walls=[{"from": ("0 m", "-10 m"),
                                                        "to": ("0 m", "10 m")}]))
    spec = terrain.grid(1.0)
    right = terrain.reachable(spec, np.array([[0.3, 0.0]]))
    assert right[:, :10].sum() == 0 and right[:, 11:].sum() == 9 * 19


def test_no_reachable_cell_is_an_error():
    terrain = load(Shape(size=("1 m", "1 m")))
    with pytest.raises(InputError, match="environment.terrain: no free cell of 2.0 m"):
        terrain.reachable(terrain.grid(2.0), np.array([[0.0, 0.0]]))


def test_a_grid_of_too_many_cells_is_an_error():
    with pytest.raises(InputError, match="robot.mapping.resolution"):
        load("maze").grid(0.001)


# ---------------------------------------------------------------------------------------- geometry


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 8), st.integers(1, 4)), min_size=1,
                max_size=12), st.floats(0, 3.1), st.randoms())
def test_merging_keeps_the_points_and_forgets_the_order(spans, angle, random):
    """Walls on five parallel lines, as intervals of whole metres, cut at random and shuffled."""
    ux, uy = np.cos(angle), np.sin(angle)
    rows = []
    for line, start, length in spans:
        for piece in range(length):
            a, b = start + piece, start + piece + 1
            row = (ux * a - uy * line, uy * a + ux * line, ux * b - uy * line, uy * b + ux * line)
            rows.append(row if random.random() < 0.5 else (*row[2:], *row[:2]))
    merged = merge_collinear(segments(rows))
    random.shuffle(rows)
    assert np.allclose(merged, merge_collinear(segments(rows)), atol=1e-7)
    covered = {(line, start + piece) for line, start, length in spans for piece in range(length)}
    runs = sum((line, at - 1) not in covered for line, at in covered)
    assert len(merged) == runs
    lengths = np.hypot(merged[:, 2] - merged[:, 0], merged[:, 3] - merged[:, 1])
    assert lengths.sum() == pytest.approx(len(covered))


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_an_outline_separates_solid_from_free(seed):
    solid = np.random.default_rng(seed).random((7, 9)) < 0.5
    lengths = 0
    for x1, y1, x2, y2 in outline(solid).tolist():
        lengths += abs(x2 - x1) + abs(y2 - y1)
        for at in range(min(x1, x2), max(x1, x2)):
            assert solid[y1 - 1, at] != solid[y1, at]
        for at in range(min(y1, y2), max(y1, y2)):
            assert solid[at, x1 - 1] != solid[at, x1]
    assert lengths == (solid[1:] != solid[:-1]).sum() + (solid[:, 1:] != solid[:, :-1]).sum()


# ---------------------------------------------------------------------------------------- drawings


def test_above_all_walls_the_bounds_remain():
    """One stands where a side would be if the room were turned."""
    room = load(Shape(size=("20 m", "10 m"), walls=[
        Wall(**{"from": (f"{x_m} m", "-1 m"), "to": (f"{x_m} m", "1 m")}) for x_m in (-5, 2)]))
    assert len(room.walls) == 6
    assert sorted(room.above(2.0).walls.tolist()) == sorted(
        load(Shape(size=("20 m", "10 m"))).walls.tolist())


def test_a_drawing_of_walls():
    shape = Shape(size=("4 m", "2 m"), drawing=Drawing(cell="2 m", lines=["+--+--+",
                                                                          "|  |  |",
                                                                          "+--+--+"]))
    assert len(load(shape).walls) == 5 and load(shape).solids.size == 0


def test_a_drawing_of_blocks_is_solid():
    terrain = load(Shape(size=("3 m", "3 m"), drawing=Drawing(cell="1 m", style="blocks",
                                                               lines=["   ", " ##", "   "])))
    assert terrain.solids.tolist() == [[-0.5, -0.5, 1.5, 0.5]]
    assert terrain.clearance(np.array([[0.0, 0.0], [0.0, 1.0]]), 2.0).tolist() == [-1.0, 0.5]


@pytest.mark.parametrize("lines, complaint", [
    (["+--+", "|  |"], "has 2 n . 1 lines of 3 m . 1 characters, not 2 lines of 4"),
    (["+--+", "|   |", "+--+"], r"lines.1: has 5 characters, the first line has 4"),
    (["+--+", "|##|", "+--+"], r"lines.1: column 2 has '##' where only '  ' can stand"),
    (["+--+", "+  |", "+--+"], r"lines.1: column 1 has '\+' where only '\|', ' ' can stand"),
    (["+--+--+", "|     |", "+--+--+"], r"2 cells of 8 m wide, 16 m, but size\[0\] is 8 m"),
])
def test_wrong_drawings(lines, complaint):
    with pytest.raises(InputError, match=f"^environment.terrain.drawing.*{complaint}"):
        load(Shape(size=("8 m", "8 m"), drawing=Drawing(lines=lines)))


def test_letters_of_another_format_are_no_free_ground():
    drawing = Drawing(style="blocks", lines=["##", "@."])
    with pytest.raises(InputError, match=r"drawing\.lines\.1: column 1 has '@' where only '#', "
                                         r"'\.', ' ' can stand"):
        load(Shape(size=("16 m", "16 m"), drawing=drawing))


# ---------------------------------------------------------------------------------------- polygons


def turned(angle, width_m, depth_m, x_m=0.0, y_m=0.0):
    """The corners of a rectangle that is turned around its middle."""
    cos, sin = np.cos(angle), np.sin(angle)
    return [(f"{x_m + cos * x - sin * y:.9f} m", f"{y_m + sin * x + cos * y:.9f} m")
            for x, y in ((-width_m / 2, -depth_m / 2), (width_m / 2, -depth_m / 2),
                         (width_m / 2, depth_m / 2), (-width_m / 2, depth_m / 2))]


@settings(max_examples=30, deadline=None)
@given(st.floats(-3.2, 3.2), st.floats(1.5, 6), st.floats(1.5, 6))
def test_a_turned_block_is_solid_inside_and_free_outside(angle, width_m, depth_m):
    terrain = load(Shape(size=("20 m", "20 m"), polygons=[
        {"points": turned(angle, width_m, depth_m)}]))
    x0, y0, x1, y1 = terrain.solids.T
    area_m2 = ((x1 - x0) * (y1 - y0)).sum()
    assert width_m * depth_m - 0.15 * (width_m + depth_m) < area_m2 <= width_m * depth_m + 1e-3
    assert len(terrain.walls) == 8 and terrain.matter().block.sum() == 4
    assert terrain.clearance(np.array([[0.0, 0.0], [9.0, 9.0]]), 2.0)[0] == -1.0


def test_a_turned_rectangle_is_the_rectangle():
    upright = load(Shape(size=("20 m", "20 m"), rectangles=[{"x": ("-2 m", "2 m"),
                                                             "y": ("-1 m", "1 m")}]))
    polygon = load(Shape(size=("20 m", "20 m"), polygons=[{"points": turned(0.0, 4.0, 2.0)}]))
    assert (polygon.walls == upright.walls).all()
    spec = upright.grid(0.2)
    assert (polygon.truth(spec) == upright.truth(spec)).all()


def test_a_thin_polygon_is_one_wall_to_the_radio():
    wall = load(Shape(size=("20 m", "20 m"), polygons=[
        {"points": turned(0.5, 6.0, 0.15), "material": "brick"}])).matter()
    along, = np.flatnonzero(np.isclose(wall.thickness_m, 0.15))
    assert not wall.block.any()
    x1, y1, x2, y2 = wall.segments[along]
    assert np.hypot(x2 - x1, y2 - y1) == pytest.approx(6.0)
    assert np.arctan2(y2 - y1, x2 - x1) % np.pi == pytest.approx(0.5)


@pytest.mark.parametrize(("points", "line"), [
    ([(-1, 1), (5, 1), (2, 1.1)], (-1.0, 1.05, 5.0, 1.05)),
    ([(2, -3), (2.1, 1), (2, 5)], (2.05, -3.0, 2.05, 5.0))])
def test_a_sliver_is_a_wall_along_the_middle_of_its_box(points, line):
    wall = load(Shape(size=("20 m", "20 m"), polygons=[{
        "points": [(f"{x} m", f"{y} m") for x, y in points]}])).matter()
    along, = np.flatnonzero(np.isclose(wall.thickness_m, 0.1))
    assert wall.segments[along] == pytest.approx(line)


coordinates = st.floats(-9, 9)


@given(st.tuples(coordinates, coordinates), st.tuples(*[coordinates] * 4))
def test_the_distance_from_a_wall_is_that_of_its_nearest_point(point, wall):
    found_m = point_distance(np.array([point]), np.array([wall]))[0, 0]
    places = np.linspace(wall[:2], wall[2:], 2001)
    nearest_m = np.hypot(*(places - point).T).min()
    assert found_m - 1e-9 <= nearest_m <= found_m + math.dist(wall[:2], wall[2:]) / 4000 + 1e-9


def test_the_clearance_on_a_raster_is_that_from_its_solid_cells():
    """A hall of 6 m by 4 m with a block from (3, 1) to (4.5, 2)."""
    free = np.ones((8, 12), bool)
    free[2:4, 6:9] = False
    hall = of_free_cells(Path("hall"), free, 0, 0.5, (0.0, 0.0), 2.0)
    points = np.array([(2.25, 1.5), (3.75, 2.75), (3.75, 0.25), (3.5, 1.5), (0.25, 3.0), (7, 2)])
    assert hall.clearance(points, 2.0) == pytest.approx([0.75, 0.75, 0.25, -1.0, 0.25, -1.0])


@pytest.mark.parametrize("angle", [0.0, 0.001, 0.05, 0.5, 1.57])
def test_a_thin_polygon_is_solid_in_its_middle(angle):
    terrain = load(Shape(size=("20 m", "20 m"), polygons=[{"points": turned(angle, 6.0, 0.15)}]))
    x0, y0, x1, y1 = terrain.solids.T
    assert ((x1 - x0) * (y1 - y0)).sum() > 0.6 * 6.0 * 0.15
    assert terrain.clearance(np.array([[0.0, 0.0]]), 2.0)[0] == -1.0


@pytest.mark.parametrize("y_m", [-50.0, 50.0])
def test_a_polygon_is_solid_to_its_lowest_edge_wherever_it_lies(y_m):
    triangle = np.array([(0.0, 0.0), (3.0, 0.0), (0.0, 2.0)])
    here, there = np.array(strips(triangle)), np.array(strips(triangle + (0.0, y_m)))
    assert there == pytest.approx(here + (0.0, y_m, 0.0, y_m), abs=1e-6)


def test_a_notch_of_a_polygon_stays_free():
    terrain = load(Shape(size=("20 m", "20 m"), centre=("5 m", "0 m"), polygons=[{"points": [
        ("0 m", "0 m"), ("4 m", "0 m"), ("4 m", "4 m"), ("3 m", "4 m"), ("3 m", "1 m"),
        ("1 m", "1 m"), ("1 m", "4 m"), ("0 m", "4 m")]}]))
    assert terrain.bounds == (-5.0, -10.0, 15.0, 10.0)
    assert terrain.clearance(np.array([[2.0, 3.0], [2.0, 0.5], [0.5, 3.0]]), 0.5).tolist() == [
        0.5, -1.0, -1.0]


@pytest.mark.parametrize("shape, complaint", [
    ({"walls": [{"from": ("0 m", "0 m"), "to": ("6 m", "0 m")}]},
     r"walls.0: \(6, 0\) m lies outside the terrain; allowed: x from -5 to 5 m, y from -5 to 5 m"),
    ({"walls": [{"from": ("1 m", "1 m"), "to": ("1 m", "1 m")}]},
     r"walls.0: it starts and ends at \(1, 1\) m"),
    ({"rectangles": [{"x": ("0 m", "1 m"), "y": ("0 m", "9 m")}]},
     r"rectangles.0: \(1, 9\) m lies outside the terrain"),
    ({"rectangles": [{"x": ("0 m", "1 m"), "y": ("0 m", "1 m"), "material": "concret"}]},
     r"rectangles.0.material: unknown material 'concret' \(did you mean 'concrete'\?\); allowed: "),
    ({"polygons": [{"points": [("0 m", "0 m"), ("9 m", "0 m"), ("0 m", "1 m")]}]},
     r"polygons.0: \(9, 0\) m lies outside the terrain"),
    ({"polygons": [{"points": [("0 m", "0 m"), ("0 m", "0 m"), ("0 m", "1 m")]}]},
     r"polygons.0.points: two corners in a row lie at \(0, 0\) m"),
    ({"polygons": [{"points": [("0 m", "0 m"), ("2 m", "0 m"), ("1 m", "0 m")]}]},
     "polygons.0.points: all corners lie on one line"),
])
def test_wrong_shapes(shape, complaint):
    with pytest.raises(InputError, match=f"^environment.terrain.{complaint}"):
        load(Shape(size=("10 m", "10 m"), **shape))


# ------------------------------------------------------------------------------------- map_server


FACTS = {"image": "map.pgm", "resolution": "0.5", "origin": "[-1.0, 2.0, 0.0]", "negate": "0",
         "occupied_thresh": "0.65", "free_thresh": "0.196"}
PIXELS = np.array([[0, 0, 0, 0], [0, 254, 254, 205], [0, 254, 0, 0]], dtype=np.uint8)


def written(folder, pixels=PIXELS, file="map.pgm", **facts):
    (folder / "map.yaml").write_text("".join(
        f"{key}: {value}\n" for key, value in {**FACTS, **facts}.items() if value is not None))
    if pixels is not None:
        Image.fromarray(pixels).save(folder / file)
    return MapFile(map=str(folder / "map.yaml"))


def test_a_map_is_cropped_to_its_free_cells_and_sealed(tmp_path):
    terrain = load(written(tmp_path))
    assert terrain.raster.solid.tolist() == [[True] * 4, [True, False, True, True],
                                             [True, False, False, True], [True] * 4]
    assert terrain.bounds == (-1.0, 1.5, 1.0, 3.5)
    assert len(terrain.walls) == 6
    assert terrain.grid(0.5) == GridSpec(0.5, 4, 4, -1.0, 1.5)
    assert (terrain.truth(terrain.grid(0.5)) == terrain.raster.solid).all()


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), edge_m=st.sampled_from([0.05, 0.1, 0.25, 1 / 3]),
       spec=st.builds(GridSpec, st.sampled_from([0.05, 0.1, 0.2, 0.25, 0.7]), st.integers(1, 30),
                      st.integers(1, 30), st.sampled_from([-1.0, -0.3, 0.05, 0.123]),
                      st.sampled_from([-1.0, -0.3, 0.05, 0.123])))
def test_the_truth_of_cells_is_that_of_their_rectangles(seed, edge_m, spec):
    solid = np.pad(np.random.default_rng(seed).random((8, 11)) < 0.4, 1, constant_values=True)
    terrain = from_raster("cells", Raster(solid, edge_m, -0.3, 0.1), 0, 2.0)
    drawn = replace(terrain, walls=segments([]), raster=None)
    assert (terrain.truth(spec) == drawn.truth(spec)).all()


def test_offset_negate_and_formats(tmp_path):
    plain = load(written(tmp_path))
    moved = load(written(tmp_path).model_copy(update={"offset_m": (10.0, -1.0)}))
    assert moved.bounds == (9.0, 0.5, 11.0, 2.5)
    colour = np.repeat(PIXELS[:, :, None], 3, axis=2)
    for pixels, facts in ((255 - PIXELS, {"negate": "1"}),
                          (colour, {"image": "map.png"}),
                          (np.dstack([colour, np.full_like(PIXELS, 255)]), {"image": "map.png"}),
                          (PIXELS.astype(np.uint16) * 257, {"image": "map.png"})):
        same = load(written(tmp_path, pixels, facts.get("image", "map.pgm"), **facts))
        assert (same.raster.solid == plain.raster.solid).all()
    (tmp_path / "map.pgm").write_bytes(b"P2\n# a comment\n4 3 # another\n255\n"
                                       b"0 0 0 0 0 254 254 205 0 254 0 0\n")
    assert (load(written(tmp_path, None)).raster.solid == plain.raster.solid).all()


@pytest.mark.parametrize("facts", [
    {"origin": "[-1.0, 2.0, .nan]"}, {"origin": "[-1.0, 2.0, -nan]"}, {"mode": "Trinary"},
    {"free_thresh": "0.9", "occupied_thresh": "0.1"}, {"negate": "false"}])
def test_forms_that_ros_loads(tmp_path, facts):
    plain, other = load(written(tmp_path)), load(written(tmp_path, **facts))
    assert (other.raster.solid == plain.raster.solid).all() and other.bounds == plain.bounds


def test_raw_pixels_are_probabilities(tmp_path):
    """Of 0 to 100 %; all else is unknown."""
    raw = np.array([[0, 49, 50], [100, 101, 254]], dtype=np.uint8)
    solid = load(written(tmp_path, raw, mode="raw")).raster.solid
    assert solid.tolist() == [[True] * 4, [True, False, False, True], [True] * 4]


def test_in_scale_mode_a_grey_is_what_is_nearer(tmp_path):
    greys = np.array([[254, 150, 149, 146, 145, 0]], dtype=np.uint8)  # 0.41, 0.42 | 0.43, 0.43
    solid = load(written(tmp_path, greys, mode="scale")).raster.solid
    assert solid[1].tolist() == [True, False, False, False, True]


@pytest.mark.parametrize("turns, yaw", [(1, "1.5707963267948966"), (2, "3.141592653589793"),
                                        (3, "-1.5707963267948966")])
def test_a_quarter_turn_moves_each_cell(tmp_path, turns, yaw):
    plain = load(written(tmp_path, origin="[0, 0, 0]"))
    turned = load(written(tmp_path, origin=f"[0, 0, {yaw}]"))
    assert (turned.raster.solid == np.rot90(plain.raster.solid[::-1], turns)[::-1]).all()
    x0, y0, x1, y1 = plain.bounds
    corners = np.array([(x0, y0), (x1, y1)]) @ np.linalg.matrix_power([[0, 1], [-1, 0]], turns)
    assert turned.bounds == pytest.approx((*corners.min(axis=0), *corners.max(axis=0)))


@settings(max_examples=30, deadline=None)
@given(st.floats(-3.2, 3.2))
def test_a_turned_map_keeps_its_area_and_its_place(yaw):
    with tempfile.TemporaryDirectory() as name:
        pixels = np.zeros((80, 120), np.uint8)
        pixels[20:60, 30:90] = 254
        terrain = load(written(Path(name), pixels, resolution="0.1", origin=f"[3, -2, {yaw}]"))
    free = ~terrain.raster.solid
    assert free.sum() * 0.01 == pytest.approx(24.0, rel=0.02)
    rows, cols = np.nonzero(free)
    middle = (terrain.raster.x_m + 0.1 * (cols.mean() + 0.5),
              terrain.raster.y_m + 0.1 * (rows.mean() + 0.5))
    at = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]) @ (6.0, 4.0)
    half = 0.05  # of a cell: each takes the value of the nearest, alike in all rows at small angles
    assert middle == pytest.approx((3 + at[0], at[1] - 2), abs=half)


def test_what_looks_wrong_is_said(tmp_path):
    doubtful = load(written(tmp_path, free_thresh="0.25"))
    assert doubtful.doubts == (
        f"{tmp_path}/map.yaml: 1 of 4 free cells have the grey value 205, which map savers write "
        "for unknown ground; mode trinary with free_thresh 0.196 leaves them unknown",
        f"{tmp_path}/map.yaml: 2 free cells lie at the edge of map.pgm, which is closed by a wall "
        "there")
    sealed = np.pad(PIXELS[1:, :3], 1)
    assert load(written(tmp_path, sealed)).doubts == ()


def test_links_of_an_installed_map_are_followed(tmp_path):
    """As ``colcon build --symlink-install`` makes them."""
    (source := tmp_path / "source").mkdir()
    (share := tmp_path / "share").mkdir()
    written(source)
    for name in ("map.yaml", "map.pgm"):
        (share / name).symlink_to(source / name)
    assert load(MapFile(map=str(share / "map.yaml"))).raster.solid.shape == (4, 4)


@pytest.mark.parametrize("facts, complaint", [
    ({"origin": "[0.0, 0.0]"}, r"origin must be \[x, y, yaw\]"),
    ({"origin": "[.nan, 0.0, 0.0]"}, "origin must be finite"),
    ({"origin": "[0.0, 0.0, .inf]"}, "origin must be finite"),
    ({"occupied_thresh": "1.5"}, "occupied_thresh must lie between 0 and 1, got 1.5"),
    ({"occupied_thresh": "high"}, "occupied_thresh must be a number, got 'high'"),
    ({"resolution": "0"}, "resolution must be above zero"),
    ({"resolution": None}, "'resolution' is missing"),
    ({"negate": "2"}, "negate must be 0 or 1"),
    ({"mode": "cooked"}, "unknown mode 'cooked'; allowed: trinary, scale, raw"),
    ({"free_thresh": "0.001"}, "no free cell"),
])
def test_wrong_map_files(tmp_path, facts, complaint):
    with pytest.raises(InputError, match=f"^environment.terrain: .*map.*: {complaint}"):
        load(written(tmp_path, **facts))


def test_a_missing_image_names_those_that_are_there(tmp_path):
    map_file = written(tmp_path, file="other.png")
    with pytest.raises(InputError, match="its image 'map.pgm' does not exist; images beside it: "
                                         "other.png; `image:` in the scenario's terrain overrides"):
        load(map_file)
    assert load(map_file.model_copy(update={"image": "other.png"})).raster.solid.shape == (4, 4)


@pytest.mark.parametrize("content", [b"", b"P5\n", b"P5\n4 3\n255\nabc", b"P5\n0 0\n255\n", b"GIF"])
def test_broken_images(tmp_path, content):
    map_file = written(tmp_path)
    (tmp_path / "map.pgm").write_bytes(content)
    with pytest.raises(InputError, match="cannot be read as an image"):
        load(map_file)


def test_a_huge_image_is_refused_before_it_is_decoded(tmp_path):
    map_file = written(tmp_path)
    (tmp_path / "map.pgm").write_bytes(b"P5\n9000 9000\n255\n")
    with pytest.raises(InputError, match="9000 x 9000 pixels are too many"):
        load(map_file)


@pytest.mark.parametrize("text", ["- a list\n", "a: [b\n", "\x00"])
def test_broken_yaml(tmp_path, text):
    map_file = written(tmp_path)
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(InputError, match=r"map\.yaml: "):
        load(map_file)


# ------------------------------------------------------------------- the authors' own SLAM maps


needs_maps = pytest.mark.skipif(not MAPS.is_dir(), reason="the authors' maps are not here")


def testbed(name):
    """A robot of the authors' maps starts at their origin, in the middle of the top left corner
    of the roads (4 m from both walls), so terrain = map + (-36 m, 36 m)."""
    return load(MapFile(map=str(MAPS / f"{name}.yaml"), image=f"{name}.pgm",
                        offset=("-36 m", "36 m")))


testbed.__test__ = False


@needs_maps
@pytest.mark.parametrize("name", BUILTIN)
def test_maps_agree_with_geometry_within_5_percent_of_reachable_area(name):
    """On the map's own raster, where the lines of walls lie between cells."""
    drawn, measured = load(name), testbed(name)
    spec = measured.grid(0.2)
    assert free_m2(measured, spec) == pytest.approx(free_m2(drawn, spec), rel=0.05)
    both = measured.reachable(spec, LINE) & drawn.reachable(spec, LINE)
    least = 0.93 if name == "zigzag" else 0.97  # the drift of zigzag
    assert both.sum() / measured.reachable(spec, LINE).sum() > least


@needs_maps
def test_the_map_whose_image_is_not_there():
    with pytest.raises(InputError, match=r"zigzag.yaml: its image 'map.pgm' does not exist; images "
                       "beside it: cross.pgm, loop.pgm, maze.pgm, scenarios.png, zigzag.pgm"):
        load(MapFile(map=str(MAPS / "zigzag.yaml")))


@needs_maps
def test_maps_are_found_from_a_copy_elsewhere(tmp_path):
    shutil.copy(MAPS / "loop.pgm", tmp_path)
    shutil.copy(MAPS / "loop.yaml", tmp_path)
    assert free_m2(load(MapFile(map=str(tmp_path / "loop.yaml"), offset=("-36 m", "36 m")))) > 2000
