"""The messages of a robot with a pose graph to its team."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.robot.slam.fleet_graph import Closure, Encounter

_MOTION_BYTES, _INFORMATION_BYTES, _NUMBER_BYTES = 24, 48, 8  # float64, as geometry_msgs has them
_NAME_BYTES = 4  # of a std_msgs/String, beside its letters


class GraphNode(NamedTuple):
    """A node: its stamp, the ``motion`` [3] from the one before (of the first, its pose), the
    ``information`` [3, 3] on it, and the ranges [beams] of its scan, if those are sent (float32, as
    in sensor_msgs/LaserScan)."""

    stamp_ns: int
    motion: np.ndarray
    information: np.ndarray
    scan: np.ndarray | None

    @property
    def size_bytes(self) -> int:
        return (_NUMBER_BYTES + _MOTION_BYTES + _INFORMATION_BYTES + 4
                + (0 if self.scan is None else 4 * len(self.scan)))


class GraphNews(NamedTuple):
    """Nodes of a robot that started at ``session`` ns, counted from ``first`` on, and its ties from
    ``first_tie`` on."""

    session: int
    first: int
    nodes: tuple[GraphNode, ...]
    first_tie: int
    ties: tuple[Closure | Encounter, ...]

    @property
    def size_bytes(self) -> int:
        return (5 * _NUMBER_BYTES + sum(node.size_bytes for node in self.nodes)
                + sum(2 * _NUMBER_BYTES + _NAME_BYTES + len(tie.source) + 2 * _MOTION_BYTES
                      + _INFORMATION_BYTES for tie in self.ties))


class WantedNews(NamedTuple):
    """A request to ``source``: its nodes from ``first`` on, and its ties from ``first_tie`` on."""

    source: str
    session: int
    first: int
    first_tie: int

    @property
    def size_bytes(self) -> int:
        return _NAME_BYTES + len(self.source) + 3 * _NUMBER_BYTES
