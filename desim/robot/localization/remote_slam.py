"""SLAM on another host than its robot.

It subscribes to the robot's scans and odometry over the network. The robot gets the transform
``map_to_odom`` for each odometry that arrives here, and whole maps, as slam_gmapping publishes
them. The robot's ``PosePublisher`` and ``MapReceiver`` take them, so what it knows is as old as the
last message that it got.
"""

from __future__ import annotations

from fractions import Fraction

from desim.middleware.host import Host
from desim.ports import Pose2D
from desim.ports.localization import Localization
from desim.robot.localization.pose_publisher import CorrectionNode
from desim.robot.mapping.map_receiver import SLAM_MAP, WholeMap
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import LayerSnapshot
from desim.scenario.schema.robot import Equipment
from desim.units import NS_PER_S


class RemoteSlam(CorrectionNode):
    """SLAM for the robot ``name``, which draws into ``robot_map``, a map of its own.

    The first map is published when there is one, later ones every ``localization.map_period_ns`` if
    something was drawn since.
    """

    def __init__(self, host: Host, name: str, localization: Localization, robot: Equipment,
                 robot_map: RobotMap, start: Pose2D | None, bodies_m: float,
                 team: tuple[str, ...] = ()) -> None:
        super().__init__(host, localization, robot, robot_map, start, bodies_m, team,
                         namespace=name)
        self._period_ns = robot.localization.map_period_ns
        self._published: LayerSnapshot | None = None

    def start(self) -> None:
        super().start()
        self.timer(Fraction(NS_PER_S, self._period_ns), lambda _: self._publish_map(), name="map")

    def _advertise_map(self) -> None:
        self.advertise(SLAM_MAP, latch=True)

    def _announce_map(self) -> None:
        if self._published is None:
            self._publish_map()

    def _publish_map(self) -> None:
        layer = self.robot_map.own.snapshot()
        if layer is self._published or not len(layer.filled()):
            return
        self._published = layer
        spec = self.robot_map.spec
        self.publish(SLAM_MAP, WholeMap(layer, spec.cells + self.robot_map.padding))
