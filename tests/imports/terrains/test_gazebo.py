"""Worlds of Gazebo: collisions in plan, by pose, frame, include and mesh."""

import math
import struct

import numpy as np
import pytest

from desim.errors import InputError
from desim.imports.terrains.found import Choices
from desim.imports.terrains.read import read_terrain

SLAB = "what lies between 0.05 m and 1 m above z = 0 counts as solid"
CONCRETE = "all counts as concrete (--material)"


def model(geometry, pose="0 0 0 0 0 0", more="<static>1</static>"):
    return (f"<model name='m'><pose>{pose}</pose>{more}<link name='l'><collision name='c'>"
            f"<geometry>{geometry}</geometry></collision></link></model>")


def box(size="2 1 1", **given):
    return model(f"<box><size>{size}</size></box>", **given)


def read(folder, content, version="1.7", **choices):
    file = folder / "hall.world"
    file.parent.mkdir(exist_ok=True)
    file.write_text(f"<sdf version='{version}'>\n<world name='w'>\n{content}\n</world>\n</sdf>")
    return read_terrain(file, Choices(**choices))[1]


def blocks(found):
    """The corners of each block, to a millimetre, in order from the lowest."""
    return [sorted(tuple(round(value, 3) + 0.0 for value in point) for point in block.points_m)
            for block in found.source.polygons]


