"""Floor plans in SVG."""

import math

import numpy as np
import pytest

from desim.errors import InputError
from desim.imports.terrains import svg, svg_path, svg_style
from desim.imports.terrains.areas import Area, trapezoids
from desim.imports.terrains.found import Choices
from desim.imports.terrains.read import read_terrain

LINES = "{} dark lines are walls as thick as they are drawn, {} dark shapes are solid"
HEAD = "<svg xmlns='http://www.w3.org/2000/svg' width='20000mm' viewBox='0 0 2000 1000'>"


def read(folder, body, head=HEAD, **choices):
    file = folder / "a.svg"
    file.write_text(f"{head}{body}</svg>")
    return read_terrain(file, Choices(**choices))[1]


def walls(found):
    return [(*wall.start_m, *wall.end_m, wall.thickness_m) for wall in found.source.walls]


def corners(found):
    return [list(polygon.points_m) for polygon in found.source.polygons]


def test_lines_are_walls_and_dark_shapes_are_blocks(tmp_path):
    """A unit is 1 cm, and y points up."""
    found = read(tmp_path, """
        <line x1='0' y1='0' x2='100' y2='0' stroke='black' stroke-width='12'/>
        <g transform='translate(100,100) rotate(90)' style='stroke:#222;stroke-width:20'>
          <polyline points='0,0 100,0 100,50' fill='none'/></g>
        <rect x='300' y='100' width='50' height='40'/>
        <text x='1' y='1'>Kitchen</text><line x1='0' y1='0' x2='9' y2='9' stroke='#ccc'/>
        <rect x='500' y='0' width='10' height='10' display='none'/>""")
    assert walls(found) == [(0.0, 0.0, 1.0, 0.0, 0.12), (1.0, -1.0, 1.0, -2.0, 0.2),
                            (1.0, -2.0, 0.5, -2.0, 0.2)]
    assert corners(found) == [[(3.0, -1.0), (3.5, -1.0), (3.5, -1.4), (3.0, -1.4)]]
    assert found.notes == ("a unit is 0.01 m, as the width 20000mm says (--scale)",
                           LINES.format(2, 1), "left out: 1 texts, 1 hidden elements, 1 pale lines")


@pytest.mark.parametrize("shape, solid", [
    ("<rect width='9' height='9' fill='none'/>", 0), ("<rect width='9' height='9'/>", 1),
    ("<rect width='9' height='9' fill='#fff'/>", 0), ("<rect width='9' height='9' fill='red'/>", 1),
    ("<rect width='9' height='9' fill='rgb(0,0,0)' fill-opacity='.2'/>", 0),
    ("<g opacity='50%'><rect width='9' height='9' opacity='0.4'/></g>", 0),
    ("<g opacity='0.5'><rect width='9' height='9' fill='black'/></g>", 1),
    ("<rect width='9' height='9' fill='url(#pattern)'/>", 0),
    ("<style>.w{fill:none}</style><rect class='w' width='9' height='9'/>", 0),
    ("<style>rect, .x {fill: white}</style><rect width='9' height='9' style='fill:navy'/>", 1),
    ("<g visibility='hidden'><rect width='9' height='9'/></g>", 0),
    ("<defs><rect id='a' width='9' height='9'/></defs><use href='#a' x='20'/>", 1),
    ("<circle r='20'/>", 1), ("<ellipse rx='20' ry='0'/>", 0), ("<clipPath><rect/></clipPath>", 0),
])
def test_which_shapes_are_solid(tmp_path, shape, solid):
    found = read(tmp_path, f"<line x2='100' stroke='black'/>{shape}")
    assert (len(found.source.walls), len(found.source.polygons)) == (1, solid)


def test_rooms_painted_on_a_dark_house_are_free(tmp_path):
    found = read(tmp_path, """<rect width='1000' height='1000' fill='#333'/>
        <rect x='100' y='100' width='800' height='800' fill='white'/>""")
    area = sum(np.ptp([x for x, _ in ring]) * np.ptp([y for _, y in ring])
               for ring in corners(found))
    assert area == pytest.approx(100.0 - 64.0) and len(corners(found)) == 4


