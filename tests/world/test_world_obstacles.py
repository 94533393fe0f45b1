"""Walls that an image shows are to the radio what the same walls are when somebody draws them.

At any angle, in any cells. What bodies and lasers meet is as it was.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.ndimage import binary_dilation

from desim.engine.streams import Streams
from desim.errors import InputError
from desim.scenario.schema.environment import Drawing, Environment, MapFile, Shape
from desim.scenario.schema.fleet import BodyType
from desim.testing import Bench
from desim.world import centre_lines
from desim.world.fleet import RobotSpec
from desim.world.geometry import outline
from desim.world.obstacles import GAP_CELLS, Cells, _faces, crossing, of_cells, toll
from desim.world.plane import Plane
from netmodels.radio.dcf.radio import DcfRadio

HALF_M = 15.0  # a terrain goes from -15 to 15 m, both ways
HOUSE = [(-9, -6, 9, -6), (9, -6, 9, 6), (9, 6, -9, 6), (-9, 6, -9, -6), (-3, -6, -3, 3),
         (3, -3, 3, 6), (-9, 0, -6, 0), (3, 0, 6, 0)]


def turned(rows, degrees):
    """[n, 4] m."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    ends = np.array(rows, float).reshape(-1, 2)
    return (ends @ np.array([[c, s], [-s, c]])).reshape(-1, 4)


def shown(walls, edge_m, thick_m):
    """[rows, cols] bool: the cells whose middle is in walls that are so thick."""
    at = (np.arange(round(2 * HALF_M / edge_m)) + 0.5) * edge_m - HALF_M
    x, y = np.meshgrid(at, at)
    solid = np.zeros(x.shape, bool)
    for x1, y1, x2, y2 in walls:
        length = math.hypot(x2 - x1, y2 - y1)
        ux, uy = (x2 - x1) / length, (y2 - y1) / length
        along, aside = (x - x1) * ux + (y - y1) * uy, (y - y1) * ux - (x - x1) * uy
        solid |= ((along > -thick_m / 2) & (along < length + thick_m / 2)
                  & (np.abs(aside) <= thick_m / 2))
    solid[[0, -1]] = solid[:, [0, -1]] = True
    return solid


def plane(terrain):
    spec = RobotSpec("robot_0", BodyType(), 0.0, 0.0, 0.0, snap=True)
    return Plane(Environment(terrain=terrain), [spec], Fraction(60), Streams(1))


def drawn(walls, **kind):
    return plane(Shape(size=(f"{2 * HALF_M} m", f"{2 * HALF_M} m"), walls=[
        {"from": (f"{a!r} m", f"{b!r} m"), "to": (f"{c!r} m", f"{d!r} m"), **kind}
        for a, b, c, d in np.round(walls, 6).tolist()]))


