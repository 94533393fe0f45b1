"""Nav2's DWB: velocities are sampled, simulated and rated by critics."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from desim import ports
from desim.ports.kernels import compiled_function
from desim.ports.local_planners import LocalContext
from desim.robot.navigation.dwb.oscillation import Oscillation
from desim.robot.navigation.dwb.velocity_samples import resampled, samples
from desim.robot.navigation.kernels import dwb as kernels
from desim.units import Angle, AngularSpeed, Length, Period, Speed, seconds

_rate_all = compiled_function(kernels.rate_all)


class DwbConstants(ports.Constants):
    """The other parameters, by their names in Nav2, each with its published value (navigation2:
    nav2_system_tests' nav2_system_params.yaml, and defaults of dwb_critics)."""

    rotate_to_goal: float = Field(32.0, ge=0, description="(RotateToGoal.scale)")
    base_obstacle: float = Field(0.02, ge=0, description="(BaseObstacle.scale)")
    goal_align: float = Field(24.0, ge=0, description="(GoalAlign.scale)")
    path_align: float = Field(32.0, ge=0, description="(PathAlign.scale)")
    path_dist: float = Field(32.0, ge=0, description="(PathDist.scale)")
    goal_dist: float = Field(24.0, ge=0, description="(GoalDist.scale)")
    forward_m: Length = Field("0.1 m", gt=0, description="(forward_point_distance)")
    slowing_factor: float = Field(5.0, ge=0, description="(RotateToGoal.slowing_factor)")
    xy_goal_tolerance_m: Length = Field("0.25 m", description="(xy_goal_tolerance)")
    path_length_m: Length = Field("1 m", description="(path_length_tolerance)")
    stopped_mps: Speed = Field("0.25 m/s", description="(trans_stopped_velocity)")
    linear_step_m: Length = Field("0.05 m", gt=0, description="(linear_granularity)")
    angular_step_rad: Angle = Field("0.025 rad", gt=0, description="(angular_granularity)")
    reset_distance_m: Length = Field("0.05 m", description="(Oscillation.oscillation_reset_dist)")
    reset_angle_rad: Angle = Field("0.2 rad", ge=0, description=(
        "(Oscillation.oscillation_reset_angle)"))
    x_only_mps: Speed = Field("0.05 m/s", description="(Oscillation.x_only_threshold)")


class Dwb:
    """The velocity with the lowest sum of critics' scores, as Nav2's dwb_core finds it with the
    critics RotateToGoal, Oscillation, BaseObstacle, GoalAlign, PathAlign, PathDist and GoalDist.
    Goals have no heading here: RotateToGoal takes that of the end of the path."""

    class Params(ports.Params):
        """Nav2's, where the robot's own limits do not count."""

        sim_time_ns: Period = Field("1.7 s", description="(sim_time)")
        vx_samples: int = Field(20, ge=2, le=1000, description="(vx_samples)")
        vtheta_samples: int = Field(20, ge=2, le=1000, description="(vtheta_samples)")
        max_turn_radps: AngularSpeed = Field("1 rad/s", gt=0, description=(
            "(max_vel_theta; not above the robot's)"))
        constants: DwbConstants = Field(default_factory=DwbConstants, description=(
            "single constants that differ (Nav2's)"))

    def __init__(self, params: Params) -> None:
        """Take the parameters."""
        self._params, self._constants = params, params.constants
        self._in_window = self._rotating = False

    def start(self, context: LocalContext) -> None:
        """Take what does not change."""
        limits, constants = context.limits, self._constants
        self._turn_radps = min(self._params.max_turn_radps, limits.turn_radps)
        self._setup = np.zeros(1, kernels.SETUP)
        self._put(acceleration_mps2=limits.acceleration_mps2,
                  turn_acceleration_radps2=limits.turn_acceleration_radps2,
                  rollout_s=seconds(self._params.sim_time_ns), cell_m=context.cell_m,
                  step_m=constants.linear_step_m, step_rad=constants.angular_step_rad,
                  inscribed_m=context.shape.inscribed_m, inflation_m=context.inflation.radius_m,
                  inflation_scaling=context.inflation.scaling, forward_m=constants.forward_m,
                  slowing_factor=constants.slowing_factor)
        self._oscillation = Oscillation(constants.reset_distance_m, constants.reset_angle_rad,
                                        constants.x_only_mps)

    def on_path(self, context: LocalContext) -> None:
        """Reset the critics that remember."""
        self._in_window = self._rotating = False
        self._oscillation.reset()

    def steer(self, context: LocalContext) -> tuple[float, float, float, bool]:
        """The best of the legal velocities; without one, a stop, which blocks the robot."""
        velocities = self._velocities(context)
        context.worked(candidates=len(velocities))
        rest = context.rest()
        togo_m = float(np.hypot(*np.diff(rest, axis=0).T).sum())
        totals = self.rated(context, rest, togo_m, velocities)[1]
        best = int(np.argmin(totals))
        clear = bool(totals[best] < math.inf)
        speed_mps, turn_radps = velocities[best].tolist() if clear else (0.0, 0.0)
        self._oscillation.note(context.position, speed_mps, turn_radps)
        return speed_mps, turn_radps, togo_m, not clear

    def rated(self, context: LocalContext, rest: np.ndarray, togo_m: float,
              velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """[n, 6] raw scores of the critics ``kernels.CRITICS``, and [n] totals, infinite for
        what is not legal."""
        constants = self._constants
        scores, totals = np.zeros((len(velocities), 6)), np.full(len(velocities), math.inf)
        self._prepare(context, rest, togo_m)
        cells = self._cells(context, rest)
        goal, align = cells[-1:], self._cells(context, self._aligned(context, rest))[-1:]
        if not len(goal) or not len(align):
            return scores, totals
        self._put(goal_column=goal[0, 0], goal_row=goal[0, 1], align_column=align[0, 0],
                  align_row=align[0, 1])
        at_goal = math.dist(context.position[:2], rest[-1].tolist()) <= constants.forward_m
        half_m = 0.5 * context.cell_m  # MapGridCritic::getScale
        scales = np.array([constants.rotate_to_goal, constants.base_obstacle,
                           half_m * constants.goal_align,
                           0.0 if at_goal else half_m * constants.path_align,
                           half_m * constants.path_dist, half_m * constants.goal_dist])
        _rate_all(context.arrays.near2, self._setup, cells, velocities, scales, scores, totals)
        return scores, totals

    def _velocities(self, context: LocalContext) -> np.ndarray:
        """[n, 2] the samples, all but standing."""
        limits, time_s = context.limits, seconds(self._params.sim_time_ns)
        speeds = samples(context.speed_mps, 0.0, limits.speed_mps,
                         limits.acceleration_mps2 * time_s, self._params.vx_samples)
        turns = samples(context.turn_radps, -self._turn_radps, self._turn_radps,
                        limits.turn_acceleration_radps2 * time_s, self._params.vtheta_samples)
        return np.array([(v, w) for v in speeds for w in turns if v or w])

    def _prepare(self, context: LocalContext, rest: np.ndarray, togo_m: float) -> None:
        """The present pose and velocity, and what the critics remember."""
        constants, seen_rad = self._constants, context.arrays.scan[0]["yaw_rad"]
        (x_m, y_m), = _framed(context, np.array([context.position[:2]]))
        away_m = math.dist(context.position[:2], rest[-1].tolist())
        self._in_window |= (away_m <= constants.xy_goal_tolerance_m
                            and togo_m <= constants.path_length_m)
        self._rotating |= self._in_window and abs(context.speed_mps) <= constants.stopped_mps
        ends = context.path[-2:]
        along = ends[-1] - ends[0]
        no_forward, no_backward, no_left, no_right = self._oscillation.forbidden
        self._put(x_m=x_m, y_m=y_m, yaw_rad=context.position[2] - seen_rad,
                  speed_mps=context.speed_mps, turn_radps=context.turn_radps,
                  in_window=self._in_window, rotating=self._rotating,
                  goal_yaw_rad=math.atan2(along[1], along[0]) - seen_rad, no_forward=no_forward,
                  no_backward=no_backward, no_left=no_left, no_right=no_right)

    def _put(self, **values: float) -> None:
        for name, value in values.items():
            self._setup[name] = value

    def _aligned(self, context: LocalContext, rest: np.ndarray) -> np.ndarray:
        """The path with its end moved on, away from the robot (GoalAlign)."""
        toward = rest[-1] - context.position[:2]
        length_m = float(np.hypot(*toward))
        if length_m == 0.0:
            toward, length_m = np.array([1.0, 0.0]), 1.0
        return np.vstack([rest[:-1], rest[-1] + self._constants.forward_m / length_m * toward])

    def _cells(self, context: LocalContext, way: np.ndarray) -> np.ndarray:
        """[k, 2] columns and rows of the path's first stretch within the local costmap."""
        cell_m, size = context.cell_m, len(context.arrays.near2)
        cells = np.floor(_framed(context, resampled(way, cell_m)) / cell_m
                         + 0.5 * size).astype(np.int64)
        inside = np.flatnonzero(((cells >= 0) & (cells < size)).all(axis=1))
        gaps = np.flatnonzero(np.diff(inside) > 1)
        return cells[inside[:gaps[0] + 1] if len(gaps) else inside]


def _framed(context: LocalContext, points: np.ndarray) -> np.ndarray:
    """[n, 2] points of the map in the frame of the local costmap."""
    here = context.arrays.scan[0]
    c, s = math.cos(here["yaw_rad"]), math.sin(here["yaw_rad"])
    away = points - (here["x_m"], here["y_m"])
    return away @ np.array([(c, -s), (s, c)])
