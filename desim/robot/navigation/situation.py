"""The situation of a robot that drives: the ``LocalContext`` of its local planner."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.middleware.contents import Pose, Twist
from desim.ports.local_planners import BodyShape, Inflation, LocalArrays, MotionLimits, NearbyBody
from desim.robot.navigation.footprint_cover import cover
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.kernels import dynamic_window as kernels
from desim.robot.navigation.local_costmap import LocalCostmap
from desim.robot.navigation.moving_bodies import MovingBodies
from desim.robot.navigation.rest_of_path import RestOfPath
from desim.robot.navigation.scan_points import PlacedScan
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.units import NS_PER_S, seconds

_MARGIN_M = 0.3  # distance of the aim beyond a rollout's reach; maze_8: 192, 164 s

_new = tuple.__new__  # a named tuple at half the price
_carrot = compiled_function(kernels.carrot)
_can_turn = compiled_function(kernels.can_turn)

Position = tuple[float, float, float]  # x m, y m, yaw rad


class PlannerNode(Protocol):
    """As much of a node as its situation needs."""

    @property
    def namespace(self) -> str: ...

    @property
    def now_ns(self) -> int: ...

    @property
    def worked(self) -> Callable[..., None]: ...

    def stream(self, *name: str | int) -> np.random.Generator: ...


class Situation:
    """Keeps the local costmap, the path to follow, and the velocity that was commanded last."""

    def __init__(self, node: PlannerNode, navigation: Navigation, body: BodyType,
                 around: GlobalCostmap, moving: MovingBodies | None = None) -> None:
        self._node, self._moving = node, moving
        self.limits = MotionLimits(body.max_speed_mps, body.max_turn_radps, body.acceleration_mps2,
                             body.turn_acceleration_radps2, float(1 / navigation.control_rate_hz))
        self.shape = BodyShape(body.radius_m, body.inscribed_radius_m, body.corners_m)
        self.inflation = Inflation(navigation.inflation_radius_m, navigation.inflation_scaling)
        self.cell_m = navigation.local_resolution_m
        self.goal_tolerance_m = navigation.goal_tolerance_m
        self.position: Position = 0.0, 0.0, 0.0
        self.speed_mps = 0.0
        self.turn_radps = 0.0
        self.path = np.zeros((1, 2))
        self._speed_step_mps = body.acceleration_mps2 * self.limits.period_s
        self._turn_step_radps = body.turn_acceleration_radps2 * self.limits.period_s
        setup = _setup(navigation, body, self._speed_step_mps, self._turn_step_radps)
        self.costmap = LocalCostmap(
            navigation.local_size_m, navigation.local_resolution_m,
            body.radius_m - body.inscribed_radius_m
            + max(navigation.inflation_radius_m, float(setup[0]["safe_m"])), around)
        self.arrays = LocalArrays(
            setup, cover(body, navigation.local_resolution_m), self.costmap.near2,
            self.costmap.layer, self.costmap.scan, around.flat, around.frame)
        self._rest: RestOfPath | None = None
        self.worked = node.worked

    def observe(self, scans: Sequence[PlacedScan]) -> None:
        """Take in the newest scan of each laser, each with the robot's pose then."""
        self.costmap.observe(scans)
        if self._moving is not None:
            scan, pose = scans[0]
            self._moving.observe(self.costmap.points(), np.array(pose[:2]), scan.stamp_ns)

    def follow(self, path: np.ndarray) -> None:
        """Follow the way points ``path`` [n, 2] in m from now on."""
        self.path, self._rest = path, None

    def can_turn(self, by_rad: float) -> bool:
        """Whether the robot can turn on the spot ``by_rad`` to the left. A disc can."""
        arrays = self.arrays
        return not len(arrays.cover) or _can_turn(
            *self.position, by_rad, arrays.setup, arrays.cover, arrays.near2, arrays.scan)

    def command(self, speed_mps: float, turn_radps: float) -> Twist:
        """Note that this velocity is commanded, and return it as a message. The motors get as near
        to it as they can in one control period."""
        # Without ``min`` and ``max``: that would be four calls more, 300 times a second in maze_30.
        low_mps, high_mps = (self.speed_mps - self._speed_step_mps,
                             self.speed_mps + self._speed_step_mps)
        self.speed_mps = (low_mps if speed_mps < low_mps else
                          high_mps if speed_mps > high_mps else speed_mps)
        low_radps, high_radps = (self.turn_radps - self._turn_step_radps,
                                 self.turn_radps + self._turn_step_radps)
        self.turn_radps = (low_radps if turn_radps < low_radps else
                           high_radps if turn_radps > high_radps else turn_radps)
        return _new(Twist, (speed_mps, 0.0, turn_radps))

    def extrapolate(self, pose: Pose, at_ns: int) -> Position:
        """The position at an instant near that of ``pose``, at the present velocity."""
        ahead_s = (at_ns - pose.stamp_ns) / NS_PER_S
        turned_rad = self.turn_radps * ahead_s
        heading_rad = pose.yaw_rad + 0.5 * turned_rad
        ahead_m = self.speed_mps * ahead_s
        return (pose.x_m + ahead_m * math.cos(heading_rad),
                pose.y_m + ahead_m * math.sin(heading_rad), pose.yaw_rad + turned_rad)

    # ------------------------------------------------------------------------ for local planners

    @property
    def name(self) -> str:
        return self._node.namespace

    @property
    def now_ns(self) -> int:
        return self._node.now_ns

    def rest(self) -> np.ndarray:
        if self._rest is None:
            self._rest = RestOfPath(self.path)
        return self._rest.after(*self.position[:2])

    def carrot(self, ahead_m: float) -> tuple[float, float]:
        x_m, y_m, _ = self.position
        return _carrot(self.rest(), x_m, y_m, ahead_m, self.arrays.flat, self.arrays.frame)

    def points(self) -> np.ndarray:
        return self.costmap.points()

    def clearances_m(self, poses: np.ndarray) -> np.ndarray:
        return self.costmap.clearances_m(poses, self.arrays.cover, self.shape.inscribed_m)

    def neighbours(self) -> Sequence[NearbyBody]:
        if self._moving is None:
            return ()
        return self._moving.around(np.array(self.position[:2]), self.now_ns)

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._node.stream("local", *name)


def _setup(navigation: Navigation, body: BodyType, speed_step_mps: float, turn_step_radps: float
           ) -> np.ndarray:
    """One record of the kernels' ``SETUP``."""
    constants, rollout_s = navigation.constants, seconds(navigation.sim_time_ns)
    inscribed_m, around_m = body.inscribed_radius_m, body.radius_m
    setup = np.zeros(1, kernels.SETUP)
    setup[0] = (
        body.max_speed_mps, body.max_turn_radps, body.turn_acceleration_radps2,
        speed_step_mps, turn_step_radps,
        rollout_s, inscribed_m, inscribed_m + constants.clearance_m,
        around_m, around_m + constants.clearance_m,
        -min((x_m for x_m, _ in body.corners_m), default=-around_m),
        navigation.inflation_radius_m, navigation.inflation_scaling,
        navigation.local_resolution_m,
        rollout_s * body.max_speed_mps + _MARGIN_M, constants.keep_right_m,
        constants.path_weight, constants.goal_weight, constants.obstacle_weight,
        navigation.speed_samples, navigation.turn_samples)
    return setup
