"""``desim map``: terrains of other programs, looked at and made into scenarios."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image
from typer.testing import CliRunner

from desim.cli import app
from desim.scenario.load import load
from desim.world import sources

BUILDING = """\
levels:
  L1:
    vertices: [[0, 0], [400, 0], [400, 300], [0, 300], [200, 0], [200, 120], [200, 180], [200, 300]]
    walls: [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [6, 7]]
    doors: [[5, 6]]
    measurements: [[0, 1, {distance: [3, 20]}]]
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "house.building.yaml").write_text(BUILDING)
    return tmp_path


def done(*words):
    result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == 0, result.stderr
    return result.stdout


def refused(*words):
    result = CliRunner().invoke(app, list(map(str, words)))
    assert (result.exit_code, result.stdout) == (2, "")
    return result.stderr


def test_what_it_prints():
    assert done("map", "house.building.yaml") == """\
house.building.yaml: a building of the traffic editor
  size   22 m x 17 m, from x = -1 m, y = -16 m
  walls  6, 82 m in all
  doors  1, which stand open
  free   361.9 m2, 66.6 m2 of it outside
note: walls count as plasterboard, transparent ones as glass (--material)
"""


def test_what_else_a_building_has_is_counted():
    """Its furniture is not read, its lanes are no matter; a count of walls is that of the file."""
    Path("house.building.yaml").write_text(
        BUILDING + "    models: [{name: desk}, {name: bed}]\n    lanes: [[0, 1, {}]]\n"
        "    racks: [[0, 1]]\nlifts: {lift1: {}}\n")
    assert ("note: left out: models (2), racks (1), lifts (1)\n"
            in done("map", "house.building.yaml"))


def test_a_scenario_stands_on_it():
    """Its robots start inside of the house, and the door between its rooms is open."""
    done("map", "house.building.yaml", "--to", "house.yaml")
    scenario = load("house.yaml").scenario
    inside = [0.0 < pose.x_m < 20.0 and -15.0 < pose.y_m < 0.0
              for pose in scenario.fleet.start.poses]
    assert inside == [True, True] and len(scenario.environment.doors) == 1
    done("run", "house.yaml", "--until", "1s", "--quiet")
    manifest, = Path("results", "house").glob("*/manifest.json")
    assert json.loads(manifest.read_text())["simulated_s"] == 1.0


def test_a_map_of_ros_has_the_same_walls():
    done("map", "house.building.yaml", "--to", "house.pgm")
    facts = yaml.safe_load(Path("house.yaml").read_text())
    assert facts["image"] == "house.pgm" and facts["resolution"] == 0.05
    known = json.loads(done("map", "house.yaml", "--json"))
    assert known["free_parts_m2"] == pytest.approx([295.3, 66.6], rel=0.06)


def test_of_many_parts_the_largest_are_said():
    pixels = np.zeros((20, 12 * 20), np.uint8)
    for k in range(12):
        pixels[2:18, 20 * k + 2:20 * k + 18] = 255
    Image.fromarray(pixels).save("cells.png")
    known = json.loads(done("map", "cells.png", "--resolution", "0.1", "--json"))
    assert (known["free_parts"], len(known["free_parts_m2"])) == (12, 10)
    assert "2.6, ... m2" in done(
        "map", "cells.png", "--resolution", "0.1")


@pytest.mark.parametrize("margin, door, outside, parts", [
    (20, False, 49.4, [22.5, 2.0]),  # around the house; two rooms
    (20, True, 0.0, [82.0, 2.0]),  # a door leads outside
    (0, False, 0.0, [22.5, 2.0])])  # all of the picture is house
def test_the_ground_around_a_house_is_outside_and_no_part(margin, door, outside, parts):
    """A picture of a room of 5 m x 5 m, in which a closet of 1.4 m x 1.4 m is closed."""
    pixels = np.pad(np.zeros((52, 52), np.uint8), margin, constant_values=255)
    inside = pixels[margin:len(pixels) - margin, margin:len(pixels) - margin]
    inside[1:-1, 1:-1] = 255
    inside[20:36, 20:36] = 0
    inside[21:35, 21:35] = 255
    if door:
        inside[10:20, 0] = 255
    Image.fromarray(pixels).save("plan.png")
    known = json.loads(done("map", "plan.png", "--resolution", "0.1", "--json"))
    assert known["outside_m2"] == pytest.approx(outside, rel=0.2)
    assert known["free_parts_m2"] == pytest.approx(parts, rel=0.1)
    said = done("map", "plan.png", "--resolution", "0.1")
    assert ("m2 of it outside, inside in 2 parts that no way connects" in said) == bool(outside)


def test_a_raster_is_written_as_it_is():
    pixels = np.full((30, 40), 254, np.uint8)
    pixels[[0, -1]] = pixels[:, [0, -1]] = 0
    Image.fromarray(pixels).save("hall.pgm")
    Path("hall.yaml").write_text(yaml.safe_dump({
        "image": "hall.pgm", "resolution": 0.1, "origin": [1.0, 2.0, 0.0], "negate": 0,
        "occupied_thresh": 0.65, "free_thresh": 0.196}))
    done("map", "hall.yaml", "--to", "again.pgm")
    done("map", "hall.yaml", "--to", "scenario.yaml")
    first, again = (sources.load(load(*given).scenario.environment.terrain) for given in (
        ("scenario.yaml",), ("scenario.yaml", ["environment.terrain.map=again.yaml"])))
    assert (first.raster.solid == again.raster.solid).all() and first.bounds == again.bounds


def test_a_picture():
    assert done("map", "house.building.yaml", "--figure", "house.png").endswith(
        "written: house.png\n")
    with Image.open("house.png") as picture:
        assert picture.width == 1280


@pytest.mark.parametrize("words, complaint", [
    (["house.building.yaml", "--to", "house.txt"],
     "--to: house.txt ends neither like a scenario nor like a map; allowed: .yaml (a scenario), "
     ".pgm (a map of ROS, with a .yaml beside it)\n"),
    (["hall.yaml", "--level", "L1"],
     "--level: hall.yaml is a map of ROS (map_server), which leaves no such choice\n"),
    (["house.building.yaml", "--material", "wod"],
     "--material: unknown material 'wod' (did you mean 'wood'?); allowed: brick, "),
    (["nowhere.yaml"], "nowhere.yaml: cannot be read: No such file or directory\n"),
    (["notes.txt"], "notes.txt: no terrain; allowed: a map of ROS (map_server), an image, a "),
    (["robot.urdf"], "robot.urdf: no terrain; it looks like a robot description (URDF), which "
                     "desim robot reads; allowed: "),
])
def test_refusals(here, words, complaint):
    (here / "notes.txt").write_text("Dear diary\n")
    (here / "hall.yaml").write_text("image: hall.pgm\nresolution: 0.1\n")
    (here / "robot.urdf").write_text("<?xml version='1.0'?>\n<!-- mine -->\n<robot name='r'/>\n")
    assert refused("map", *words).startswith(complaint)


@pytest.mark.parametrize("name", ["house.building.yaml", "world.sdf"])
def test_a_scenario_names_the_command(here, name):
    (here / "world.sdf").write_text("<sdf version='1.7'><world name='w'/></sdf>")
    (here / "case.yaml").write_text(f"name: x\nenvironment: {{terrain: {name}}}\n")
    kind = {"house.building.yaml": "a building of the traffic editor",
             "world.sdf": "a Gazebo world (SDF)"}[name]
    assert refused("run", "case.yaml", "--quiet").endswith(
        f"{name}: no map_server file; it looks like {kind}, which desim map reads\n")
