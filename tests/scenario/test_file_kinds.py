"""Files of other programs: each is recognized by its first bytes, with the command for it."""

import pytest

from desim.scenario.file_kinds import advice, kind_of

POSE = b"1.5 0 0 0 0 0 0 1"
KINDS = [
    (b"\x89MCAP0\r\n...", "an MCAP file", "desim import"),
    (b"#ROSBAG V2.0\n", "a bag of ROS 1", "desim import"),
    (b"SQLite format 3\0...", "a database of ROS 2 (.db3)", "desim import"),
    (b"P5\n10 10\n255\n", "an image", "desim map"), (b"P1 2 2", "an image", "desim map"),
    (b"\x89PNG\r\n", "an image", "desim map"), (b"BM\x0a\0\0\0\0\0\0\0", "an image", "desim map"),
    (b"\xff\xd8\xff\xe0", "an image", "desim map"), (b"II*\0", "an image", "desim map"),
    (b"MM\0*", "an image", "desim map"),
    (b"999\nby hand\n  0\nSECTION\n", "a DXF drawing", "desim map"),
    (b"AutoCAD Binary DXF\r\n", "a DXF drawing", "desim map"),
    (b"AC1015", "a DXF drawing", "desim map"),
    (b"type octile\nheight 3\nwidth 4\nmap\n", "a MovingAI grid map", "desim map"),
    (b"# time x y z q\n" + POSE + b"\n", "a TUM trajectory", "desim import"),
    (POSE, "a TUM trajectory", "desim import"),
    (b"<?xml version='1.0'?><!-- by hand --><sdf version='1.6'>", "a Gazebo world (SDF)",
     "desim map"),
    (b"<world>", "a Gazebo world (SDF)", "desim map"),
    (b"<gazebo>", "a Gazebo world (SDF)", "desim map"),
    (b"<!DOCTYPE svg PUBLIC 'x' 'y'>\n<svg:svg>", "an SVG drawing", "desim map"),
    (b"\xef\xbb\xbf<robot name='r'>", "a robot description (URDF)", "desim robot"),
    (b"<launch>", "a launch file of ROS 1", "desim robot"),
    (b"# x\nFLASER 180 1.0", "a log of CARMEN", "desim slam"),
    (b"PARAM robot_front 1", "a log of CARMEN", "desim slam"),
    (b"image: a.pgm\nresolution: 0.05\n", "a map of ROS (map_server)", "desim map"),
    (b"resolution: 0.05\nnegate: 0\nimage : a.pgm\n", "a map of ROS (map_server)", "desim map"),
    (b"name: x\nlevels:\n  L1:\n", "a building of the traffic editor", "desim map"),
    (b"global_costmap:\n  update: 5\n", "a file of ROS parameters", "desim robot"),
    (b"node:\n  ros__parameters:\n", "a file of ROS parameters", "desim robot"),
    (b"TrajectoryPlannerROS:\n", "a file of ROS parameters", "desim robot"),
    (b"define wall model\n(\n", "a Stage world", "desim map"),
    (b"include \"map.inc\" (", "a Stage world", "desim map"),
    (b"# a hall\n  floorplan\n( name \"cave\" )", "a Stage world", "desim map"),
]
OTHERS = [b"", b"name: x\nfleet: {size: 2}\n", b"<html>", b"1 2 3 4 5 6 7\n", POSE + b" 9\n",
          b"image: a.pgm\n", b"\x89MCAP1\r\n", b"height 3 map",
          b"cmake_minimum_required(VERSION 3.5)\nproject(maze)\ninclude(CTest)\n",
          b"#include \"map.h\"\nint main(\n) {}\n", b"A licence\n  grants (freely) this\n"]


@pytest.mark.parametrize("content, name, command", KINDS)
def test_a_file_is_known_by_its_content(tmp_path, content, name, command):
    (tmp_path / "file").write_bytes(content)
    assert advice(tmp_path / "file") == f"it looks like {name}, which {command} reads"


@pytest.mark.parametrize("content, known", [
    (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
     "it looks like a pointer of Git LFS, without the file, which git lfs pull fetches"),
    (b"VERTEX_SE2 0 0 0 0\n", "it looks like a pose graph (g2o), which no command of desim reads")])
def test_what_no_command_reads_is_named(tmp_path, content, known):
    (tmp_path / "file").write_bytes(content)
    assert advice(tmp_path / "file") == known


@pytest.mark.parametrize("content", OTHERS)
def test_of_another_file_nothing_is_said(tmp_path, content):
    (tmp_path / "file").write_bytes(content)
    assert kind_of(tmp_path / "file") is None and advice(tmp_path / "file") == ""


def test_of_a_file_that_cannot_be_read_nothing_is_said(tmp_path):
    assert advice(tmp_path / "none") == "" and advice("\0") == ""


@pytest.mark.parametrize("again", [
    "\n", "define\n", "costmap", "image:\n", " ros__parameters\n", "<!---->", "<!DOCTYPE [", "]",
    "PlannerROS"])
def test_a_hostile_head_takes_no_time_that_grows_with_its_square(tmp_path, again):
    """A search that begins again at each place took 44 s for 64 KiB of spaces."""
    (tmp_path / "file").write_bytes(b"<!DOCTYPE [" * (again == "]") + again.encode() * 65_536)
    assert kind_of(tmp_path / "file") is None


def test_comments_and_licences_of_64_kib_are_passed_over(tmp_path):
    for behind, known in ((65_536 - len("<svg>"), True), (65_536, False)):
        (tmp_path / "file").write_bytes(b" " * behind + b"<svg>")
        assert (kind_of(tmp_path / "file") is not None) == known