def test_pale_lines_are_walls_where_none_is_dark(tmp_path):
    """As for a dark page: of a variable what counts without it, of rgba its share."""
    pale = """
        <rect x='0' y='0' width='400' height='300' fill='var(--floor, rgba(255,255,255,0.02))'
          stroke='var(--wall, rgba(255, 255, 255, 0.7))' stroke-width='4'/>
        <line x1='200' y1='0' x2='200' y2='150' stroke='#ccc' stroke-width='4'/>
        <line x1='0' y1='9' x2='9' y2='9' stroke='rgba(255,255,255,0.2)'/>"""
    found = read(tmp_path, pale)
    assert len(walls(found)) == 5 and walls(found)[-1] == (2.0, 0.0, 2.0, -1.5, 0.04)
    assert found.notes[1:] == (
        "2 pale lines, as none is dark, are walls as thick as they are drawn, 0 dark shapes are "
        "solid",)
    found = read(tmp_path, pale + "<line x2='9' stroke='rgb(0 0 0 / 80%)'/>"
                 "<line x2='9' stroke='var(--wall)'/><line x2='9' stroke='lab(9 9 9)'/>")
    assert len(walls(found)) == 1 and found.notes[1:] == (
        LINES.format(1, 0), "left out: 2 colours that cannot be read, 2 pale lines")


def test_a_door_painted_over_a_wall_is_open(tmp_path):
    """But a room beside it, whose pale ground covers half of the line's width, leaves the wall."""
    found = read(tmp_path, """<rect width='50' height='9' y='-4' fill='#eee'/>
        <line x2='1000' stroke='#000' stroke-width='8'/><rect y='0' width='1000' height='500'
        fill='#eee'/><rect x='200' y='-6' width='100' height='12' fill='#eee'/>""")
    assert [(x1, x2) for x1, _, x2, _, _ in walls(found)] == [(0.0, 2.0), (3.0, 10.0)]


@pytest.mark.parametrize("ends", [(1, 14), (14, 1)])
@pytest.mark.parametrize("aside", [-12, -2, 2, 12])
@pytest.mark.parametrize("axis", ["xy", "yx"])
def test_doors_are_open_wherever_the_wall_begins(tmp_path, ends, aside, axis):
    """A wall of 13 m along x or y, this far from the axis, with doors of 1 m near both its ends."""
    along, across = axis
    size = {"x": "width", "y": "height"}
    found = read(tmp_path, f"""<line {along}1='{100 * ends[0]}' {along}2='{100 * ends[1]}'
        {across}1='{100 * aside}' {across}2='{100 * aside}' stroke='#000' stroke-width='8'/>"""
        + "".join(f"""<rect {along}='{start}' {across}='{100 * aside - 6}' {size[along]}='100'
            {size[across]}='12' fill='#eee'/>""" for start in (200, 1200)))
    lengths = sorted(math.dist(wall[:2], wall[2:4]) for wall in walls(found))
    assert lengths == pytest.approx([1.0, 1.0, 9.0])


def test_walls_drawn_as_one_path_with_a_hole(tmp_path):
    for rule in ("fill-rule='evenodd' d='M0 0h1000v1000h-1000z M100 100h800v800h-800z'",
                 "d='M0 0h1000v1000h-1000z M100 100v800h800v-800z'"):
        found = read(tmp_path, f"<path {rule}/>")
        truth = found.terrain.truth(grid := found.terrain.grid(0.1))
        assert truth[grid.cell(5.0, -5.0)[::-1]] == 0 and truth[grid.cell(0.5, -5.0)[::-1]] == 1


def test_an_area_is_cut_as_it_is_large():
    """A triangle with a square hole, half covered by another square."""
    area = Area((((0.0, 0.0), (10.0, 0.0), (5.0, 10.0)), ((4.0, 1.0), (4.0, 3.0), (6.0, 3.0),
                                                        (6.0, 1.0))), even_odd=True)
    over = Area((((4.5, 0.0), (5.5, 0.0), (5.5, 2.0), (4.5, 2.0)),))

    def size(ring):
        return abs(sum(x1 * y2 - x2 * y1 for (x1, y1), (x2, y2) in zip(
            ring, [*ring[1:], ring[0]], strict=True))) / 2

    assert sum(map(size, trapezoids(area, []))) == pytest.approx(50 - 4)
    assert sum(map(size, trapezoids(area, [over]))) == pytest.approx(50 - 4 - 1)


@pytest.mark.parametrize("data, chains", [
    ("M1,2 3-4l.5.5z", [([(1, 2), (3, -4), (3.5, -3.5)], True)]),
    ("m1 1h2v3H0V0 M5e0 5 L6 6", [([(1, 1), (3, 1), (3, 4), (0, 4), (0, 0)], False),
                                  ([(5, 5), (6, 6)], False)]),
    ("M0 0h1z l2 2", [([(0, 0), (1, 0)], True), ([(0, 0), (2, 2)], False)]),
])
def test_straight_paths(data, chains):
    assert svg_path.chains(data) == chains


