"""The local planner: follows a way by dynamic window, clear of what the laser sees."""

from __future__ import annotations

import math

import numpy as np

from desim.middleware.messages import Pose
from desim.robot.navigation.kernels import dynamic_window as kernels
from desim.robot.navigation.local_costmap import Sight
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Navigation
from desim.units import NS_PER_S, seconds

_MARGIN_M = 0.3  # the point to steer for lies so far beyond what a rollout can reach


class LocalPlanner:
    """What the robot sees (``sight``), the way to follow, and the velocity that it has now as far
    as it was told to have it."""

    __slots__ = ("speed_mps", "turn_radps", "_speeds", "_turns", "_pose", "_way", "_leg", "_out",
                 "_setup", "_speed_step_mps", "_turn_step_radps", "sight")

    def __init__(self, navigation: Navigation, body: BodyType) -> None:
        period_s = float(1 / navigation.control_rate_hz)
        self.speed_mps = 0.0
        self.turn_radps = 0.0
        self._speeds, self._turns = navigation.speed_samples, navigation.turn_samples
        self._pose = np.zeros(3)
        self._way = np.zeros((1, 2))
        self._leg = np.zeros(1, np.int64)
        self._out = np.zeros(4)
        rollout_s = seconds(navigation.sim_time_ns)
        self._setup = np.zeros(1, kernels.SETUP)
        self._setup[0] = (
            body.max_speed_mps, body.max_turn_radps, body.turn_acceleration_radps2,
            body.acceleration_mps2 * period_s, body.turn_acceleration_radps2 * period_s,
            rollout_s, body.radius_m + navigation.clearance_m, navigation.inflation_radius_m,
            navigation.inflation_scaling, navigation.local_resolution_m,
            rollout_s * body.max_speed_mps + _MARGIN_M, navigation.keep_right_m,
            navigation.path_weight, navigation.goal_weight, navigation.obstacle_weight)
        self._speed_step_mps = body.acceleration_mps2 * period_s
        self._turn_step_radps = body.turn_acceleration_radps2 * period_s
        self.sight = Sight(
            navigation.local_size_m, navigation.local_resolution_m,
            max(navigation.inflation_radius_m, body.radius_m + navigation.clearance_m))

    def follow(self, way: np.ndarray) -> None:
        """Follow way points [n, 2] in m from now on."""
        self._way = way
        self._leg[0] = 0

    def steer(self, x_m: float, y_m: float, yaw_rad: float) -> tuple[float, float, float]:
        """Forward speed in m/s and turn rate in rad/s to have next, and the length in m of the
        way still to go."""
        pose, sight = self._pose, self.sight
        pose[0], pose[1], pose[2] = x_m, y_m, yaw_rad
        kernels.steer(sight.near2, self._setup, pose, sight.seen_from, sight.yield_m,
                      self.speed_mps, self.turn_radps, self._way, self._leg, self._speeds,
                      self._turns, sight.flat, sight.frame, self._out)
        speed_mps, turn_radps, _, togo_m = self._out.tolist()
        return speed_mps, turn_radps, togo_m

    def drove(self, speed_mps: float, turn_radps: float) -> None:
        """This velocity was commanded; the motors come as near to it as they can in a period."""
        self.speed_mps = _towards(self.speed_mps, speed_mps, self._speed_step_mps)
        self.turn_radps = _towards(self.turn_radps, turn_radps, self._turn_step_radps)

    def extrapolate(self, pose: Pose, at_ns: int) -> tuple[float, float, float]:
        """x, y, yaw at an instant near that of ``pose``, driving on as now."""
        ahead_s = (at_ns - pose.stamp_ns) / NS_PER_S
        turned_rad = self.turn_radps * ahead_s
        heading_rad = pose.yaw_rad + 0.5 * turned_rad
        ahead_m = self.speed_mps * ahead_s
        return (pose.x_m + ahead_m * math.cos(heading_rad),
                pose.y_m + ahead_m * math.sin(heading_rad), pose.yaw_rad + turned_rad)


def _towards(now: float, wanted: float, step: float) -> float:
    return min(max(wanted, now - step), now + step)
