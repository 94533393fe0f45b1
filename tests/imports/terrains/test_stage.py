"""Worlds of Stage: models of blocks, bitmaps, macros, included files and robots."""

import math

import numpy as np
import pytest
from PIL import Image

from desim.errors import InputError
from desim.imports.terrains import written
from desim.imports.terrains.found import Choices
from desim.imports.terrains.grid_drawing import Bitmap, draw
from desim.imports.terrains.read import read_terrain
from desim.scenario.load import load

CONCRETE = "all counts as concrete (--material)"


def read(folder, content, **choices):
    file = folder / "hall.world"
    file.write_text(content)
    return read_terrain(file, Choices(**choices))[1]


def blocks(found):
    return [sorted(tuple(round(value, 3) + 0.0 for value in point) for point in block.points_m)
            for block in found.source.polygons]


def square(x0, y0, x1, y1):
    return sorted([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def plan(folder, name="plan.png"):
    """20 x 10 pixels, with two more white ones around: a frame, and a wall across at column 12."""
    pixels = np.full((14, 24), 255, np.uint8)
    pixels[2:12, 2:22] = 0
    pixels[3:11, 3:21] = 255
    pixels[3:8, 14] = 0
    Image.fromarray(pixels).save(folder / name)


def test_models_are_stretched_to_their_size(tmp_path):
    """A model without blocks is a box; the blocks of another one fill its size, around its origin.
    """
    found = read(tmp_path, """
        # a comment ( with marks ] in it
        unit_angle "degrees"
        define crate model ( size [2 1 0.8] color "red" gui_nose 0 )
        crate( pose [5 1 0 90] name "first" )
        crate( pose [0 0 0] size [4 2 3] )
        model( size [3 6 1] origin [1 0 0 0]
          block( points 3 point[0] [10 10] point[1] [20 10]
                 point[2] [20 40] z [0 1] ) )""")
    assert blocks(found) == [square(4.5, 0.0, 5.5, 2.0), square(-2.0, -1.0, 2.0, 1.0),
                             [(-0.5, -3.0), (2.5, -3.0), (2.5, 3.0)]]
    assert [block.height_m for block in found.source.polygons] == [0.8, 3.0, 1.0]
    assert found.notes == (CONCRETE,) and found.starts == ()


def test_models_on_models_and_what_is_not_met(tmp_path):
    found = read(tmp_path, """
        unit_length 0.1
        model( size [10 10 5] pose [20 0 0 90] ranger( pose [0 0 0 0] )
               model( size [2 2 1] pose [3 0 0 0] ) )
        model( size [10 10 20] model( size [1 1 1] ) )
        model( size [10 10 0.1] )
        model( size [10 10 5] obstacle_return 0 ranger_return -1 )
        puk( pose [0 0 0 0] )""")
    assert blocks(found) == [square(1.5, -0.5, 2.5, 0.5), square(1.9, 0.2, 2.1, 0.4),
                             square(-0.5, -0.5, 0.5, 0.5)]
    assert [block.height_m for block in found.source.polygons] == [0.5, 0.6, 2.0]
    assert found.notes[0] == ("left out: flat on the ground (1), overhead (1), passed by robots "
                              "and rays (1), puk (unknown) (1)")


def test_a_macro_is_read_when_it_is_used(tmp_path):
    """It may be defined before what it is made of; the first definition counts, a circle ends."""
    found = read(tmp_path, """
        define low crate ( size [1 1 0.5] )
        define crate model ( size [4 4 4] )
        define crate model ( size [9 9 9] )
        define snake snake ( size [3 3 3] )
        low() snake()""")
    assert blocks(found) == [square(-0.5, -0.5, 0.5, 0.5)]
    assert found.notes[0] == "left out: snake (unknown) (1)"


def test_a_bitmap_is_cut_to_its_dark_pixels_and_stretched(tmp_path):
    plan(tmp_path)
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "map.inc").write_text("define floorplan model ( boundary 0 )\n")
    found = read(tmp_path, """
        include "lib/map.inc"
        include "lib/robots.inc"
        floorplan( bitmap "plan.png" size [10 5 0.7] pose [20 0 0 0] )""")
    terrain, raster = found.terrain, found.terrain.raster
    assert found.source is None and raster.resolution_m == 0.5
    assert terrain.bounds == pytest.approx((15.0, -2.5, 25.0, 2.5))
    expected = np.ones((10, 20), bool)
    expected[1:-1, 1:-1] = False
    expected[4:9, 12] = True  # from the upper side: row 0 is the lowest
    assert (raster.solid == expected).all()
    assert set(terrain.tops_m.tolist()) == {0.7}
    assert found.notes == (
        "left out, as they cannot be read: lib/robots.inc (No such file or directory)", CONCRETE,
        "cells of 0.5 m (--resolution), all 0.7 m high (--height)")


def test_a_bitmap_that_is_turned_with_blocks_in_it(tmp_path):
    plan(tmp_path)
    found = read(tmp_path, """
        model( bitmap "plan.png" size [10 5 0.7] pose [0 0 0 90] )
        model( size [1 1 1] pose [-1 -2 0 0] )""", height_m=2.5, material="brick")
    raster = found.terrain.raster
    assert found.terrain.bounds == pytest.approx((-2.5, -5.0, 2.5, 5.0))
    expected = np.ones((20, 10), bool)
    expected[1:-1, 1:-1] = False
    expected[12, 1:6] = True
    expected[5:7, 2:4] = True
    assert (raster.solid == expected).all() and set(found.terrain.tops_m.tolist()) == {2.5}


def test_a_boundary_closes_a_world(tmp_path):
    found = read(tmp_path, """
        model( size [8 4 1] boundary 1 block( points 4 point[0] [0 0] point[1] [1 0]
               point[2] [1 1] point[3] [0 1] ) )""")
    assert blocks(found)[1:] == [
        square(-4.0, -2.0, 4.0, -1.99), square(-4.0, 1.99, 4.0, 2.0),
        square(-4.0, -2.0, -3.99, 2.0), square(3.99, -2.0, 4.0, 2.0)]


def test_coarse_cells_keep_thin_walls():
    """A wall of one pixel across cells of eight is still a wall, however it is turned."""
    solid = np.zeros((80, 80), bool)
    solid[:, 37] = True
    for yaw in (0.0, 0.3, math.pi / 2):
        free = draw([Bitmap(solid, (8.0, 8.0), 0.0, 0.0, yaw)], [], 0.8).free
        assert 10 <= (~free).sum() <= 30


def test_robots_are_the_fleet_of_a_scenario(tmp_path, monkeypatch):
    plan(tmp_path)
    monkeypatch.chdir(tmp_path)
    found = read(tmp_path, """
        define rover position ( size [0.4 0.4 0.3] camera() )
        model( bitmap "plan.png" size [20 10 2] )
        rover( name "a" pose [-6 0 0 45] ) rover( pose [6.5 -2 0 -90] ) rover( pose [-9 0 0 0] )""")
    assert found.starts == ((-6.0, 0.0, math.radians(45.0)), (6.5, -2.0, -math.pi / 2))
    assert found.notes[-2:] == (
        "robots: 3, which are the fleet of a scenario (--to): (-6, 0), (6.5, -2), (-9, 0)",
        "of these 1 are less than 0.3 m from a wall, and left out")
    written.write_scenario(found, "hall.world", tmp_path / "hall.yaml")
    poses = load("hall.yaml").scenario.fleet.start.poses
    assert [(pose.x_m, pose.y_m, pose.heading_rad) for pose in poses] == [
        (-6.0, 0.0, pytest.approx(math.pi / 4)), (6.5, -2.0, pytest.approx(-math.pi / 2))]


@pytest.mark.parametrize("named", [
    "plan.png", "./plan.png", "../maps/plan.png", "../worlds/./plan.png",
    "/home/someone/pack/worlds/plan.png", "/home/someone/pack/maps/plan.png"])
def test_files_of_the_package_that_a_world_is_in(tmp_path, named):
    """Also those that stand in it as its author's machine had them."""
    for folder in ("maps", "worlds"):
        (tmp_path / "pack" / folder).mkdir(parents=True)
        plan(tmp_path / "pack" / folder)
    (tmp_path / "pack" / "maps" / "floor.inc").write_text("define floor model( size [20 10 1] )\n")
    found = read(tmp_path / "pack" / "worlds",
                 f'include "../maps/floor.inc"\nfloor( bitmap "{named}" )')
    assert found.terrain.bounds == (-10.0, -5.0, 10.0, 5.0)


@pytest.mark.parametrize("content, complaint", [
    ("model( size [1 1 1]", "hall.world:1: its ) is missing"),
    ("model(\n size [1 1 1", "hall.world:2: size: its ] is missing"),
    ("model(\n pose )", "hall.world:2: pose: a value is expected, got ')'"),
    ("model( ]\n)", "hall.world:1: a name is expected, got ']'"),
    ("model( size [1 1 1] )\n{", "hall.world:2: '{' is not expected here"),
    ("model()\ndefine a ( )",
     "hall.world:2: define: a name, a type and ( are expected, got 'a' '('"),
    ("model( size [1 x 1] )", "hall.world:1: size: must be 2 or 3 numbers, got '1 x 1'"),
    ("model( size [0 1 1] )", "hall.world:1: size must be above zero, got (0.0, 1.0, 1.0)"),
    ("model( pose [1 2] )", "hall.world:1: pose: must be 3 or 4 numbers, got '1 2'"),
    ("model( block( points 3 point[0] [0 0] ) )",
     "hall.world:1: block: points must say how many corners there are, at least 3, and "),
    ("\nmodel( bitmap \"none.png\" )",
     "hall.world:2: bitmap: no file 'none.png' in the world's folder, and in the one above"),
    ("model( bitmap \"../../plan.png\" )",
     "plan.png: cannot be read as an image: '../plan.png' is no name of a file in a folder"),
    ("model( bitmap \"/etc/../plan.png\" )",
     "plan.png: cannot be read as an image: '/plan.png' is no name of a file in a folder"),
    ("model( bitmap \"white.png\" )", "hall.world:1: bitmap 'white.png' has no dark pixel"),
    ("model( bitmap \"black.png\" )", "hall.world: no free ground between its bitmaps"),
    ("include \"loop.inc\"\nmodel()", "loop.inc:1: include: more than 20 files include each other"),
    ("model(" * 21 + ")" * 21, "hall.world:1: more than 20 entities in each other"),
    ("define a0 model ( )\n" + "".join(
        f"define a{n + 1} model ( a{n}() a{n}() a{n}() a{n}() )\n" for n in range(12)) + "a12()",
     ": more than 20000 models, or more than 20 on each other"),
    ("window( size [1 1] )", f"hall.world: no wall and no block found; {CONCRETE}"),
])
def test_wrong_worlds(tmp_path, content, complaint):
    (tmp_path / "loop.inc").write_text("include \"loop.inc\"\n")
    Image.new("L", (4, 4), 255).save(tmp_path / "white.png")
    Image.new("L", (4, 4), 0).save(tmp_path / "black.png")
    with pytest.raises(InputError) as error:
        read(tmp_path, content)
    assert complaint in str(error.value)
