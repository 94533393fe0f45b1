"""Checks of local planners: does a class keep its contract?"""

from __future__ import annotations

import math

import numpy as np

from desim.middleware.contents import LaserScan
from desim.ports import GridSpec
from desim.ports.local_planners import LocalPlanner
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import TilePool
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.local_planner_bench import LocalPlannerBench
from desim.testing.localization_bench import LASER
from desim.testing.localization_checks import WALLS, scan_of
from desim.testing.shared_state import own_state

_CONTROL_S, _STEPS = 0.1, 6  # of the motors between two commands
_SCAN_EVERY = 2  # commands
_NAVIGATION = Navigation()
_BODIES = (BodyType(), BodyType(radius="0.36 m", footprint=[
    ["0.3 m", "0.2 m"], ["-0.3 m", "0.2 m"], ["-0.3 m", "-0.2 m"], ["0.3 m", "-0.2 m"]]))
_AROUND = [(2.0, 2.0), (10.0, 2.0), (10.0, 6.5)]  # the block
_INTO = [(2.0, 4.0), (10.0, 4.0)]  # it
_PATIENCE_S, _FEW_S = 60.0, 8.0


def check_local_planner(cls: PluginClass[LocalPlanner], **params: object) -> None:
    """Check a ``ports.local_planners.LocalPlanner``. A disc and a rectangle drive around a block in
    a room, and arrive within a minute; then straight on into the block, and do not touch it; last,
    their path is one point. Velocities must be finite, the costmaps stay as they are, and the same
    come out again."""
    check_form("local_planner", cls, params)
    with own_streams(cls), own_state(cls):
        played = [_play(cls, params) for _ in range(2)]
    need(played[0] == played[1], cls, "find the same velocities in the same situation: keep state "
                                      "in self, and iterate over no set")


def _play(cls: PluginClass[LocalPlanner], params: dict[str, object]) -> list[tuple[float, ...]]:
    found: list[tuple[float, ...]] = []
    for body in _BODIES:
        bench = _bench(made(cls, params), body)
        drive = _Drive(cls, bench, _AROUND)
        while drive.time_s < _PATIENCE_S and not drive.arrived:
            drive.control()
        need(drive.arrived, cls, f"arrive within {_PATIENCE_S:.0f} s, as nothing is in the way; "
                                 f"{drive.away_m:.1f} m are left")
        into = _Drive(cls, bench, _INTO)
        while into.time_s < _FEW_S:
            into.control()
        bench.follow(np.array([bench.position[:2]]))
        found += [*drive.found, *into.found, _steered(cls, bench, *bench.position)]
    return found


def _bench(planner: LocalPlanner, body: BodyType) -> LocalPlannerBench:
    unknown = RobotMap(GridSpec(0.2, 64, 64, -0.4, -2.4), TilePool())
    return LocalPlannerBench(planner, _NAVIGATION, body, GlobalCostmap(
        unknown, body.inscribed_radius_m, _NAVIGATION.inflation_radius_m,
        _NAVIGATION.inflation_scaling))


class _Drive:
    """A robot with ideal motors, which stands at the beginning of ``path``."""

    def __init__(self, cls: PluginClass[LocalPlanner], bench: LocalPlannerBench,
                 path: list[tuple[float, float]]) -> None:
        self._cls, self._bench, self._goal = cls, bench, path[-1]
        self._pose, self._velocity = np.array([*path[0], 0.0]), np.zeros(2)
        limits = bench.limits
        self._step = np.array([limits.acceleration_mps2, limits.turn_acceleration_radps2]) \
            * _CONTROL_S / _STEPS
        self._most = np.array([limits.speed_mps, limits.turn_radps])
        self._ticks = 0
        self.found: list[tuple[float, ...]] = []
        bench.command(0.0, 0.0)
        bench.speed_mps = bench.turn_radps = 0.0
        bench.follow(np.array(path))

    @property
    def time_s(self) -> float:
        return self._ticks * _CONTROL_S

    @property
    def away_m(self) -> float:
        return math.dist(self._pose[:2].tolist(), self._goal)

    @property
    def arrived(self) -> bool:
        return self.away_m <= _NAVIGATION.goal_tolerance_m

    def control(self) -> None:
        """One control period."""
        x_m, y_m, yaw_rad = map(float, self._pose)
        if self._ticks % _SCAN_EVERY == 0:
            ranges = scan_of(self._pose).astype(np.float32)
            self._bench.costmap.observe([(LaserScan(
                round(self.time_s * 1e9), ranges, LASER.angle_min_rad, LASER.increment_rad,
                LASER.longest_m), (x_m, y_m, yaw_rad))])
        self.found.append(_steered(self._cls, self._bench, x_m, y_m, yaw_rad))
        wanted = np.clip(self.found[-1][:2], -self._most, self._most)
        self._bench.command(*map(float, wanted))
        for _ in range(_STEPS):
            self._velocity += np.clip(wanted - self._velocity, -self._step, self._step)
            self._pose[2] += self._velocity[1] * _CONTROL_S / _STEPS
            self._pose[:2] += self._velocity[0] * _CONTROL_S / _STEPS * np.array(
                [math.cos(self._pose[2]), math.sin(self._pose[2])])
        self._ticks += 1
        inscribed_m = self._bench.shape.inscribed_m
        need(_to_walls_m(self._pose) > inscribed_m, self._cls,
             "touch nothing that the laser sees: it is at "
             f"({self._pose[0]:.2f}, {self._pose[1]:.2f})")


def _steered(cls: PluginClass[LocalPlanner], bench: LocalPlannerBench, x_m: float, y_m: float,
             yaw_rad: float) -> tuple[float, ...]:
    """The planner's answer, which must be what its contract says."""
    bench.position = x_m, y_m, yaw_rad
    before = [array.tobytes() for array in bench.arrays]
    found = bench.planner.steer(bench)
    need(isinstance(found, tuple) and len(found) == 4
         and all(isinstance(one, float | int | np.floating) and math.isfinite(one)
                 for one in found) and isinstance(found[3], bool) and found[2] >= 0.0, cls,
         "return a tuple of a speed, a turn rate, a length >= 0, all finite, and a bool, not "
         f"{found!r}")
    need([array.tobytes() for array in bench.arrays] == before, cls,
         "leave the costmaps as they are")
    return tuple(map(float, found))


def _to_walls_m(pose: np.ndarray) -> float:
    a, b = WALLS[:, :2], WALLS[:, 2:]
    t = np.clip(((pose[:2] - a) * (b - a)).sum(1) / ((b - a)**2).sum(1), 0.0, 1.0)
    return float(np.hypot(*(a + t[:, None] * (b - a) - pose[:2]).T).min())
