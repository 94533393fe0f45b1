"""Floor plans in DXF."""

import math

import pytest

from desim.errors import InputError
from desim.imports.terrains import dxf
from desim.imports.terrains.found import Choices
from desim.imports.terrains.read import read_terrain

LINE = "0 LINE 8 WALLS 10 0 20 0 11 4 21 3"
UNIT = "a unit is 1 m, as $INSUNITS says (--scale)"


def section(name, *entities):
    return "0 SECTION 2 " + " ".join([name, *entities, "0 ENDSEC"])


def drawing(*entities, units="6", blocks=(), layers=()):
    return " ".join([section("HEADER", f"9 $INSUNITS 70 {units}"), section("TABLES", *layers),
                     section("BLOCKS", *blocks), section("ENTITIES", *entities), "0 EOF"])


def read(folder, text, **choices):
    """The drawing of words, each of which stands on a line of its own."""
    file = folder / "a.dxf"
    file.write_text(text.replace(" ", "\r\n") + "\r\n")
    return read_terrain(file, Choices(**choices))[1]


def walls(folder, *entities, **parts):
    return [(*wall.start_m, *wall.end_m)
            for wall in read(folder, drawing(*entities, **parts)).source.walls]


def ends(folder, *entities, **parts):
    """The first point and the last one, and the number of walls."""
    found = walls(folder, *entities, **parts)
    return pytest.approx((*found[0][:2], *found[-1][2:]), abs=1e-5), len(found)


def test_lines_in_units_of_the_drawing(tmp_path):
    assert walls(tmp_path, LINE) == [(0.0, 0.0, 4.0, 3.0)]
    assert walls(tmp_path, LINE.replace("4", "400"), units="5") == [(0.0, 0.0, 4.0, 0.03)]
    found = read(tmp_path, drawing(LINE, units="0"), scale=0.5)
    assert found.source.walls[0].end_m == (2.0, 1.5)
    assert found.notes == ("walls are the lines of the layers WALLS (1)",)


def test_polylines(tmp_path):
    """A bulge of 1 is half a circle to the right of the side, so that it turns anticlockwise."""
    found = walls(tmp_path, "0 LWPOLYLINE 8 W 70 1 90 3 10 0 20 0 10 2 20 0 42 1 10 2 20 2")
    assert found[0] == (0.0, 0.0, 2.0, 0.0) and found[-1] == (2.0, 2.0, 0.0, 0.0)
    assert len(found) == 1 + 18 + 1
    assert max(x for *_, x, _ in found) == pytest.approx(3.0)
    old = walls(tmp_path, "0 POLYLINE 8 W 66 1 70 1 0 VERTEX 8 W 10 0 20 0 0 VERTEX 10 2 20 0 42 1 "
                          "0 VERTEX 10 2 20 2 0 SEQEND")
    assert old == found
    wide = read(tmp_path, drawing("0 LWPOLYLINE 43 0.25 10 0 20 0 10 2 20 0")).source.walls
    assert wide[0].thickness_m == 0.25


@pytest.mark.parametrize("entity, first_and_last", [
    ("0 CIRCLE 10 1 20 1 40 2", (3, 1, 3, 1)),
    ("0 ARC 10 0 20 0 40 2 50 270 51 90", (0, -2, 0, 2)),
    ("0 ARC 10 1 20 0 40 2 50 0 51 90 230 -1", (-3, 0, -1, 2)),  # seen from below
    ("0 ELLIPSE 10 0 20 0 11 0 21 4 40 0.5 41 0 42 3.141592653589793", (0, 4, 0, -4)),
    ("0 SPLINE 71 3 10 0 20 0 10 1 20 0 10 2 20 0 10 3 20 3 40 0 40 0 40 0 40 0 40 1 40 1 40 1 "
     "40 1", (0, 0, 3, 3)),
    ("0 SPLINE 71 3 11 0 21 0 11 1 21 5", (0, 0, 1, 5)),
])
def test_curves(tmp_path, entity, first_and_last):
    found, _ = ends(tmp_path, entity)
    assert first_and_last == found


def test_a_spline_is_its_bezier_curve(tmp_path):
    found = walls(tmp_path, "0 SPLINE 71 2 10 0 20 0 10 1 20 2 10 2 20 0 40 0 40 0 40 0 40 1 40 1 "
                            "40 1")
    assert all(y == pytest.approx(2 * x - x * x, abs=1e-5) for x, y, *_ in found)


BLOCK = "0 BLOCK 2 B 10 1 20 0 {} 0 ENDBLK"


def test_blocks_are_inserted_with_scale_turn_and_in_rows(tmp_path):
    found = walls(tmp_path, "0 INSERT 8 WALLS 2 B 10 10 20 5 41 2 42 3 50 90 70 2 44 1",
                  blocks=[BLOCK.format("0 LINE 10 1 20 0 11 2 21 1")])
    assert found == [(10.0, 5.0, 7.0, 7.0), (10.0, 6.0, 7.0, 8.0)]