def square(x0, y0, x1, y1):
    return sorted([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def test_a_box_that_is_turned(tmp_path):
    found = read(tmp_path, box(pose=f"3 4 0.5 0 0 {math.pi / 2}"))
    assert blocks(found) == [square(2.5, 3.0, 3.5, 5.0)]
    block, = found.source.polygons
    assert (block.height_m, block.material, found.notes) == (1.0, "concrete", (SLAB, CONCRETE))
    block, = read(tmp_path, box(), material="brick", height_m=3.0).source.polygons
    assert (block.height_m, block.material) == (3.0, "brick")


def test_a_box_on_its_edge_is_cut_at_both_heights(tmp_path):
    """A square of side 2 turned by 45 degrees around x: its corner is at z = -1.41, and between
    0.05 m and 1 m it is widest at 0.05 m, 1.41 - 0.05 m to both sides."""
    found = read(tmp_path, box("4 2 2", pose=f"0 0 0 {math.pi / 4} 0 0"))
    wide = round(math.sqrt(2) - 0.05, 3)
    assert blocks(found) == [square(-2.0, -wide, 2.0, wide)]


@pytest.mark.parametrize("geometry, z, radius_m", [
    ("<cylinder><radius>0.5</radius><length>2</length></cylinder>", 1.0, 0.5),
    ("<sphere><radius>0.5</radius></sphere>", 0.5, 0.5),
    ("<capsule><radius>0.5</radius><length>1</length></capsule>", 1.0, 0.5),
    ("<ellipsoid><radii>0.5 0.5 0.2</radii></ellipsoid>", 0.3, 0.5),
    ("<cone><radius>0.5</radius><length>2</length></cone>", 1.0, 0.4875),  # at 0.05 m
])
def test_round_shapes(tmp_path, geometry, z, radius_m):
    corners, = blocks(read(tmp_path, model(geometry, pose=f"1 2 {z} 0 0 0")))
    assert len(corners) == 24
    assert np.hypot(*(np.array(corners) - (1, 2)).T) == pytest.approx(radius_m, abs=1e-3)


def test_a_polyline_is_extruded(tmp_path):
    points = "".join(f"<point>{x} {y}</point>" for x, y in ((0, 0), (2, 0), (2, 2), (1, 0.5)))
    found = read(tmp_path, model(f"<polyline>{points}<height>0.8</height></polyline>",
                                 pose="1 1 0 0 0 0"))
    assert blocks(found) == [[(1.0, 1.0), (2.0, 1.5), (3.0, 1.0), (3.0, 3.0)]]
    assert found.source.polygons[0].height_m == 0.8


def test_what_is_on_the_ground_or_overhead_is_no_wall(tmp_path):
    found = read(tmp_path, box() + box(pose="0 0 -0.5 0 0 0") + box(pose="0 0 2 0 0 0")
                 + model("<plane><normal>0 0 1</normal></plane>")
                 + model("<heightmap><uri>a.png</uri></heightmap>")
                 + "<actor name='a'/><model name='v'><link name='l'><visual name='v'/></link>"
                   "</model><model name='r'><pose>1 2 0 0 0 0</pose><plugin name='p' filename="
                   "'libgazebo_ros_diff_drive.so'/></model>" + box(pose="5 0 0 0 0 0", more="")
                 + box("0 0 0") + box(more="<plugin name='gz_ros2_control::System'/>"))
    assert len(blocks(found)) == 2
    assert found.notes == (
        SLAB, "left out: <actor> (1), <heightmap> (1), link without <collision> (1), shape on or "
              "below the ground (1), shape overhead (1), shape without size (1)",
        "robots, which are no part of the terrain: r (1, 2), m (0, 0)",
        "models that could be pushed (not static) stand still: 1", CONCRETE)


@pytest.mark.parametrize(("normal", "turn", "left_out"), [
    ("0 0 1", "0 0 1.5", ()), ("0 0 2", "0 3.1416 0", ()),
    ("1 0 1", "0 0 0", ("left out: plane that is not level (1)",)),
    ("0 0 1", "1.5708 0 0", ("left out: plane that is not level (1)",))])
def test_a_plane_is_the_ground_if_it_is_level(tmp_path, normal, turn, left_out):
    plane = f"<plane><normal>{normal}</normal></plane>"
    found = read(tmp_path, box() + model(plane, pose=f"0 0 0 {turn}"))
    assert len(blocks(found)) == 1 and found.notes == (SLAB, *left_out, CONCRETE)


def test_of_several_worlds_the_first_is_read(tmp_path):
    found = read(tmp_path, box() + "</world><world name='second'>" + box("4 4 4") * 2)
    assert blocks(found) == [square(-1, -0.5, 1, 0.5)]
    assert found.notes == (SLAB, "the first of 2 worlds", CONCRETE)


def test_frames(tmp_path):
    found = read(tmp_path, """
        <frame name='corner'><pose>10 0 0 0 0 0</pose></frame>
        <frame name='turned' attached_to='corner'><pose degrees='true'>0 5 0 0 0 90</pose></frame>
        <model name='a'><pose relative_to='turned'>1 0 0 0 0 0</pose><static>true</static>
          <link name='l'><pose>2 0 0 0 0 0</pose></link>
          <model name='b'>
            <pose relative_to='l' rotation_format='quat_xyzw'>0 0 0.5  0 0 0.70711 0.70711</pose>
            <link name='k'><collision name='c'><geometry><box><size>4 2 1</size></box></geometry>
            </collision></link></model></model>""")
    assert blocks(found) == [square(8.0, 7.0, 12.0, 9.0)]


def test_a_frame_whose_name_has_the_mark_of_a_scope(tmp_path):
    """As gz sdf writes a model that it has merged from another one."""
    found = read(tmp_path, """
        <model name='m'><static>true</static>
          <frame name='hall::__model__'><pose>5 0 0 0 0 0</pose></frame>
          <link name='hall::wall'><pose relative_to='hall::__model__'>1 0 0.5 0 0 0</pose>
            <collision name='c'><geometry><box><size>2 2 1</size></box></geometry></collision>
          </link></model>""")
    assert blocks(found) == [square(5.0, -1.0, 7.0, 1.0)]


@pytest.mark.parametrize("version, x", [("1.4", 7.0), ("1.7", 7.0), ("1.8", 0.0), ("1.10", 0.0)])
def test_a_saved_state_counts_in_worlds_of_gazebo_classic(tmp_path, version, x):
    found = read(tmp_path, box() + "<state world_name='w'><model name='m'>"
                 "<pose>7 0 0 0 0 0</pose></model></state>", version)
    assert blocks(found) == [square(x - 1.0, -0.5, x + 1.0, 0.5)]


@pytest.mark.parametrize("folder, uri", [
    ("models/crate", "model://crate"), ("../models/crate", "model://crate"),
    ("crate", "crate"), ("../models/crate", "file://models/crate"),
    ("../models/Crate", "https://fuel.gazebosim.org/1.0/someone/models/Crate")])
def test_includes(tmp_path, folder, uri):
    """The pose of an include takes the place of its model's."""
    world = tmp_path / "worlds"
    world.mkdir()
    (crate := world / folder).mkdir(parents=True)
    (crate / "model.sdf").write_text(f"<sdf version='1.6'>{box(pose='9 9 0 0 0 0')}</sdf>")
    found = read(world, f"<include><uri>{uri}</uri><pose>3 0 0 0 0 0</pose></include>"
                        f"<include><uri>\n {uri}\n</uri></include>"
                        "<include><uri>model://sun</uri></include>")
    assert blocks(found) == [square(2.0, -0.5, 4.0, 0.5), square(8.0, 8.5, 10.0, 9.5)]
    assert found.notes == (SLAB, CONCRETE)


def test_the_file_that_model_config_names(tmp_path):
    (crate := tmp_path / "models" / "crate").mkdir(parents=True)
    (crate / "model.config").write_text("<model><sdf version='1.4'>old.sdf</sdf>"
                                        "<sdf version='1.6'>new.sdf</sdf></model>")
    (crate / "new.sdf").write_text(f"<sdf version='1.6'>{box()}</sdf>")
    assert len(blocks(read(tmp_path, "<include><uri>model://crate</uri></include>"))) == 1


@pytest.mark.parametrize("variable, count", [
    ("GZ_SIM_RESOURCE_PATH", 1), ("GAZEBO_MODEL_PATH", 1), ("GZ_SIM_PATH", 0)])
def test_models_are_searched_where_gazebo_does(tmp_path, monkeypatch, variable, count):
    """After the folders beside the world; the last of these variables is none, the twin."""
    for name in ("GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH"):
        monkeypatch.delenv(name, raising=False)
    crate = tmp_path / "installed" / "crate"
    crate.mkdir(parents=True)
    (crate / "model.sdf").write_text(f"<sdf version='1.6'>{box()}</sdf>")
    monkeypatch.setenv(variable, f"/nowhere::{crate.parent}")
    world = tmp_path / "world"
    world.mkdir()
    found = read(world, model("<box><size>1 1 1</size></box>")
                 + "<include><uri>model://crate</uri></include>")
    assert len(blocks(found)) == 1 + count


def test_what_is_not_beside_the_file_is_named(tmp_path):
    """Nothing is read through a link, or from elsewhere."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "model.sdf").write_text(f"<sdf version='1.6'>{box()}</sdf>")
    world = tmp_path / "pack" / "worlds"
    (world / "models").mkdir(parents=True)
    (world / "models" / "linked").symlink_to(tmp_path / "outside")
    uris = ["model://../../outside", f"file://{tmp_path}/outside", "model://linked", "ftp://x/y",
            "model://absent", "model://absent"]
    found = read(world, box() + "".join(f"<include><uri>{uri}</uri></include>" for uri in uris)
                 + model("<mesh><uri>wall.3ds</uri></mesh>"))
    assert len(blocks(found)) == 1
    assert found.notes[1] == ("left out, as not found beside the file or not readable: "
                              f"model://absent (2), model://../../outside, file://{tmp_path}/"
                              "outside, model://linked, ftp://x/y, wall.3ds")


CUBE = [(a, b, c) for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3),
                               (0, 4, 6, 2), (1, 3, 7, 5))
        for a, b, c in ((face[0], face[1], face[2]), (face[0], face[2], face[3]))]


def corners(x0, y0, x1, y1, high=2.0):
    return np.array([(x, y, z) for z in (0.0, high) for y in (y0, y1) for x in (x0, x1)])


def binary(*boxes):
    triangles = np.concatenate([box[CUBE] for box in boxes])
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + rows


def ascii_stl(box):
    facets = "".join("facet normal 0 0 0\nouter loop\n" + "".join(
        "vertex {} {} {}\n".format(*corner) for corner in triangle) + "endloop\nendfacet\n"
        for triangle in box[CUBE])
    return f"solid cube\n{facets}endsolid".encode()


def obj(box):
    lines = ["v {} {} {}".format(*corner) for corner in box]
    return "\n".join(lines + [f"f {a + 1}/1 {b + 1} {c - 8}" for a, b, c in CUBE]).encode()


def dae(box):
    return f"""<COLLADA><asset><unit meter="0.01"/></asset><library_geometries>
        <geometry id="g"><mesh><source id="s"><float_array>{' '.join(
            str(100 * value) for value in box.ravel())}</float_array></source>
        <vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
        <polylist count="12"><input semantic="NORMAL" source="#n" offset="1"/>
        <input semantic="VERTEX" source="#v" offset="0"/><vcount>{'3 ' * 12}</vcount>
        <p>{' '.join(f'{corner} 0' for row in CUBE for corner in row)}</p></polylist>
        </mesh></geometry></library_geometries><library_visual_scenes><visual_scene>
        <node><translate>-500 0 0</translate><node><matrix>1 0 0 500 0 1 0 0 0 0 1 0 0 0 0 1
        </matrix><instance_geometry url="#g"/></node></node></visual_scene>
        </library_visual_scenes></COLLADA>""".encode()


@pytest.mark.parametrize("name, content", [
    ("a.stl", binary(corners(0, 0, 2, 1))), ("a.STL", ascii_stl(corners(0, 0, 2, 1))),
    ("a.obj", obj(corners(0, 0, 2, 1))), ("a.dae", dae(corners(0, 0, 2, 1)))])
def test_meshes(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    found = read(tmp_path, model(f"<mesh><uri>{name}</uri><scale>2 1 1</scale></mesh>",
                                 pose="1 0 0 0 0 0"))
    assert blocks(found) == [square(1.0, 0.0, 5.0, 1.0)]
    assert found.source.polygons[0].height_m == 2.0


def test_a_model_names_its_own_mesh(tmp_path):
    (crate := tmp_path / "models" / "crate").mkdir(parents=True)
    (crate / "a.stl").write_bytes(binary(corners(0, 0, 2, 1)))
    (crate / "model.sdf").write_text(
        f"<sdf>{model('<mesh><uri>model://crate/a.stl</uri></mesh>')}</sdf>")
    found = read_terrain(crate / "model.sdf", Choices())[1]
    assert blocks(found) == [square(0.0, 0.0, 2.0, 1.0)]


def area(found):
    return sum(np.ptp([x for x, _ in block]) * np.ptp([y for _, y in block])
               for block in blocks(found))


def ring(outer, inner):
    """A closed wall around a yard: the sides of two boxes, the inner one turned inside out."""
    sides = np.array(CUBE[4:])
    inward = sides[:, ::-1]
    caps = [[outer[z + a], outer[z + b], inner[z + b]] for z in (0, 4)
            for a, b in ((0, 1), (1, 3), (3, 2), (2, 0))]
    caps += [[outer[z + a], inner[z + b], inner[z + a]] for z in (0, 4)
             for a, b in ((0, 1), (1, 3), (3, 2), (2, 0))]
    return np.concatenate([outer[sides], inner[inward], np.array(caps)])


def test_a_mesh_of_walls_keeps_its_room(tmp_path):
    """Walls of 0.5 m around a room of 9 m x 4 m are rectangles of cells of 0.1 m, half a cell
    thicker on each side; the same walls of one convex part each are four boxes."""
    triangles = ring(corners(0, 0, 10, 5), corners(0.5, 0.5, 9.5, 4.5))
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *row.ravel(), 0) for row in triangles)
    (tmp_path / "ring.stl").write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + rows)
    found = read(tmp_path, model("<mesh><uri>ring.stl</uri></mesh>"), resolution_m=0.1)
    assert len(blocks(found)) == 4
    assert area(found) == pytest.approx(10.1 * 5.1 - 8.9 * 3.9)
    points = sum(blocks(found), [])
    assert (min(points), max(points)) == ((-0.05, -0.05), (10.05, 5.05))
    (tmp_path / "four.stl").write_bytes(binary(
        corners(0, 0, 10, 0.5), corners(0, 4.5, 10, 5), corners(0, 0.6, 0.5, 4.4),
        corners(9.5, 0.6, 10, 4.4)))
    found = read(tmp_path, model("<mesh><uri>four.stl</uri></mesh>"))
    assert blocks(found)[0] == square(0.0, 0.0, 10.0, 0.5) and len(blocks(found)) == 4


@pytest.mark.parametrize("content, complaint", [
    ("", "hall.world: no wall and no block found; " + SLAB),
    (box("2 1"), "hall.world:3: size: must be 3 numbers, got '2 1'"),
    (box("2 1 nan"), "hall.world:3: size: must be 3 numbers, got '2 1 nan'"),
    (box("2 -1 1"), "hall.world:3: box: size must be given, and not be below zero"),
    (box(pose="1 2"), "hall.world:3: pose: must be 6 numbers, got '1 2'"),
    (model("<sphere/>"), "hall.world:3: sphere: radius must be given, and not be below zero"),
    ("<model name='m'><pose relative_to='hul'/></model><frame name='hull'/>",
     r"hall.world:3: pose: no frame 'hul' here \(did you mean 'hull'\?\); allowed: m, hull"),
    ("<frame name='a' attached_to='b'/><frame name='b' attached_to='a'/>"
     "<model name='m'><pose relative_to='a'/></model>",
     "hall.world:3: pose: more than 20 frames are relative to each other"),
    ("<model>" * 21 + "</model>" * 21,
     "hall.world:3: more than 20000 models, or more than 20 in each other"),
    ("<model>", "hall.world:4: cannot be read as XML: mismatched tag"),
])
def test_wrong_worlds(tmp_path, content, complaint):
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, content)


@pytest.mark.parametrize("name, content", [
    ("a.stl", b"solid\nfacet\nvertex 1 2 3\n"), ("a.stl", bytes(84)),
    ("a.obj", b"v 0 0 0\nf 1 2 3"), ("a.obj", b"v 0 0 nan\nf 1 1 1"),
    ("a.obj", b"v 0 0 0\nf -2 1 1"), ("a.dae", b"<a>"),
    ("a.dae", b"<COLLADA><library_visual_scenes><visual_scene><node id='n'><instance_node "
              b"url='#n'/></node></visual_scene></library_visual_scenes></COLLADA>")])
def test_wrong_meshes_are_left_out(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    found = read(tmp_path, box() + model(f"<mesh><uri>{name}</uri></mesh>"))
    assert found.notes[1] == f"left out, as not found beside the file or not readable: {name}"


def test_a_model_includes_itself(tmp_path):
    (tmp_path / "models" / "a").mkdir(parents=True)
    (tmp_path / "models" / "a" / "model.sdf").write_text(
        "<sdf><model name='a'><include><uri>model://a</uri></include></model></sdf>")
    with pytest.raises(InputError, match="a/model.sdf:1: more than 20000 models, or more than 20 "):
        read(tmp_path, "<include><uri>model://a</uri></include>")


def test_a_model_alone(tmp_path):
    (tmp_path / "crate.sdf").write_text(f"<sdf version='1.6'>{box(pose='1 0 0 0 0 0')}</sdf>")
    found = read_terrain(tmp_path / "crate.sdf", Choices())[1]
    assert blocks(found) == [square(0.0, -0.5, 2.0, 0.5)]
    (tmp_path / "crate.sdf").write_text("<sdf version='1.6'><light/></sdf>")
    with pytest.raises(InputError, match=r"crate.sdf: no <world> and no <model> in <sdf>"):
        read_terrain(tmp_path / "crate.sdf", Choices())
