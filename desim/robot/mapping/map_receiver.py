"""The node that takes in the map that SLAM on another host draws of its robot's scans."""

from __future__ import annotations

from typing import NamedTuple

from desim.middleware.contents import EMPTY, occupancy_grid_bytes
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import LayerSnapshot

SLAM_MAP = "slam_map"  # gmapping's topic map; here that one announces the map that nodes share


class WholeMap(NamedTuple):
    """A nav_msgs/OccupancyGrid of ``cells``: the evidence of one robot, as it was."""

    layer: LayerSnapshot
    cells: int

    @property
    def size_bytes(self) -> int:
        return occupancy_grid_bytes(self.cells)


class MapReceiver(Node):
    """Replaces the own layer of ``robot_map`` by each map that arrives on ``slam_map``.

    The event ``map`` announces each change to other nodes of the host.
    """

    def __init__(self, host: Host, robot_map: RobotMap) -> None:
        super().__init__(host, "map_receiver")
        self.robot_map = robot_map

    def start(self) -> None:
        self.advertise("map")
        self.subscribe(SLAM_MAP, self._on_map)

    def _on_map(self, message: Message) -> None:
        received: WholeMap = message.content
        self.worked(cells=received.cells)
        if self.robot_map.replace_own(received.layer):
            self.publish("map", EMPTY)
