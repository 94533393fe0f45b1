"""The node that makes an occupancy grid of the robot's own scans.

A scan must be placed with the pose of its own instant: at 5 rad/s, 40 ms are 0.2 rad. So the node
takes scans that have the same stamp as a pose (at 25 Hz and 10 Hz, every 200 ms), whichever of the
two arrives first. If the rates have no common instants, or a message was lost, it interpolates
between two poses. The ranges of a scan that is not taken are never computed.
"""

from __future__ import annotations

from desim.middleware.contents import EMPTY, LaserScan, Pose
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.stamped_poses import between, step
from desim.scenario.schema import robot as parameters

# Time without a common stamp after which poses are interpolated: more than the 200 ms between two
# of them at 25 Hz and 10 Hz. (20 % less or more changes no run of scenarios/maze_8.yaml.)
PATIENCE_NS = 250_000_000
STILL_M, STILL_RAD = 0.001, 0.001  # a smaller step between two poses is standing still: far below
#                                    what a robot drives or turns in 100 ms


class Mapping(Node):
    """Integrates a scan of the laser of ``topic`` into ``robot_map`` when the robot has driven or
    turned far enough since the last one (gmapping: linearUpdate, angularUpdate), and one more when
    it has come to rest. With ``temporal_update`` also when the last one is old (temporalUpdate).

    The event ``map`` announces each change of the map to other nodes of the host.
    """

    def __init__(self, host: Host, mapping: parameters.MappingParams, robot_map: RobotMap,
                 topic: str = parameters.SCAN) -> None:
        super().__init__(host, "mapping" if topic == parameters.SCAN else f"{topic}/mapping")
        self.robot_map, self._topic = robot_map, topic
        self._mapping = mapping
        self._scan: PolledSubscription
        self._pose: Pose | None = None  # the latest
        self._integrated: Pose | None = None  # of the last scan that was integrated
        self._matched_ns = -PATIENCE_NS  # stamp of the last pose that had a scan

    def start(self) -> None:
        self.advertise("map")
        self._scan = self.latest(self._topic)
        self.subscribe("pose", self._on_pose)

    def kept(self) -> dict[str, int]:
        """See ``Node.kept``: the map that it publishes."""
        return {"cells": self.robot_map.spec.cells}

    def _on_pose(self, message: Message) -> None:
        before, scan = self._pose, self._scan.read()
        pose: Pose = message.content
        self._pose = pose
        if scan is None:
            return
        if scan.stamp_ns == pose.stamp_ns:
            self._matched_ns = pose.stamp_ns
            if self._due(before, pose):
                self._integrate(scan.content, pose)
        elif (before is not None and pose.stamp_ns - self._matched_ns > PATIENCE_NS
              and self._due(before, pose)):
            stamp_ns = scan.content.stamp_ns
            if before.stamp_ns <= stamp_ns <= pose.stamp_ns:
                self._integrate(scan.content, between(before, pose, stamp_ns))

    def _due(self, before: Pose | None, pose: Pose) -> bool:
        """Whether a scan at ``pose`` is to be integrated; ``before``: the pose before that one."""
        if before is None or self._integrated is None:
            return True
        moved_m, turned_rad = step(self._integrated, pose)
        if (moved_m >= self._mapping.linear_update_m
                or turned_rad >= self._mapping.angular_update_rad):
            return True
        old_ns = self._mapping.temporal_update_ns
        if old_ns is not None and pose.stamp_ns - self._integrated.stamp_ns >= old_ns:
            return True
        if moved_m <= STILL_M and turned_rad <= STILL_RAD:
            return False
        last_m, last_rad = step(before, pose)
        return last_m <= STILL_M and last_rad <= STILL_RAD

    def _integrate(self, scan: LaserScan, pose: Pose) -> None:
        self._integrated = pose
        self.worked(scans=1, beams=len(scan.ranges))
        version = self.robot_map.version
        self.robot_map.integrate_scan(pose.x_m, pose.y_m, pose.yaw_rad, scan,
                                   self._mapping.usable_range_m)
        if self.robot_map.version != version:
            self.publish("map", EMPTY)