def written(folder, pixels, edge_m, **facts):
    """A map of ``pixels`` [rows, cols], the lowest row first."""
    Image.fromarray(pixels[::-1]).save(folder / "map.png")
    facts = {"image": "map.png", "resolution": edge_m, "origin": f"[{-HALF_M}, {-HALF_M}, 0]",
             "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196, **facts}
    (folder / "map.yaml").write_text("".join(f"{key}: {value}\n" for key, value in facts.items()))
    return MapFile(map=str(folder / "map.yaml"))


def grey(solid):
    return np.where(solid, 0, 254).astype(np.uint8)


# ------------------------------------------------------------------------------------ what it costs


def coverage(world, degrees):
    """The share of places in the open around, at which 90 % of packets from a room arrive."""
    radio = DcfRadio(DcfRadio.Params(path_loss={"reference": "40 dB"}))
    bench = Bench(radio, 1)
    bench.medium._place.obstacles = world.obstacles()
    at = (np.arange(140) + 0.5) * 0.2 - 14.0
    points = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    sender = turned([(-4.5, -2, 0, 0)], degrees)[0, :2]
    return (radio.signal(sender, points).delivery >= 0.9).mean()


def rooms(door_m):
    """Four rooms with doors of this width: rows of walls."""
    half = door_m / 2
    inner = [(x, y1, x, y2) for x, middle in ((-4, -2.35), (1, 3.15), (5, 0.85))
             for y1, y2 in ((-6, middle - half), (middle + half, 6))]
    return [*HOUSE[:4], *inner, (-9, 2, -4, 2), (5, -3, 9, -3)]


@pytest.mark.parametrize("degrees", [0, 30, 45])
@pytest.mark.parametrize("edge_m", [0.05, 0.1])
def test_rooms_with_doors_and_their_image_cover_the_same(tmp_path, degrees, edge_m):
    """An image's walls end half their thickness later, and doors are narrower by that."""
    image = plane(written(tmp_path, grey(shown(turned(rooms(1.2), degrees), edge_m, 0.2)), edge_m))
    assert coverage(image, degrees) == pytest.approx(
        coverage(drawn(turned(rooms(1.0), degrees)), degrees), rel=0.02)


@pytest.mark.parametrize("degrees", [0, 30, 45])
@pytest.mark.parametrize(("edge_m", "thick_m", "within"), [(0.05, 0.2, 0.02), (0.1, 0.2, 0.02),
                                                           (0.1, 0.3, 0.02), (0.2, 0.2, 0.03)])
def test_a_house_and_its_image_cover_the_same(tmp_path, degrees, edge_m, thick_m, within):
    walls = turned(HOUSE, degrees)
    image = plane(written(tmp_path, grey(shown(walls, edge_m, thick_m)), edge_m))
    assert coverage(image, degrees) == pytest.approx(coverage(drawn(walls), degrees), rel=within)


def office(door_m):
    """An L with a corridor, T and X junctions, an oblique wall and seven doors of this width."""
    rows = [(-10, -5, 10, -5), (10, -5, 10, 1), (10, 1, 4, 1), (4, 1, 4, 7), (4, 7, -10, 7),
            (-10, 7, -10, -5), (-3.3, -5, -3.3, -1)]
    for x1, y1, x2, y2, doors in ((-10, 1, 4, 1, (2.2, 8.0, 12.1)), (-5, 1, -5, 7, (4.0,)),
                                  (-10, -1, 10, -1, (3.1, 9.7, 16.0)), (0, 1, 0, 7, (1.5,)),
                                  (2, -5, 4.5, -1, (2.2,))):
        length = math.hypot(x2 - x1, y2 - y1)
        ends = [0.0, *(door + side * door_m / 2 for door in doors for side in (-1, 1)), length]
        rows += [(x1 + (x2 - x1) * begin / length, y1 + (y2 - y1) * begin / length,
                  x1 + (x2 - x1) * end / length, y1 + (y2 - y1) * end / length)
                 for begin, end in zip(ends[::2], ends[1::2], strict=True)]
    return rows


def covered(world, degrees):
    """[senders, places] bool: with the radio's defaults, from six places in the office."""
    radio = DcfRadio(DcfRadio.Params())
    bench = Bench(radio, 1)
    bench.medium._place.obstacles = world.obstacles()
    at = (np.arange(140) + 0.5) * 0.2 - 14.0
    points = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    senders = turned([(-7, 0, 1, 0), (-8, 5, 7, -3), (-4, -3.5, 2, 4)], degrees).reshape(-1, 2)
    return np.array([radio.signal(sender, points).delivery >= 0.9 for sender in senders])


def more(tmp_path, degrees, edge_m, thick_m):
    """By which share the office's image covers more than the drawing, off the walls' matter."""
    walls = turned(office(0.9 + thick_m), degrees)
    near = shown(walls, 0.2, thick_m + 0.1)[5:-5, 5:-5].ravel()
    image = covered(plane(written(tmp_path, grey(shown(walls, edge_m, thick_m)), edge_m)), degrees)
    drawing = covered(drawn(turned(office(0.9), degrees)), degrees)
    return image[:, ~near].sum() / drawing[:, ~near].sum() - 1


@pytest.mark.parametrize("degrees", [0, 30, 45])
@pytest.mark.parametrize(("edge_m", "thick_m"), [(0.05, 0.3), (0.1, 0.2), *(
    pytest.param(*sizes, marks=pytest.mark.validation)  # between these
    for sizes in ((0.05, 0.2), (0.1, 0.3)))])
def test_an_office_and_its_image_cover_the_same(tmp_path, degrees, edge_m, thick_m):
    assert abs(more(tmp_path, degrees, edge_m, thick_m)) < 0.02


def test_with_walls_that_end_too_early_it_covers_more(tmp_path, monkeypatch):
    """As thinning leaves them."""
    monkeypatch.setattr(centre_lines, "_led_on", lambda chain, wall: chain)
    assert more(tmp_path, 30, 0.05, 0.3) > 0.03


def test_with_all_faces_counted_it_covers_less(tmp_path):
    walls = turned(HOUSE, 30)
    image = plane(written(tmp_path, grey(shown(walls, 0.1, 0.2)), 0.1))
    faces, known = image.terrain.walls, image._matter
    image.__dict__["_matter"] = known._replace(
        segments=faces, crossing=crossing,
        **{name: np.resize(getattr(known, name), len(faces))
           for name in ("material", "thickness_m", "height_m", "block")})
    assert coverage(image, 30) < 0.8 * coverage(drawn(walls), 30)


# --------------------------------------------------------------------------- junction by junction

JUNCTIONS = {"L": [(-4, 0, 0, 0), (0, 0, 0, -4)], "T": [(-4, 0, 4, 0), (0, 0, 0, -4)],
             "X": [(-4, 0, 4, 0), (0, 4, 0, -4)], "oblique T": [(-4, 0, 4, 0), (0, 0, 3, -4)],
             "oblique X": [(-4, 0, 4, 0), (-2, 4, 2, -4)], "bend": [(-4, 0, 0, 0), (0, 0, 3, 2)],
             "Y": [(-4, 0, 0, 0), (0, 0, 2, 3.5), (0, 0, 2, -3.5)], "end": [(-4, 0, 0, 0)]}


def both_counts(junction, degrees, edge_m, thick_m):
    """[lines] what the image and what the drawing count, on lines from the open to the open that
    leave the junction at least a cell aside."""
    walls = turned(JUNCTIONS[junction], degrees)
    solid = shown(walls, edge_m, thick_m)
    last = thick_m / 2 if junction == "end" else 0.0  # that is how ``shown`` shows ends
    lines, centre = turned([(-4, 0, last, 0)], degrees), turned([(last, 0, 0, 0)], degrees)[0, :2]
    drawing = np.concatenate([lines, walls[1:]]) if last else walls
    draw = np.random.default_rng(7)
    way, aside_m = draw.uniform(0, 2 * math.pi, 3000), draw.uniform(edge_m, 1.0, 3000)
    along = np.stack([np.cos(way), np.sin(way)], axis=1)
    across = np.stack([-np.sin(way), np.cos(way)], axis=1) * aside_m[:, None]
    lines = np.concatenate([centre + across - 3 * along, centre + across + 3 * along], axis=1)
    col, row = ((lines.reshape(-1, 2) + HALF_M) / edge_m).astype(int).T
    lines = lines[~solid[row, col].reshape(-1, 2).any(axis=1)]
    image = of_cells(solid, 1, edge_m, (-HALF_M, -HALF_M), 2.0)
    return [np.bincount(found[:, 0], minlength=len(lines)) for found in (
        image.crossing(image.segments, lines), crossing(drawing, lines))]


@pytest.mark.parametrize("junction", JUNCTIONS)
@pytest.mark.parametrize(("edge_m", "thick_m"), [(0.05, 0.3), (0.1, 0.2), *(
    pytest.param(*sizes, marks=pytest.mark.validation)  # between these
    for sizes in ((0.05, 0.2), (0.1, 0.3)))])
def test_an_image_counts_what_the_drawing_counts(junction, edge_m, thick_m):
    for degrees in 0, 30, 45:
        image, drawing = both_counts(junction, degrees, edge_m, thick_m)
        # Of the oblique T the stem's corner sticks out on the other side.
        assert (image != drawing).mean() < (0.045 if junction == "oblique T" else 0.005)
        assert len(image) > 2000


@pytest.mark.parametrize("junction", ["L", "T", "X", "oblique T", "oblique X", "Y"])
def test_where_a_stretch_of_cells_is_one_wall_it_counts_less(junction, monkeypatch):
    monkeypatch.setattr(centre_lines, "_posts", lambda wall, skeleton, away: wall)
    image, drawing = both_counts(junction, 30, 0.05, 0.3)
    assert (image < drawing).mean() > 0.02


def test_where_thinning_has_the_last_word_walls_end_too_early(monkeypatch):
    monkeypatch.setattr(centre_lines, "_led_on", lambda chain, wall: chain)
    image, drawing = both_counts("end", 30, 0.05, 0.3)
    assert (image < drawing).mean() > 0.02


def test_ragged_walls_count_once():
    """As laser mapping leaves them: with holes, bumps and specks. 3 % of the lines meet a speck."""
    draw = np.random.default_rng(1)
    for degrees in 0, 17, 45:
        for cells in 1.5, 3.0, 5.0:
            solid = shown(turned([(-12, 0, 12, 0)], degrees), 0.05, cells * 0.05)
            beside = binary_dilation(solid, np.ones((3, 3))) & ~solid
            solid = solid & (draw.random(solid.shape) > 0.08)
            solid |= beside & (draw.random(solid.shape) < 0.15)
            matter = of_cells(solid, 1, 0.05, (-HALF_M, -HALF_M), 2.0)
            x, to = draw.uniform(-9, 9, 500), draw.uniform(-1, 1, 500)
            lines = turned(np.stack([x, np.full(500, -2.0), x + to, np.full(500, 2.0)], 1), degrees)
            counts = np.bincount(matter.crossing(matter.segments, lines)[:, 0], minlength=500)
            assert (counts == 1).mean() > 0.9


def test_a_post_counts_once_from_everywhere():
    matter = of_cells(shown([(-0.001, 0.2, 0.001, 0.2)], 0.05, 0.4), 1, 0.05, (-HALF_M, -HALF_M),
                      2.0)
    across = np.concatenate([turned([(-2, 0, 2, 0)], degrees) for degrees in range(0, 180, 7)])
    counts = np.bincount(matter.crossing(matter.segments, across + (0.01, 0.21) * 2)[:, 0])
    assert (counts == 1).all() and len(counts) == len(across)


slant = st.floats(0, 180)


@settings(max_examples=60, deadline=None)
@given(slant, st.floats(45, 135), st.floats(-3, 3), st.sampled_from([0.1, 0.2, 0.25]),
       st.floats(1.5, 4.5))
def test_a_wall_counts_once_at_any_angle(degrees, against, aside_m, edge_m, cells):
    """At 45 degrees and more to it; beside its ends nothing does."""
    wall = turned([(-8, 0, 8, 0)], degrees)
    matter = of_cells(shown(wall, edge_m, min(cells * edge_m, 0.9)), 1, edge_m,
                      (-HALF_M, -HALF_M), 2.0)
    line = turned([(-2, 0, 2, 0)], against)
    both = turned(np.concatenate([line + (aside_m, 0) * 2, line + (11.5, 0) * 2]), degrees)
    assert matter.crossing(matter.segments, both)[:, 0].tolist() == [0]


@pytest.mark.parametrize(("thick_m", "counts"), [(0.2, 1), (0.9, 1), (1.3, 2), (6.0, 2)])
@pytest.mark.parametrize("edge_m", [0.05, 0.1])
def test_a_block_counts_where_a_line_goes_in_and_comes_out(tmp_path, thick_m, counts, edge_m):
    solid = shown([(-3, 0, 3, 0)], edge_m, thick_m)
    image = plane(written(tmp_path, grey(solid), edge_m))
    low, high = f"{-thick_m / 2} m", f"{thick_m / 2} m"
    block = plane(Shape(size=("30 m", "30 m"), rectangles=[{"x": ("-3 m", "3 m"),
                                                            "y": (low, high)}]))
    lines = np.array([(0.03, -8, 0.03, 8), (-1, 8, 1.5, -8), (-8, 4, 8, 4.2)])
    for world in image, block:
        found = world.obstacles().crossings(lines)[:, 0]
        assert np.bincount(found, minlength=3).tolist() == [counts, counts, 0]
        assert (world.obstacles().block[world.obstacles().crossings(lines)[:, 1]]
                == (counts == 2)).all()


def test_a_drawing_of_small_blocks_is_walls():
    lines = [" " * 30] * 12 + [" " * 8 + "#" * 14 + " " * 8] + [" " * 30] * 17
    world = plane(Shape(size=("15 m", "15 m"), drawing=Drawing(cell="0.5 m", style="blocks",
                                                               lines=lines)))
    across = np.array([(0.1, -5.0, 0.3, 6.0), (-9.0, 0.0, 0.0, 0.0)])
    found = world.obstacles().crossings(across)
    assert found[:, 0].tolist() == [0, 1], "the bounds stand behind the cells"
    assert len(world.terrain.walls) == 8


def test_from_inside_there_is_one_way_out(tmp_path):
    matter = of_cells(shown([(-3, 0, 3, 0)], 0.1, 6.0), 1, 0.1, (-HALF_M, -HALF_M), 2.0)
    lines = np.array([(0, 0, 0, 8), (0, 8, 0, 0), (0, 0, 1, 1)], float)
    assert matter.crossing(matter.segments, lines)[:, 0].tolist() == [0, 1]


def test_what_is_no_longer_than_it_is_thick_is_a_post():
    """The way between the ends of its middle line counts, three cells thick."""
    wall = np.zeros((5, 20), bool)
    wall[1:4, 1:7] = wall[1:4, 9:16] = True
    middle = np.zeros_like(wall)
    middle[2, 2:6] = middle[2, 10:15] = True  # 3 and 4 cells from end to end
    posts = centre_lines._posts(wall, middle, np.where(middle, 2, 1))
    assert posts[:, :8].sum() == 18 and not posts[:, 8:].any()


def test_walls_are_as_thick_as_they_are_shown():
    """To half a cell."""
    for thick_m in 0.2, 0.3, 0.6, 0.8:
        for degrees in 0, 30, 45:
            wall = turned([(-8, 0, 8, 0)], degrees)
            matter = of_cells(shown(wall, 0.05, thick_m), 1, 0.05, (-HALF_M, -HALF_M), 2.0)
            across = turned([(1, -4, 1, 4)], degrees)
            _, (face,) = matter.crossing(matter.segments, across).T
            assert matter.thickness_m[face] == pytest.approx(thick_m, abs=0.06)


# ----------------------------------------------------------------------------------- cell by cell


def counted(kinds, line, gap):
    """Posts once and blocks twice, from the cells that a line is in."""
    x, y, dx, dy = line[0], line[1], line[2] - line[0], line[3] - line[1]
    spans = []
    for row, col in zip(*np.nonzero(kinds), strict=True):
        begin, end = 0.0, 1.0
        for start, way, low in ((x, dx, col), (y, dy, row)):
            ends = sorted(((low - start) / way, (low + 1 - start) / way))
            begin, end = max(begin, ends[0]), min(end, ends[1])
        if begin < end:
            spans.append((begin, end, row, col))
    found, last_end, length = [], None, math.hypot(dx, dy)
    for begin, end, row, col in sorted(spans):
        kind = int(kinds[row, col])
        if not found or kind != found[-1] or (begin - last_end) * length >= gap:
            found.append(kind)
        last_end = end
    return sum(2 - kind % 2 for kind in found)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_stretches_are_those_of_geometry(seed):
    draw = np.random.default_rng(seed)
    kinds = np.pad(draw.integers(1, 7, (9, 14)) * (draw.random((9, 14)) < 0.35), 1).astype(np.int8)
    keys, faces, _ = _faces(kinds)
    cells = Cells(kinds, keys, np.array([0.75, -2.25]), 0.25)
    lines = draw.uniform(-0.5, 16.5, (40, 4))  # ends are outside of what is solid
    lines[:, [1, 3]] = draw.uniform(-1, 12, (40, 2))
    ends = lines.reshape(-1, 2).astype(int)
    inside = ((ends[:, 1] < 11) & (ends[:, 0] < 16)
              & (kinds[ends[:, 1].clip(0, 10), ends[:, 0].clip(0, 15)] > 0)).reshape(-1, 2)
    lines = lines[~inside.any(axis=1)]
    pairs = lines * 0.25 + np.tile(cells.origin_m, 2)
    segments = faces * 0.25 + np.tile(cells.origin_m, 2)
    found = np.bincount(cells(segments, pairs)[:, 0], minlength=len(pairs))
    assert found.tolist() == [counted(kinds, line, GAP_CELLS) for line in lines]
    back = cells(segments, np.roll(pairs, 2, axis=1))
    assert back.tolist() == cells(segments, pairs).tolist(), "either direction"


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_faces_of_one_kind_are_the_outline(seed):
    solid = np.pad(np.random.default_rng(seed).random((7, 9)) < 0.4, 1)
    _, faces, _ = _faces(solid.astype(np.int8))
    length = np.abs(faces[:, 2:] - faces[:, :2]).sum()
    assert length == (outline(solid)[:, 2:] - outline(solid)[:, :2]).sum()


# --------------------------------------------------------------------------------------- materials


def two_walls():
    """One of grey 0 and one of grey 40, before a border of grey 0."""
    pixels = grey(shown([(-5, -9, -5, 9)], 0.1, 0.2))
    pixels[shown([(5, -9, 5, 9)], 0.1, 0.2) & (pixels > 0)] = 40
    return pixels


def made_of(world):
    """The materials on a line through both walls."""
    obstacles = world.obstacles()
    found = obstacles.crossings(np.array([(-9.0, 0.3, 9.0, 0.1)]))[:, 1]
    return sorted(obstacles.materials[row] for row in obstacles.material[found])


def test_materials_by_grey_value(tmp_path):
    map_file = written(tmp_path, two_walls(), 0.1)
    assert made_of(plane(map_file)) == ["concrete", "concrete"]
    assert made_of(plane(map_file.model_copy(update={"material": "wood"}))) == ["wood", "wood"]
    named = written(tmp_path, two_walls(), 0.1, materials="{0: brick, 40: glass}")
    assert made_of(plane(named)) == ["brick", "glass"]
    negative = written(tmp_path, 255 - two_walls(), 0.1, negate=1, materials="{255: brick, "
                                                                             "215: glass}")
    assert made_of(plane(negative)) == ["brick", "glass"]


def test_bodies_and_lasers_meet_what_they_met(tmp_path):
    plain, named = (plane(written(tmp_path, two_walls(), 0.1, **facts)) for facts in (
        {}, {"materials": "{0: brick, 40: glass}"}))
    assert np.array_equal(plain.terrain.raster.solid, named.terrain.raster.solid)
    assert np.array_equal(plain.terrain.walls, named.terrain.walls)
    assert np.array_equal(plain.terrain.solids, named.terrain.solids)
    for world in plain, named:
        for half_s in range(30):
            world.command(0, 1.0, 0.0, 0.0)
            world.advance(half_s * 500_000_000)
    scans = [world.scan(world.snapshot(), np.array([0]), 0) for world in (plain, named)]
    assert np.array_equal(*scans) and np.array_equal(plain.snapshot().poses, named.snapshot().poses)
    assert plain.contacts() == named.contacts() != []


@pytest.mark.parametrize(("materials", "complaint"), [
    ("{0: brick}", r"map\.png: occupied cells of grey value 40 \(row 6\d, column 2\d\d; \d+ cells "
                   r"in all\) have no material; materials of map\.yaml has 0 "),
    ("{0: brick, 40: glas}", r"map\.yaml: materials\.40: unknown material 'glas' \(did you mean "
                             r"'glass'\?\); allowed: brick, "),
    ("{0: brick, 40: [1]}", r"map\.yaml: materials\.40: unknown material \[1\]; allowed: "),
    ("{0: brick, 40: glass, 254: wood}", r"map\.yaml: materials\.254: map\.png has free cells of "
                                         "this grey value; only what is occupied or unknown"),
    ("glass", r"map\.yaml: materials must name a material by grey value, as in \{0: concrete, "
              r"40: glass\}, got 'glass'"),
    ("{dark: glass}", r"map\.yaml: materials must name a material by grey value"),
])
def test_wrong_materials(tmp_path, materials, complaint):
    with pytest.raises(InputError, match=f"^environment.terrain: .*{complaint}"):
        plane(written(tmp_path, two_walls(), 0.1, materials=materials))


def test_an_unknown_material_of_the_whole_map(tmp_path):
    map_file = written(tmp_path, two_walls(), 0.1).model_copy(update={"material": "brik"})
    with pytest.raises(InputError, match=r"^environment\.terrain\.material: unknown material "
                                         r"'brik' \(did you mean 'brick'\?\)"):
        plane(map_file)


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(0, 60), st.integers(1, 300), st.floats(0.0, 60.0))
def test_a_toll_is_the_sum_of_what_is_crossed_unless_it_is_too_much(seed, walls, lines, limit):
    draw = np.random.default_rng(seed)
    segments, pairs = draw.uniform(-20, 20, (walls, 4)), draw.uniform(-20, 20, (lines, 4))
    cost, most = draw.uniform(0, 12, walls), draw.uniform(0, limit, lines)
    line, wall = crossing(segments, pairs).T
    whole = np.bincount(line, cost[wall], lines)
    paid = toll(segments, pairs, cost, most)
    cheap = whole <= most
    assert (paid[cheap] == whole[cheap]).all()
    assert (paid[~cheap] > most[~cheap] * (1 - 1e-12)).all() and (paid <= whole + 1e-9).all()
