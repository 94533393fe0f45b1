"""The ``LocalizationContext`` of a robot: the inputs and the actions of a localization."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from desim.ports import Pose2D
from desim.ports.arguments import check_callback, check_content, check_period, name_of
from desim.ports.localization import (
    LaserGeometry,
    LocalizationContext,
    MapSettings,
    OdometryErrors,
    ScanWithOdometry,
)
from desim.ports.sharing import SharedMessage, Sized
from desim.scenario.schema.robot import Equipment
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.robot.localization.node import LocalizationNode


def team_topic(robot: str) -> str:
    """The topic on which the localization of ``robot`` speaks to its team."""
    return f"/localization/{robot}"


class SensorContext:
    """The ``LocalizationContext`` of a robot."""

    def __init__(self, node: LocalizationNode, robot: Equipment, start: Pose2D | None,
                 bodies_m: float) -> None:
        self._node, self.start, self.bodies_m = node, start, bodies_m
        laser, mapping, odometry = robot.first_laser, robot.mapping, robot.odometry
        self.laser = LaserGeometry(-0.5 * laser.field_of_view_rad, laser.increment_rad,
                                   laser.max_range_m,
                                   mount=Pose2D(laser.x_m, laser.y_m, laser.yaw_rad))
        self.map = MapSettings(mapping.resolution_m, mapping.linear_update_m,
                               mapping.angular_update_rad, mapping.usable_range_m)
        self.odometry_errors = OdometryErrors(odometry.model == "random_walk",
                                              odometry.position_noise_m,
                                              odometry.heading_noise_rad)

    @property
    def name(self) -> str:
        return self._node.namespace

    @property
    def now_ns(self) -> int:
        return self._node.now_ns

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._node.stream(*name)

    def key(self, *name: str | int) -> int:
        return self._node.noise_key(*name)

    def draw(self, scan: ScanWithOdometry, pose: Pose2D) -> None:
        self._node.draw(scan, pose)

    def redraw(self, poses: np.ndarray) -> None:
        self._node.redraw(poses)

    @property
    def team(self) -> tuple[str, ...]:
        return self._node.team

    @property
    def strangers(self) -> tuple[str, ...]:
        return self._node.strangers

    def publish(self, content: Sized) -> None:
        check_content(content)
        self._node.publish(team_topic(self.name), content)

    def listen(self, callback: Callable[[LocalizationContext, SharedMessage], object]) -> None:
        check_callback(callback, "context", "message")
        self._node.advertise(team_topic(self.name), queue=0)
        for peer in self.team + self.strangers:
            self._node.subscribe(team_topic(peer), lambda message: callback(
                self, SharedMessage(message.origin.name, message.content,
                                    message.origin.clock_ns(message.born_ns))), queue=0)

    def closed(self, source: str, theirs: int, own: int, motion: np.ndarray) -> None:
        self._node.record_closure(source, theirs, own, motion)

    def place(self, source: str, frame: Pose2D) -> None:
        self._node.robot_map.frames[source] = frame

    def every(self, period_ns: int, callback: Callable[[LocalizationContext], object]) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._node.timer(Fraction(NS_PER_S, period_ns), lambda _: callback(self),
                         name=name_of(callback))

    def worked(self, **quantities: int) -> None:
        self._node.worked(**quantities)