@pytest.mark.parametrize("data, on_it", [
    ("M1 0A1 1 0 0 1-1 0", lambda x, y: math.hypot(x, y) == pytest.approx(1) and y >= -1e-9),
    ("M1 0a1 1 0 01-2 0", lambda x, y: math.hypot(x, y) == pytest.approx(1) and y >= -1e-9),
    ("M1 0A1 1 0 1 0 0 1", lambda x, y: math.hypot(x, y) == pytest.approx(1)),
    ("M2 0A2 1 0 0 0 0 -1", lambda x, y: math.hypot(x / 2, y) == pytest.approx(1)),
    ("M0 0Q1 2 2 0", lambda x, y: y == pytest.approx(2 * x - x * x)),
    ("M0 0Q1 2 2 0T4 0", lambda x, y: y == pytest.approx(2 * x - x * x if x < 2 else
                                                         (x - 2) * (x - 4))),
    ("M0 0C1 0 2 0 3 0S4 0 5 0", lambda x, y: y == 0.0 and 0.0 <= x <= 5.0),
])
def test_curves_lie_where_they_should(data, on_it):
    chain, = svg_path.chains(data)
    assert len(chain.points) > 9 and all(on_it(x, y) for x, y in chain.points)


@pytest.mark.parametrize("head, body, choices, complaint", [
    ("<svg viewBox='0 0 800 600'>", "", {}, ": the drawing does not say how long its units are; "
     "give the length of one of its units in m, as in --scale 0.01 (it is 800 units wide)"),
    ("<svg width='210mm' viewBox='0 0 210 297'>", "", {}, ": the drawing is 0.21 m wide, as on "
     "paper; give the length of one of its units in m, as in --scale 0.01 (it is 210 units wide)"),
    (HEAD, "\n<path d='M0 0L1'/>", {}, ":2: <path>: the path data end where a number must stand"),
    (HEAD, "\n<path d='M0 0LX1 2'/>", {}, ":2: <path>: a number must stand in the path data at "
                                          "'X1 2'"),
    (HEAD, "\n<g transform='rotate(x)'/>", {}, ":2: <g>: transform rotate(x) cannot be read"),
    (HEAD, "<text>no walls</text>", {}, ": no wall and no block found; a unit "
     "is 0.01 m, as the width 20000mm says (--scale); 0 dark lines are walls as thick as they are "
     "drawn, 0 dark shapes are solid; left out: 1 texts"),
    (HEAD, "<line x2='1e30' stroke='#000'/>", {}, ": (1e+28, 0) m is too far away; is the scale "
                                                  "right? (--scale)"),
    (HEAD, "<line x2='5000000' stroke='#000'/>", {}, ": 50000 m by 0 m; allowed: at most 10000 m a "
                                                     "side; is the scale right? (--scale)"),
])
def test_wrong_drawings(tmp_path, head, body, choices, complaint):
    with pytest.raises(InputError) as error:
        read(tmp_path, body, head, **choices)
    assert str(error.value) == f"{tmp_path / 'a.svg'}{complaint}"


LAYERS = """<g inkscape:groupmode='layer' inkscape:label='Walls'><line x2='900' stroke='#000'/></g>
<g inkscape:groupmode='layer' inkscape:label='Sofas'><circle id='sofa' r='50'/></g>"""


def test_layers(tmp_path):
    found = read(tmp_path, LAYERS)
    assert found.notes[-1] == ("layers: Walls, Sofas; --level NAME takes one of them, or an "
                               "element by its id")
    assert (len(found.source.walls), len(found.source.polygons)) == (1, 1)
    assert not read(tmp_path, LAYERS, level="Walls").source.polygons
    assert not read(tmp_path, LAYERS, level="sofa").source.walls
    with pytest.raises(InputError, match=r"--level Wals: .* has no such layer or id "
                                         r"\(did you mean 'Walls'\?\); layers: Walls, Sofas"):
        read(tmp_path, LAYERS, level="Wals")


def test_uses_that_multiply_are_refused(tmp_path, monkeypatch):
    assert svg._MOST_ELEMENTS == 500_000
    monkeypatch.setattr(svg, "_MOST_ELEMENTS", 5000)
    bomb = "".join(f"<g id='g{i}'>" + f"<use href='#g{i + 1}'/>" * 10 + "</g>" for i in range(9))
    with pytest.raises(InputError, match="more than 5000 elements, or nested more than 200"):
        read(tmp_path, bomb + "<line id='g9' x2='1'/>")
    with pytest.raises(InputError, match="more than 5000 elements, or nested more than 200"):
        read(tmp_path, "<g id='a'><use href='#a'/></g>")


@pytest.mark.parametrize("pattern", [svg._TRANSFORM, svg_style._RULE])
def test_hostile_text_takes_no_time_that_grows_with_its_square(pattern):
    """A search that begins again at each place took two minutes."""
    for text in ("a(" * 100_000, "a" * 200_000, "a{" * 100_000):
        assert pattern.findall(text) == []
    assert svg_style._COMMENT.sub("", "/* " * 100_000) == ""
