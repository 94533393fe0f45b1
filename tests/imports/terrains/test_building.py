"""Buildings of the traffic editor."""

import pytest
import yaml

from desim.errors import InputError
from desim.imports.terrains.found import Choices
from desim.imports.terrains.read import read_terrain

HOUSE = {
    "name": "house", "levels": {
        "L1": {
            "vertices": [[100, 100, 0, ""], [500, 100, 0, ""], [500, 400, 0, ""],
                         [100, 400, 0, ""], [300, 100, 0, ""], [300, 220, 0, ""],
                         [300, 280, 0, ""], [300, 400, 0, ""]],
            "walls": [[0, 1, {}], [1, 2, {"alpha": [3, 0.3]}], [2, 3, {}], [3, 0, {}],
                      [4, 5, {}], [6, 7, {}]],
            "doors": [[5, 6, {"type": [1, "hinged"]}]],
            "measurements": [[0, 1, {"distance": [3, 20.0]}]]},
        "roof": {"vertices": [], "walls": []}}}


def changed(**level):
    return {"levels": {"L1": {**HOUSE["levels"]["L1"], **level}}}


def read(folder, data=HOUSE, **choices):
    file = folder / "house.building.yaml"
    file.write_text(yaml.safe_dump(data))
    return read_terrain(file, Choices(**choices))[1]


def test_a_house(tmp_path):
    """400 pixels are 20 m, and y points down; around the house there is 1 m of ground."""
    found = read(tmp_path)
    shape = found.source
    assert (shape.size_m, shape.centre_m) == ((22.0, 17.0), (15.0, -12.5))
    assert [(wall.start_m, wall.end_m) for wall in shape.walls[:2]] == [
        ((5.0, -5.0), (25.0, -5.0)), ((25.0, -5.0), (25.0, -20.0))]
    assert [wall.material for wall in shape.walls[:3]] == ["plasterboard", "glass", "plasterboard"]
    assert {(wall.thickness_m, wall.height_m) for wall in shape.walls} == {(0.1, 2.5)}
    door, = found.doors
    assert (door.start_m, door.end_m) == ((15.0, -11.0), (15.0, -14.0))
    assert door.open_ns == ((0, 3600 * 10**12),)
    assert found.notes == ("level L1; others: roof (--level)",
                           "walls count as plasterboard, transparent ones as glass (--material)")


def test_metres_are_not_turned_over(tmp_path):
    walls = read(tmp_path, {**HOUSE, "coordinate_system": "cartesian_meters"}).source.walls
    assert (walls[1].start_m, walls[1].end_m) == ((500.0, 100.0), (500.0, 400.0))


def test_a_scale_and_a_material_that_are_chosen(tmp_path):
    shape = read(tmp_path, changed(measurements=[]), scale=0.1, material="brick",
                 height_m=3.0).source
    assert shape.size_m == (42.0, 32.0)
    assert {(wall.material, wall.height_m) for wall in shape.walls} == {("brick", 3.0)}


@pytest.mark.parametrize("data, complaint", [
    (changed(measurements=[]), "no measurement gives the length of a pixel; use --scale METRES"),
    (changed(walls=[[0, 8, {}]]), "levels.L1.walls.0: must begin with the numbers of two of its 8 "
                                  r"vertices, got \[0, 8, {}\]"),
    (changed(vertices=[["a", 1]]), "levels.L1.vertices.0: must begin with two numbers, x and y, "
                                   r"got \['a', 1\]"),
    (changed(walls=7), "levels.L1.walls: must be a list, got 7"),
    (changed(walls=[]), "no level has walls; levels: L1"),
    ({"levels": [1]}, r"levels: must be a mapping, got \[1\]"),
    ({**HOUSE, "coordinate_system": "web_mercator"}, "coordinate_system 'web_mercator' is not "
                                                     "supported; allowed: reference_image, "),
])
def test_wrong_buildings(tmp_path, data, complaint):
    with pytest.raises(InputError, match=f"house.building.yaml: {complaint}"):
        read(tmp_path, data)


def test_a_level_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match=r"--level L3: .* has no such level; "
                                         "allowed: L1, roof"):
        read(tmp_path, level="L3")
