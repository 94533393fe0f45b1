"""Recognizes files of other programs by their content, and names the command that reads each."""

from __future__ import annotations

import os
import re
from typing import NamedTuple

from desim.files import opened

_HEAD_BYTES = 65_536  # enough to get past comments and licences

MAP, ROBOT, RECORDING, SLAM = "desim map", "desim robot", "desim import", "desim slam"


class FileKind(NamedTuple):
    """A format: its name in a sentence, and the command that reads it, if there is one."""

    name: str
    command: str = ""


MAP_SERVER = FileKind("a map of ROS (map_server)", MAP)
IMAGE = FileKind("an image", MAP)
BUILDING = FileKind("a building of the traffic editor", MAP)
SDF = FileKind("a Gazebo world (SDF)", MAP)
STAGE = FileKind("a Stage world", MAP)
MOVING_AI = FileKind("a MovingAI grid map", MAP)
SVG = FileKind("an SVG drawing", MAP)
DXF = FileKind("a DXF drawing", MAP)
URDF = FileKind("a robot description (URDF)", ROBOT)
ROS_PARAMETERS = FileKind("a file of ROS parameters", ROBOT)
LAUNCH = FileKind("a launch file of ROS 1", ROBOT)
MCAP = FileKind("an MCAP file", RECORDING)
ROS_1_BAG = FileKind("a bag of ROS 1", RECORDING)
ROS_2_DATABASE = FileKind("a database of ROS 2 (.db3)", RECORDING)
TUM = FileKind("a TUM trajectory", RECORDING)
CARMEN = FileKind("a log of CARMEN", SLAM)
POSE_GRAPH = FileKind("a pose graph (g2o), which no command of desim reads")
LFS = FileKind("a pointer of Git LFS, without the file, which git lfs pull fetches")

_NUMBER = rb"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"

# In this order, each by what its first bytes have.
_BY_BYTES = [(MCAP, rb"\x89MCAP0\r\n"), (ROS_1_BAG, rb"#ROSBAG V"),
             (ROS_2_DATABASE, rb"SQLite format 3\0"),
             (IMAGE, rb"P[1-6]\s|\x89PNG|BM.{4}\0\0\0\0|\xff\xd8\xff|II\*\0|MM\0\*"),
             (LFS, rb"version https://git-lfs\.github\.com/"),
             (POSE_GRAPH, rb"(?:VERTEX|EDGE)_SE[23]"),
             (DXF, rb"AutoCAD Binary DXF|AC10\d\d|(?:\s*999\r?\n[^\n]*\n)*\s*0\r?\n\s*SECTION"),
             (MOVING_AI, rb"(?:type\s+\w+\s+)?height\s+\d+\s+width\s+\d+\s+map\b"),
             (TUM, rb"(?:\s*#[^\n]*\n)*\s*" + rb"[ \t]+".join([_NUMBER] * 8) + rb"\s*?(?:\n|\Z)")]
_BY_ROOT = {b"sdf": SDF, b"gazebo": SDF, b"world": SDF, b"svg": SVG, b"robot": URDF,
            b"launch": LAUNCH}
# Possessive: to search again from each place would take a hostile file's size squared.
_ROOT = re.compile(rb"(?:<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>\[]*+(?>\[.*?\])?[^>]*+>|\s++)*+"
                   rb"<(?:\w++:)?+(\w+)", re.DOTALL)
# All of a format's lines must be there.
_BY_LINE = [(CARMEN, [rb"^(?:FLASER|ROBOTLASER1|RAWLASER1|ODOM|PARAM) "]),
            (MAP_SERVER, [rb"^image[ \t]*:", rb"^resolution[ \t]*:"]),
            (BUILDING, [rb"^levels[ \t]*:"]),
            (ROS_PARAMETERS, [
                rb"^(?:[ \t]++ros__parameters|(?=\w*costmap)\w++|\w++(?<=\wPlannerROS)|footprint|"
                rb"controller_frequency|min_frontier_size|rmf_fleet)[ \t]*:"]),
            (STAGE, [rb"^[ \t]*+(?:define[ \t]++\w++[ \t]++\w++|"
                     rb"model|position|floorplan|window)\s*+\(|^[ \t]*+include[ \t]++\""])]


def kind_of(path: str | os.PathLike) -> FileKind | None:
    """The format of a file, None for another one. Raises ``OSError``."""
    with opened(path) as file:
        head = file.read(_HEAD_BYTES).removeprefix(b"\xef\xbb\xbf")
    for kind, pattern in _BY_BYTES:
        if re.match(pattern, head, re.DOTALL):
            return kind
    if root := _ROOT.match(head):
        return _BY_ROOT.get(root[1])
    return next((kind for kind, patterns in _BY_LINE
                 if all(re.search(pattern, head, re.MULTILINE) for pattern in patterns)), None)


def advice(path: str | os.PathLike) -> str:
    """A clause that names a file's format and the command that reads it; empty for other files,
    and for one that cannot be read."""
    try:
        kind = kind_of(path)
    except (OSError, ValueError):
        return ""
    if kind is None:
        return ""
    return f"it looks like {kind.name}" + (f", which {kind.command} reads" if kind.command else "")
