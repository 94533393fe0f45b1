"""The node that makes an occupancy grid of the robot's own scans.

A scan must be placed with the pose of its own instant: at 5 rad/s, 40 ms are 0.2 rad. So the node
takes scans whose stamp is also that of a pose (at 25 Hz and 10 Hz, every 200 ms), whichever of the
two comes in first. Only where the rates have no such instants, or the partner was lost, does it
place a scan between two poses. A scan that is not taken is never computed.
"""

from __future__ import annotations

from desim.middleware.graph import Host, Message, Node
from desim.middleware.messages import Pose
from desim.middleware.topics import Latest
from desim.robot.poses import between, step
from desim.robot.tiles import Belief
from desim.scenario.schema import robot as parameters

PATIENCE_NS = 250_000_000  # without a common stamp for so long, interpolate
STILL_M, STILL_RAD = 0.001, 0.001  # a smaller step between two poses is standing still


class Mapping(Node):
    """Integrates a scan after the robot has driven or turned far enough since the last one, and one
    more where it has come to rest (gmapping: linearUpdate, angularUpdate); where that is asked for
    also when the last one is old (temporalUpdate).

    Publishes the belief itself on the local topic ``map`` whenever it changed it.
    """

    __slots__ = ("belief", "_mapping", "_scan", "_before", "_pose", "_integrated", "_looked_ns")

    def __init__(self, host: Host, mapping: parameters.Mapping, belief: Belief) -> None:
        super().__init__(host, "mapping")
        self.belief = belief
        self._mapping = mapping
        self._scan = Latest()
        self._before: Pose | None = None  # the latest pose but one
        self._pose: Pose | None = None  # the latest
        self._integrated: Pose | None = None  # where the last scan was taken in
        self._looked_ns = -PATIENCE_NS  # stamp of the last pose that had a scan

    def start(self) -> None:
        self.advertise("map")
        self._scan = self.latest("scan")
        self.subscribe("pose", self._on_pose)

    def _on_pose(self, message: Message) -> None:
        self._before, self._pose = self._pose, message.content
        pose, scan = self._pose, self._scan.message
        if scan is None:
            return
        if scan.born_ns == pose.stamp_ns:
            self._look(pose)
        elif self._before is not None and pose.stamp_ns - self._looked_ns > PATIENCE_NS:
            self._look_between(self._before, pose)

    def _look(self, pose: Pose) -> None:
        """The latest scan was taken at ``pose``."""
        self._looked_ns = pose.stamp_ns
        if self._due(pose):
            self._integrate(pose)

    def _look_between(self, before: Pose, pose: Pose) -> None:
        """There is no scan at ``pose``; perhaps the latest is one from shortly before."""
        if self._due(pose):
            stamp_ns = self._scan.message.content.stamp_ns
            if before.stamp_ns <= stamp_ns <= pose.stamp_ns:
                self._integrate(between(before, pose, stamp_ns))

    def _due(self, pose: Pose) -> bool:
        if self._integrated is None:
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
        last_m, last_rad = step(self._before, self._pose)
        return last_m <= STILL_M and last_rad <= STILL_RAD

    def _integrate(self, pose: Pose) -> None:
        self._integrated = pose
        version = self.belief.version
        self.belief.integrate_scan(pose.x_m, pose.y_m, pose.yaw_rad, self._scan.message.content,
                                   self._mapping.usable_range_m)
        if self.belief.version != version:
            self.publish("map", self.belief)
