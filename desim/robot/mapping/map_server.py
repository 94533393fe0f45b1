"""The node that gives its robot the map of a terrain that is known (ROS's map_server)."""

from __future__ import annotations

import numpy as np

from desim.middleware.contents import EMPTY
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.ports.tasks import Ground
from desim.robot.mapping.kernels.evidence import CLAMP_HIGH, CLAMP_LOW
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import LayerSnapshot, TilePool, drawn

_SOURCE = "map_server"  # of this evidence


def map_of_terrain(pool: TilePool, ground: Ground) -> LayerSnapshot:
    """The strongest evidence of all walls, and of the free cells that a laser can reach."""
    return drawn(pool, ground.grid, np.where(
        ground.solid != 0, CLAMP_HIGH, np.where(ground.reachable, CLAMP_LOW, 0)).astype(np.int8))


class MapServer(Node):
    """Hands the map to the robot's map at its start, and announces it until move_base announces on
    ``costmap`` that it uses the map."""

    def __init__(self, host: Host, robot_map: RobotMap, terrain: LayerSnapshot) -> None:
        super().__init__(host, "map_server")
        self._map, self._terrain = robot_map, terrain

    def start(self) -> None:
        self.advertise("map")
        self.subscribe("costmap", self._on_costmap)
        self._map.receive([(_SOURCE, 0, self._terrain)])
        self._ticker = self.timer(1, lambda _: self.publish("map", EMPTY), name="map")

    def _on_costmap(self, _: Message) -> None:
        self._ticker.cancel()
