"""The local planner: follows a path by a dynamic window, clear of the obstacles of the laser."""

from __future__ import annotations

import math

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.middleware.contents import Pose
from desim.robot.navigation.footprint_cover import cover
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.kernels import local_planner as kernels
from desim.robot.navigation.local_costmap import LocalCostmap
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.units import NS_PER_S, seconds

_MARGIN_M = 0.3  # distance of the aim beyond a rollout's reach; maze_8: 192, 164 s

_steer = compiled_function(kernels.steer)

Position = tuple[float, float, float]  # x m, y m, yaw rad


class LocalPlanner:
    """Keeps the local costmap, the path to follow, and the velocity that was commanded last."""

    def __init__(self, navigation: Navigation, body: BodyType, around: GlobalCostmap) -> None:
        constants, period_s = navigation.constants, float(1 / navigation.control_rate_hz)
        self.candidates = navigation.speed_samples * navigation.turn_samples  # that ``steer`` rates
        self.speed_mps = 0.0
        self.turn_radps = 0.0
        self._path = np.zeros((1, 2))
        self._state = np.zeros(1, kernels.STATE)
        self._speed_step_mps = body.acceleration_mps2 * period_s
        self._turn_step_radps = body.turn_acceleration_radps2 * period_s
        rollout_s = seconds(navigation.sim_time_ns)
        inscribed_m, around_m = body.inscribed_radius_m, body.radius_m
        self._setup = np.zeros(1, kernels.SETUP)
        self._setup[0] = (
            body.max_speed_mps, body.max_turn_radps, body.turn_acceleration_radps2,
            self._speed_step_mps, self._turn_step_radps,
            rollout_s, inscribed_m, inscribed_m + constants.clearance_m,
            around_m, around_m + constants.clearance_m,
            -min((x_m for x_m, _ in body.corners_m), default=-around_m),
            navigation.inflation_radius_m, navigation.inflation_scaling,
            navigation.local_resolution_m,
            rollout_s * body.max_speed_mps + _MARGIN_M, constants.keep_right_m,
            constants.path_weight, constants.goal_weight, constants.obstacle_weight,
            navigation.speed_samples, navigation.turn_samples)
        self.is_blocked = False  # whether no velocity was clear when ``steer`` was last called
        self.costmap = LocalCostmap(
            navigation.local_size_m, navigation.local_resolution_m,
            around_m - inscribed_m + max(navigation.inflation_radius_m,
                                         inscribed_m + constants.clearance_m), around)
        self._cover = cover(body, navigation.local_resolution_m)
        self._seen = (self._setup, self._cover, self.costmap.near2, self.costmap.layer,
                      self.costmap.scan, around.flat, around.frame)

    def follow(self, path: np.ndarray) -> None:
        """Follow the way points ``path`` [n, 2] in m from now on."""
        self._path = path
        self._state["leg"] = 0

    def steer(self, x_m: float, y_m: float, yaw_rad: float) -> tuple[float, float, float]:
        """The next forward speed in m/s and turn rate in rad/s, and the length in m of the rest of
        the path."""
        speed_mps, turn_radps, togo_m, blocked = _steer(
            x_m, y_m, yaw_rad, self.speed_mps, self.turn_radps, self._state, self._path,
            *self._seen)
        self.is_blocked = blocked > 0.0
        return speed_mps, turn_radps, togo_m

    def can_turn(self, x_m: float, y_m: float, yaw_rad: float, by_rad: float) -> bool:
        """Whether the robot can turn on the spot ``by_rad`` to the left. A disc can."""
        return not len(self._cover) or kernels.can_turn(
            x_m, y_m, yaw_rad, by_rad, self._setup, self._cover, self.costmap.near2,
            self.costmap.scan)

    def command(self, speed_mps: float, turn_radps: float) -> None:
        """Note that this velocity was commanded. The motors get as near to it as they can in one
        control period."""
        speed_step, turn_step = self._speed_step_mps, self._turn_step_radps
        self.speed_mps = min(max(speed_mps, self.speed_mps - speed_step),
                             self.speed_mps + speed_step)
        self.turn_radps = min(max(turn_radps, self.turn_radps - turn_step),
                              self.turn_radps + turn_step)

    def extrapolate(self, pose: Pose, at_ns: int) -> Position:
        """The position at an instant near that of ``pose``, at the present velocity."""
        ahead_s = (at_ns - pose.stamp_ns) / NS_PER_S
        turned_rad = self.turn_radps * ahead_s
        heading_rad = pose.yaw_rad + 0.5 * turned_rad
        ahead_m = self.speed_mps * ahead_s
        return (pose.x_m + ahead_m * math.cos(heading_rad),
                pose.y_m + ahead_m * math.sin(heading_rad), pose.yaw_rad + turned_rad)
