"""Regulated pure pursuit, as Nav2 publishes it."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from desim import ports
from desim.ports.local_planners import LocalContext
from desim.robot.navigation.global_costmap import inflated_cost
from desim.units import Angle, AngularSpeed, Length, Period, Ratio, Speed, seconds

# A turn on the spot is faster than this, and slower ahead (collision_checker.cpp).
_TURNS_RADPS, _CREEPS_MPS = 0.01, 0.01
_NEAREST2_M2 = 0.001  # a carrot that is nearer gives no curvature


class PursuitConstants(ports.Constants):
    """The other parameters, by their names in Nav2 (parameter_handler.cpp), each with its default
    there."""

    min_lookahead_m: Length = Field("0.3 m", description="(min_lookahead_dist)")
    max_lookahead_m: Length = Field("0.9 m", description="(max_lookahead_dist)")
    lookahead_time_ns: Period = Field("1.5 s", description="(lookahead_time)")
    heading_turn_radps: AngularSpeed = Field("1.8 rad/s", gt=0, description=(
        "turn rate on the spot (rotate_to_heading_angular_vel)"))
    heading_min_rad: Angle = Field("0.785 rad", gt=0, description=(
        "a carrot that is farther aside starts such a turn (rotate_to_heading_min_angle)"))
    approach_m: Length = Field("0.6 m", gt=0, description=(
        "slower so near to the goal (approach_velocity_scaling_dist)"))
    approach_min_mps: Speed = Field("0.05 m/s", description="(min_approach_linear_velocity)")
    cost_m: Length = Field("0.6 m", gt=0, description=(
        "slower so near to obstacles (cost_scaling_dist)"))
    cost_gain: Ratio = Field(1.0, description="(cost_scaling_gain)")
    min_radius_m: Length = Field("0.9 m", gt=0, description=(
        "slower in tighter curves (regulated_linear_scaling_min_radius)"))
    min_speed_mps: Speed = Field("0.25 m/s", description=(
        "of both regulations (regulated_linear_scaling_min_speed)"))
    collision_ns: Period = Field("1 s", description=(
        "stop for what is so near ahead (max_allowed_time_to_collision_up_to_carrot)"))


def slower_in_curves(speed_mps: float, curvature: float, min_radius_m: float) -> float:
    """The speed in a curve of ``curvature`` 1/m: in proportion to its radius below
    ``min_radius_m`` (Macenski et al. 2023, equation 5; curvatureConstraint)."""
    return speed_mps * min(1.0, 1.0 / (abs(curvature) * min_radius_m)) if curvature else speed_mps


def slower_by_cost(speed_mps: float, cost: int, inscribed_m: float, scaling: float,
                   within_m: float, gain: float) -> float:
    """The speed where the robot's place has ``cost``, from which the distance of the obstacle
    follows: in proportion to it below ``within_m`` (equation 6; costConstraint)."""
    if cost == 0:
        return speed_mps
    distance_m = (scaling * inscribed_m - math.log(cost) + math.log(253.0)) / scaling
    return speed_mps * gain * distance_m / within_m if distance_m < within_m else speed_mps


def slower_at_goal(speed_mps: float, togo_m: float, away_m: float, within_m: float,
                   least_mps: float) -> float:
    """The speed with ``togo_m`` of path left: in proportion to the distance ``away_m`` of its end
    below ``within_m``, at least ``least_mps`` (approachVelocityConstraint)."""
    scale = away_m / within_m if togo_m < within_m else 1.0
    return min(speed_mps, max(speed_mps * scale, least_mps))


class RegulatedPurePursuit:
    """Drives on the arc to a point of the path ahead, slower in curves, near obstacles and near the
    goal (Macenski, Singh, Martin, Gines 2023, and nav2_regulated_pure_pursuit_controller). Goals
    have no heading here, so it does not turn at the goal."""

    class Params(ports.Params):
        """Nav2's, where the robot's own limits do not count."""

        max_speed_mps: Speed | None = Field(None, gt=0, description=(
            "(max_linear_vel; null: the robot's, Nav2: 0.5 m/s)"))
        lookahead_m: Length = Field("0.6 m", gt=0, description="(lookahead_dist)")
        scaled_lookahead: bool = Field(False, description=(
            "look ahead for lookahead_time, between both bounds "
            "(use_velocity_scaled_lookahead_dist)"))
        constants: PursuitConstants = Field(default_factory=PursuitConstants, description=(
            "single constants that differ (Nav2's)"))

    def __init__(self, params: Params) -> None:
        """Take the parameters."""
        self._params, self._constants = params, params.constants

    def start(self, context: LocalContext) -> None:
        """Take the speed of the robot, if it is lower."""
        wanted_mps, top_mps = self._params.max_speed_mps, context.limits.speed_mps
        self._speed_mps = top_mps if wanted_mps is None else min(wanted_mps, top_mps)

    def on_path(self, context: LocalContext) -> None:
        """There is nothing to prepare."""

    def steer(self, context: LocalContext) -> tuple[float, float, float, bool]:
        """The velocity on the arc; a stop before obstacles, which blocks the robot."""
        context.worked(candidates=1)
        x_m, y_m, yaw_rad = context.position
        rest = context.rest()
        legs_m = np.hypot(*np.diff(rest, axis=0).T)
        togo_m = float(legs_m.sum())
        ahead_m, left_m = _seen_from(context.position, *_along(rest, legs_m, self._lookahead_m(
            context.speed_mps)))
        carrot2 = ahead_m * ahead_m + left_m * left_m
        curvature = 2.0 * left_m / carrot2 if carrot2 > _NEAREST2_M2 else 0.0
        aside_rad = math.atan2(left_m, ahead_m)
        if abs(aside_rad) > self._constants.heading_min_rad:
            speed_mps, turn_radps = 0.0, self._turn(context, aside_rad)
        else:
            speed_mps = self._regulated(context, curvature, togo_m, math.dist(
                (x_m, y_m), rest[-1].tolist()))
            turn_radps = speed_mps * curvature
        if self._would_collide(context, speed_mps, turn_radps, math.sqrt(carrot2)):
            return 0.0, 0.0, togo_m, True
        return speed_mps, turn_radps, togo_m, False

    def _lookahead_m(self, speed_mps: float) -> float:
        if not self._params.scaled_lookahead:
            return self._params.lookahead_m
        constants = self._constants
        return min(max(abs(speed_mps) * seconds(constants.lookahead_time_ns),
                       constants.min_lookahead_m), constants.max_lookahead_m)

    def _turn(self, context: LocalContext, aside_rad: float) -> float:
        """The turn rate on the spot: as fast as it can and may, and can still stop in time."""
        limits = context.limits
        step = limits.turn_acceleration_radps2 * limits.period_s
        wanted = math.copysign(self._constants.heading_turn_radps, aside_rad)
        turn = min(max(wanted, context.turn_radps - step), context.turn_radps + step)
        stops = math.sqrt(2.0 * limits.turn_acceleration_radps2 * abs(aside_rad))
        return turn if abs(turn) <= stops else math.copysign(stops, aside_rad)

    def _regulated(self, context: LocalContext, curvature: float, togo_m: float, away_m: float
                   ) -> float:
        constants, (radius_m, scaling) = self._constants, context.inflation
        inscribed_m = context.shape.inscribed_m
        near_m = float(context.clearances_m(np.array([context.position]))[0]) + inscribed_m
        cost = inflated_cost(near_m, inscribed_m, scaling) if near_m <= radius_m else 0
        speed_mps = min(
            slower_in_curves(self._speed_mps, curvature, constants.min_radius_m),
            slower_by_cost(self._speed_mps, cost, inscribed_m, scaling, constants.cost_m,
                           constants.cost_gain))
        speed_mps = slower_at_goal(max(speed_mps, constants.min_speed_mps), togo_m, away_m,
                                   constants.approach_m, constants.approach_min_mps)
        return min(speed_mps, self._speed_mps)

    def _would_collide(self, context: LocalContext, speed_mps: float, turn_radps: float,
                       carrot_m: float) -> bool:
        """Whether the body meets something on the arc, from cell to cell up to the carrot and for
        ``collision_ns`` (isCollisionImminent)."""
        cell_m, radius_m = context.cell_m, context.shape.radius_m
        if abs(speed_mps) < _CREEPS_MPS and abs(turn_radps) > _TURNS_RADPS:
            step_s = 2.0 * math.sin(0.5 * cell_m / radius_m) / abs(turn_radps)
        else:
            step_s = cell_m / max(abs(speed_mps), 1e-9)
        steps = max(math.ceil(seconds(self._constants.collision_ns) / step_s) - 1, 0)
        x_m, y_m, yaw_rad = context.position
        headings = yaw_rad + turn_radps * step_s * np.arange(steps + 1)
        moved = speed_mps * step_s * np.column_stack([np.cos(headings[:-1]),
                                                      np.sin(headings[:-1])])
        poses = np.column_stack([np.vstack([(0.0, 0.0), moved.cumsum(axis=0)]), headings])
        poses = poses[np.hypot(poses[:, 0], poses[:, 1]) <= carrot_m]
        poses[:, :2] += x_m, y_m
        return bool((context.clearances_m(poses) <= 0.0).any())


def _along(rest: np.ndarray, legs_m: np.ndarray, far_m: float) -> tuple[float, float]:
    """The point of a path at the distance ``far_m`` from its beginning, or its end."""
    done_m = np.concatenate([[0.0], legs_m.cumsum()])
    return (float(np.interp(far_m, done_m, rest[:, 0])),
            float(np.interp(far_m, done_m, rest[:, 1])))


def _seen_from(position: tuple[float, float, float], px_m: float, py_m: float
               ) -> tuple[float, float]:
    """A point of the map in the robot's frame: ahead and to the left, in m."""
    x_m, y_m, yaw_rad = position
    c, s, dx, dy = math.cos(yaw_rad), math.sin(yaw_rad), px_m - x_m, py_m - y_m
    return c * dx + s * dy, c * dy - s * dx
