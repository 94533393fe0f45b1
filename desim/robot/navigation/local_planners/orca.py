"""Optimal reciprocal collision avoidance, for robots with two wheels."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from desim import ports
from desim.ports.kernels import compiled_function
from desim.ports.local_planners import LocalContext, LocalPlannerTraits
from desim.robot.navigation.kernels import orca as kernels
from desim.units import Length, Pace, seconds

_solve = compiled_function(kernels.solve)
_reciprocal = compiled_function(kernels.reciprocal)

_SECTORS = 48  # directions, of each of which the nearest point counts (7.5 degrees; our choice)
_SPEEDS = 25  # that are compared (our choice)
_BLOCKED_MPS = 0.02  # slower than this, with a path to follow, counts as blocked (our choice)
# Noise on the wanted velocity: two robots face to face would wait for each other (our choice).
_ASIDE_MPS = 1e-3


class Orca:
    """The velocity nearest to the wanted one that avoids all neighbours, if each does half (van den
    Berg, Guy, Lin, Manocha 2011), and what the laser sees, alone. A robot with two wheels moves a
    point ahead of its axle in any direction, with a disc around it that has room for the body
    (Snape, van den Berg, Guy, Manocha 2010)."""

    class Params(ports.Params):
        """Horizons, and the point that moves."""

        horizon_ns: Pace = Field("2 s", description=(
            "no collision with neighbours within this time (our choice; examples of RVO2: 5 s, 10 s"
            ")"))
        obstacle_horizon_ns: Pace = Field("1 s", description=(
            "likewise with what stands (our choice; the robot brakes from 1.2 m/s in 0.5 s)"))
        offset_m: Length = Field("0.1 m", gt=0, description=(
            "of the point ahead of the axle (our choice: a third of the radius)"))
        lookahead_m: Length = Field("1.5 m", gt=0, description=(
            "drive towards this point of the path (our choice)"))
        neighbours: int = Field(10, ge=1, le=1000, description="(examples of RVO2: 10)")

    traits = LocalPlannerTraits(follows_neighbours=True)

    def __init__(self, params: Params) -> None:
        """Take the parameters."""
        self._params = params

    def start(self, context: LocalContext) -> None:
        """Take the random numbers."""
        self._random = context.stream("aside")

    def on_path(self, context: LocalContext) -> None:
        """There is nothing to prepare."""

    def steer(self, context: LocalContext) -> tuple[float, float, float, bool]:
        """The velocity of the point ahead, turned into a speed and a turn rate."""
        x_m, y_m, yaw_rad = context.position
        offset_m, limits = self._params.offset_m, context.limits
        heading = np.array([math.cos(yaw_rad), math.sin(yaw_rad)])
        point = np.array([x_m, y_m]) + offset_m * heading
        wanted = self._wanted(context, point)
        others = self._others(context, point)
        obstacles = self._obstacles(context, point, others)
        planes = np.concatenate([obstacles, np.zeros((len(others), 4))])
        left = np.array([-heading[1], heading[0]])
        now = context.speed_mps * heading + offset_m * context.turn_radps * left
        _reciprocal(others, float(now[0]), float(now[1]), context.shape.radius_m + offset_m,
                    seconds(self._params.horizon_ns), limits.period_s, planes[len(obstacles):])
        context.worked(candidates=len(planes))
        velocity = np.array(_solve(planes, len(obstacles), limits.speed_mps, float(wanted[0]),
                                   float(wanted[1])))
        togo_m = float(np.hypot(*np.diff(context.rest(), axis=0).T).sum())
        turn_radps = float(velocity @ left) / offset_m
        turn_radps = min(max(turn_radps, -limits.turn_radps), limits.turn_radps)
        turn_radps = self._stoppable(context, turn_radps, velocity)
        more_radps = limits.turn_acceleration_radps2 * limits.period_s
        next_radps = min(max(turn_radps, context.turn_radps - more_radps),
                         context.turn_radps + more_radps)
        # Backwards it turns on the spot: that keeps the body in the disc, and sees where it goes.
        speed_mps = _speed(planes, len(obstacles), heading, next_radps * offset_m * left,
                           max(float(velocity @ heading), 0.0), limits.speed_mps)
        blocked = float(np.hypot(*velocity)) < _BLOCKED_MPS
        return speed_mps, turn_radps, togo_m, blocked

    def _wanted(self, context: LocalContext, point: np.ndarray) -> np.ndarray:
        """Full speed towards the path, and a little aside."""
        away = np.array(context.carrot(self._params.lookahead_m)) - point
        along = context.limits.speed_mps * away / max(float(np.hypot(*away)), 1e-9)
        return along + _ASIDE_MPS * self._random.standard_normal(2)

    def _stoppable(self, context: LocalContext, turn_radps: float, velocity: np.ndarray) -> float:
        """The turn rate, not so fast that it would turn beyond the direction of ``velocity``: w^2 =
        2 a off."""
        off_rad = math.remainder(math.atan2(velocity[1], velocity[0]) - context.position[2],
                                 math.tau)
        most = math.sqrt(2.0 * context.limits.turn_acceleration_radps2 * abs(off_rad))
        return min(max(turn_radps, -most), most)

    def _others(self, context: LocalContext, point: np.ndarray) -> np.ndarray:
        """[n, 5] the nearest neighbours, from ``point``, as the kernels have them."""
        found = np.array([one[1:] for one in context.neighbours()]).reshape(-1, 5)
        found[:, :2] -= point
        order = np.argsort(np.hypot(found[:, 0], found[:, 1]), kind="stable")
        return np.ascontiguousarray(found[order[:self._params.neighbours]])

    def _obstacles(self, context: LocalContext, point: np.ndarray, others: np.ndarray
                   ) -> np.ndarray:
        """[n, 4] half-planes of what stands: towards a point of it the robot may come nearer by no
        more than the room there is, within the horizon (section 4.3 with a velocity of zero, so
        that standing is always allowed)."""
        radius_m = context.shape.radius_m + self._params.offset_m
        horizon_s = seconds(self._params.obstacle_horizon_ns)
        away = context.points() - point
        for other in others:  # the points of it do not stand
            away = away[np.hypot(*(away - other[:2]).T) > other[4] + self._params.offset_m]
        far_m = np.hypot(away[:, 0], away[:, 1])
        near = (far_m < radius_m + horizon_s * context.limits.speed_mps) & (far_m > 0.0)
        away, far_m = away[near], far_m[near]
        sector = np.floor((np.arctan2(away[:, 1], away[:, 0]) / math.tau + 0.5) * _SECTORS)
        order = np.lexsort((far_m, sector))
        first = order[np.flatnonzero(np.diff(sector[order], prepend=-1.0))]
        toward = away[first] / far_m[first, None]
        room_mps = np.maximum(far_m[first] - radius_m, 0.0) / horizon_s
        return np.column_stack([room_mps[:, None] * toward, -toward])


def _speed(planes: np.ndarray, hard: int, heading: np.ndarray, aside: np.ndarray,
           wanted_mps: float, most_mps: float) -> float:
    """The speed nearest to the wanted one at which the point, which moves ``aside`` as fast as the
    robot can turn by now, is in all half-planes, or the least outside of them: first of the
    ``hard`` ones, without the turn, in which the body stays where it is, then of the others."""
    speeds = np.append(np.linspace(0.0, most_mps, _SPEEDS), wanted_mps)
    for some, turned in ((planes[:hard], 0.0), (planes[hard:], 1.0)):
        away = speeds[:, None, None] * heading + turned * aside - some[:, :2]
        room = (away * some[:, 2:]).sum(axis=2).min(axis=1, initial=math.inf)
        speeds = speeds[room >= min(float(room.max()), 0.0) - 1e-9]
    return float(speeds[np.abs(speeds - wanted_mps).argmin()])
