"""The node that sends the robot's map and its travelled distance to the paper's monitor."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np

from desim.middleware.contents import Float64, Lazy, Pose, occupancy_grid_bytes
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.ports import GridSpec
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import LayerSnapshot, occupancy
from desim.units import NS_PER_S

Layers = tuple[LayerSnapshot, ...]


class MonitorFeed(Node):
    """Every ``period_ns`` publishes the robot's map on ``explored_map`` (a nav_msgs/OccupancyGrid;
    int8 [height, width]: 0 free, 100 occupied, -1 unknown), and on ``distance`` the metres that the
    robot has travelled, summed from pose to pose."""

    def __init__(self, host: Host, robot_map: RobotMap, period_ns: int) -> None:
        super().__init__(host, "monitor_feed")
        self.robot_map = robot_map
        self._period_ns = period_ns
        self._size_bytes = occupancy_grid_bytes(
            robot_map.spec.width * robot_map.spec.height + robot_map.padding)
        self._pose: Pose | None = None
        self._travelled_m = 0.0

    def start(self) -> None:
        self._explored = self.advertise("explored_map")
        self._distance = self.advertise("distance")
        self.subscribe("pose", self._on_pose)
        self.timer(Fraction(NS_PER_S, self._period_ns), self._on_period, name="period")

    def _on_pose(self, message: Message) -> None:
        before, pose = self._pose, message.content
        self._pose = pose
        if before is not None:
            self._travelled_m += math.hypot(pose.x_m - before.x_m, pose.y_m - before.y_m)

    def _on_period(self, _: int) -> None:
        if self._explored.has_subscribers():
            self.worked(cells=self.robot_map.spec.width * self.robot_map.spec.height)
            self._explored.publish(Lazy(
                self._size_bytes, _fused_occupancy, self.robot_map.spec, self.robot_map.fusion_of,
                self.robot_map.layers()))
        self._distance.publish(Float64(self._travelled_m))


def _fused_occupancy(spec: GridSpec, fusion_of: Callable[[Layers], np.ndarray],
                     layers: Layers) -> np.ndarray:
    return occupancy(spec, fusion_of(layers))
