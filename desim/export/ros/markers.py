"""Markers for what ROS has no message of: the terrain, the robots' bodies, and the links."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from desim import colours
from desim.export.link_loads import LinkLoad, LinkLoads, linked_pairs
from desim.export.ros.message_times import repeated, seconds
from desim.export.ros.message_types import MARKER_ARRAY, Message, RosTypes, Timed
from desim.results.source import ReplaySource
from desim.units import MM_PER_M

MARKER = "visualization_msgs/msg/Marker"
MAP_FRAME = "map"
LINE_LIST, TRIANGLE_LIST, _CYLINDER, _TEXT = 5, 11, 3, 9  # types of markers
FEET = " feet"  # follows the material in the namespace of walls that are drawn as lines
_WALL_M, _BODY_M, _LINK_M = 0.12, 0.4, 0.08  # shown so thick, high and wide
_BUSY_BYTES = 100_000  # a second: the full colour of a busy link


class Markers:
    """The marker arrays of ``recording``."""

    def __init__(self, recording: ReplaySource, types: RosTypes) -> None:
        self._recording, self._types = recording, types
        self._walls = recording.walls
        self._places = {host.name: host for host in recording.hosts}

    def terrain(self) -> Iterator[Timed]:
        """Walls by material, and again when a door moves."""
        instants = sorted({0, *(time_ns for wall in self._walls
                                for time_ns in (wall.from_ns, wall.until_ns))})
        for time_ns in repeated(instants, self._recording):
            standing = [wall for wall in self._walls if wall.from_ns <= time_ns < wall.until_ns]
            markers = []
            for number, material in enumerate(sorted({wall.material for wall in self._walls})):
                own = np.array([(wall.x1_mm, wall.y1_mm, wall.x2_mm, wall.y2_mm, wall.height_mm)
                                for wall in standing if wall.material == material
                                ]).reshape(-1, 5) / MM_PER_M
                markers += self._material(time_ns, number, material, own)
            yield time_ns, self._types.make(MARKER_ARRAY, markers=markers)

    def _material(self, time_ns: int, number: int, material: str, walls: np.ndarray
                  ) -> list[Message]:
        """Two markers: the feet of walls [n, 5] x1 y1 x2 y2 height in m as lines, and the walls."""
        point = self._types.point
        feet, faces = [], []
        for x1, y1, x2, y2, height in walls.tolist():
            feet += [point(x1, y1), point(x2, y2)]
            low, high = (point(x1, y1), point(x2, y2)), (point(x1, y1, height),
                                                         point(x2, y2, height))
            faces += [low[0], low[1], high[1], low[0], high[1], high[0]]
        colour = colours.of_material(material)
        return [self._marker(time_ns, material + FEET, number, LINE_LIST, colour, feet,
                             width_m=_WALL_M),
                self._marker(time_ns, material, number, TRIANGLE_LIST, colour, faces, alpha=0.45)]

    def robots(self) -> Iterator[Timed]:
        """A cylinder and a name in the frame of each robot."""
        types, names = self._types, self._recording.robots
        for time_ns in repeated([0], self._recording):
            markers = []
            for number, robot in enumerate(names):
                colour = types.colour(*colours.of_robot(number))
                for ns, kind, height_m, text, size in (
                        ("bodies", _CYLINDER, _BODY_M / 2, "", types.vector(0.5, 0.5, _BODY_M)),
                        ("names", _TEXT, 2 * _BODY_M, robot, types.vector(0.0, 0.0, 1.0))):
                    pose = types.make("geometry_msgs/msg/Pose", orientation=types.turned(0.0),
                                      position=types.point(0.0, 0.0, height_m))
                    markers.append(types.make(
                        MARKER, header=types.header(time_ns, f"{robot}/base_link"), ns=ns,
                        id=number, type=kind, pose=pose, scale=size, color=colour, text=text,
                        frame_locked=True))
            yield time_ns, types.make(MARKER_ARRAY, markers=markers)

    def links(self, loads: LinkLoads) -> Iterator[Timed]:
        """Each second: thin lines between hosts that reach each other, and thick ones between those
        that have exchanged messages in that second, the redder the more bytes."""
        agenda = list(linked_pairs(self._recording))
        linked: frozenset[tuple[str, str]] = frozenset()
        hosts = len(self._places)
        for second, time_ns in seconds(self._recording):
            while agenda and agenda[0][0] <= time_ns:
                linked = agenda.pop(0)[1]
            places = self._placed(time_ns)
            # Where all reach all, the lines would say nothing.
            shown = () if len(linked) >= hosts * (hosts - 1) else sorted(linked)
            quiet = self._lines(places, [(host, other) for host, other in shown
                                         if host < other or (other, host) not in linked])
            busy, shades = self._loaded(places, loads.at(second))
            yield time_ns, self._types.make(MARKER_ARRAY, markers=[
                self._marker(time_ns, "in reach", 0, LINE_LIST, colours.QUIET, quiet,
                             width_m=_LINK_M / 4, alpha=0.35),
                self._marker(time_ns, "traffic", 0, LINE_LIST, colours.BUSY, busy,
                             width_m=_LINK_M, alpha=0.8, shades=shades)])

    def _placed(self, time_ns: int) -> dict[str, tuple[float, float]]:
        """The places of the hosts that have one."""
        poses = self._recording.poses.at(time_ns)
        return {name: (float(poses[host.robot, 0]), float(poses[host.robot, 1]))
                if host.robot is not None else (host.x_m, host.y_m)
                for name, host in self._places.items()
                if host.robot is not None or np.isfinite(host.x_m)}

    def _lines(self, places: dict[str, tuple[float, float]], pairs: list[tuple[str, str]]
               ) -> list[Message]:
        return [self._types.point(*places[host], 0.3) for pair in pairs
                if pair[0] in places and pair[1] in places for host in pair]

    def _loaded(self, places: dict[str, tuple[float, float]], loads: list[LinkLoad]
                ) -> tuple[list[Message], list[Message]]:
        """The ends of links that carry messages, and a colour for each of them."""
        carried: dict[tuple[str, str], int] = {}
        for load in loads:
            pair = min(load.source, load.destination), max(load.source, load.destination)
            if load.messages and pair[0] in places and pair[1] in places:
                carried[pair] = carried.get(pair, 0) + load.size_bytes
        shades = [self._types.colour(*colours.between(
            colours.QUIET, colours.BUSY, min(carried[pair] / _BUSY_BYTES, 1.0) ** 0.5), 0.8)
            for pair in carried]
        return self._lines(places, list(carried)), [shade for shade in shades for _ in range(2)]

    def _marker(self, time_ns: int, ns: str, number: int, kind: int, colour: colours.Colour,
                points: list[Message], *, width_m: float = 1.0, alpha: float = 1.0,
                shades: list[Message] | None = None) -> Message:
        types = self._types
        scale = types.vector(width_m, width_m, width_m) if kind == TRIANGLE_LIST \
            else types.vector(width_m, 0.0, 0.0)
        return types.make(MARKER, header=types.header(time_ns, MAP_FRAME), ns=ns, id=number,
                          type=kind, action=0 if points else 2, pose=types.pose(0.0, 0.0),
                          scale=scale, color=types.colour(*colour, alpha), points=points,
                          colors=shades or [])