def test_blocks_that_multiply_are_refused(tmp_path, monkeypatch):
    assert dxf._MOST_ENTITIES == 500_000
    monkeypatch.setattr(dxf, "_MOST_ENTITIES", 5000)
    blocks = [f"0 BLOCK 2 B{i} " + f"0 INSERT 2 B{i + 1} 70 30 71 30 " * 2 + "0 ENDBLK"
              for i in range(9)]
    for names in (blocks, ["0 BLOCK 2 B0 0 INSERT 2 B0 0 ENDBLK"]):
        with pytest.raises(InputError, match=r"a.dxf: more than 5000 entities, or blocks nested "
                                             "more than 16 deep"):
            read(tmp_path, drawing("0 INSERT 2 B0", blocks=[name.replace("  ", " ") for name in
                                                            names]))


def test_solids_are_blocks(tmp_path):
    """Their last two corners cross over; of a triangle they are one."""
    square = "0 SOLID 8 W 10 1 20 1 11 3 21 1 12 1 22 2 13 3 23 2"
    triangle = "0 TRACE 8 W 10 5 20 0 11 7 21 0 12 7 22 2"
    found = read(tmp_path, drawing(square, triangle, triangle + " 13 7 23 2")).source
    assert not found.walls
    assert [one.points_m for one in found.polygons] == [
        ((1, 1), (3, 1), (3, 2), (1, 2)), *[((5, 0), (7, 0), (7, 2))] * 2]
    mirrored = read(tmp_path, drawing(triangle + " 230 -1")).source.polygons
    assert sorted(x for x, _ in mirrored[0].points_m) == [-7, -7, -5]


def test_layers_that_are_left_out(tmp_path):
    layers = ["0 LAYER 2 WALLS 70 0 62 7", "0 LAYER 2 OFF 70 0 62 -7", "0 LAYER 2 COLD 70 1 62 7",
              "0 LAYER 2 A-DOOR 70 0 62 7"]
    text = drawing(LINE, LINE.replace("WALLS", "OFF"), LINE.replace("WALLS", "COLD"),
                   LINE.replace("WALLS", "A-DOOR"), LINE + " 67 1", "0 TEXT 8 WALLS 1 Hall",
                   "0 HATCH 8 WALLS", "0 HATCH 8 WALLS", layers=layers)
    found = read(tmp_path, text)
    assert len(found.source.walls) == 1 and found.notes == (
        UNIT, "walls are the lines of the layers WALLS (1)",
        "left out are the layers A-DOOR (1) (--level NAME,NAME takes layers)",
        "left out: entities of hidden layers (2), HATCH (2), TEXT (1)")
    assert len(read(tmp_path, text, level="A-DOOR,WALLS").source.walls) == 2
    with pytest.raises(InputError, match=r"--level WALS: .* has no such layer \(did you mean "
                                         r"'WALLS'\?\); allowed: A-DOOR, COLD, OFF, WALLS"):
        read(tmp_path, text, level="WALS")


def test_a_block_s_layer_0_is_that_of_its_insert(tmp_path):
    found = read(tmp_path, drawing(LINE, "0 INSERT 8 A-DOOR 2 B", "0 INSERT 8 X 2 none",
                                   blocks=[BLOCK.format("0 LINE 8 0 10 0 20 0 11 1 21 1")]))
    assert found.notes[2:] == ("left out are the layers A-DOOR (1) (--level NAME,NAME takes "
                               "layers)", "left out: missing blocks (1)")


@pytest.mark.parametrize("text, complaint", [
    (drawing(LINE, units="0"), ": the drawing does not say how long its units are ($INSUNITS 0); "
                               "give the length of one in m, as in --scale 0.001 for mm"),
    (drawing(LINE, units="4"), ": the drawing is 0.004 m wide if $INSUNITS is right; give the "
                               "length of one of its units in m, as in --scale 1"),
    (drawing(LINE.replace("11 4", "11 far")), ":36: LINE: code 11 must be a number, got 'far'"),
    (drawing(LINE.replace("11 4", "11 nan")), ":36: LINE: code 11 must be a number, got 'nan'"),
    (drawing(LINE).replace(" 21 3", " x 3"), ":37: must be the code of a pair, a whole number, got "
                                             "'x'"),
    (drawing(LINE).removesuffix("0 EOF"), ": ends before its EOF; is it complete?"),
    (drawing("0 TEXT 8 0 1 hi"), f": no wall and no block found; {UNIT}; walls are the lines of "
                                 "the layers none; left out: TEXT (1)"),
])
def test_wrong_drawings(tmp_path, text, complaint):
    with pytest.raises(InputError) as error:
        read(tmp_path, text)
    assert str(error.value) == f"{tmp_path / 'a.dxf'}{complaint}"


@pytest.mark.parametrize("head", [b"AutoCAD Binary DXF\r\n\x1a\0", b"AC1032\0\0\0"])
def test_binary_drawings(tmp_path, head):
    (tmp_path / "a.dwg").write_bytes(head)
    with pytest.raises(InputError, match="a.dwg: is a binary drawing; save it as DXF in ASCII"):
        read_terrain(tmp_path / "a.dwg", Choices())


def test_an_arc_leaves_its_circle_by_little(tmp_path):
    assert all(math.hypot(x, y) == pytest.approx(10.0) for x, y, *_ in walls(
        tmp_path, "0 CIRCLE 10 0 20 0 40 10"))
