"""The tables of a recording, as a run's folder keeps them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from desim.monitor.map_growth import MapGrowth
from desim.monitor.recorder import Recorder, ShownPlan, StandingWall
from desim.units import MM_PER_M, MRAD_PER_RAD

_PLACES = pa.list_(pa.int32())
_GRID = {"x_m": pa.float64(), "y_m": pa.float64(), "resolution_m": pa.float64(),
         "width": pa.int32(), "height": pa.int32()}


def poses_table(times_ns: np.ndarray, robots: Sequence[str], poses: np.ndarray) -> pa.Table:
    """A row for each robot and instant, ordered by robot, of ``poses`` [n, robots, 3]: x m, y m,
    yaw rad from -pi to pi."""
    by_robot = poses.swapaxes(0, 1).reshape(-1, 3).T
    robot = np.repeat(np.arange(len(robots), dtype=np.int32), len(times_ns))
    return pa.table({
        "time_ns": np.tile(times_ns, len(robots)),
        "robot": pa.DictionaryArray.from_arrays(robot, pa.array(robots, pa.string())),
        "x_mm": in_mm(by_robot[0]), "y_mm": in_mm(by_robot[1]),
        "yaw_mrad": np.rint(by_robot[2] * MRAD_PER_RAD).astype(np.int16)})


def obstacles_table(times_ns: np.ndarray, obstacles: np.ndarray) -> pa.Table:
    """A row for each moving obstacle and instant, ordered by obstacle, of ``obstacles`` [n,
    obstacles, 3]: x, y, radius in m."""
    obstacles = obstacles.swapaxes(0, 1)
    x_mm, y_mm, radius_mm = in_mm(obstacles.reshape(-1, 3).T)
    return pa.table({
        "time_ns": np.tile(times_ns, len(obstacles)),
        "obstacle": np.repeat(np.arange(len(obstacles), dtype=np.int32), len(times_ns)),
        "x_mm": x_mm, "y_mm": y_mm, "radius_mm": radius_mm})


def growth_table(growths: Sequence[MapGrowth]) -> pa.Table:
    """A row for each start of a robot's software, with the time that it ran, its raster, and by
    cell, row by row from below, since when it was known (as in ``MapGrowth``) and, eight cells a
    byte, whether it was occupied."""
    return pa.table({
        "robot": pa.array([growth.robot for growth in growths], pa.string()),
        "started_ns": pa.array([growth.started_ns for growth in growths], pa.int64()),
        "until_ns": pa.array([growth.until_ns for growth in growths], pa.int64()),
        **{name: pa.array([getattr(growth.grid, name) for growth in growths], kind)
           for name, kind in _GRID.items()},
        "known_since": pa.array([growth.known_since.ravel() for growth in growths],
                                pa.list_(pa.uint16())),
        "occupied": pa.array([np.packbits(growth.occupied.ravel()) for growth in growths],
                             pa.list_(pa.uint8()))})


def plans_table(plans: Sequence[ShownPlan]) -> pa.Table:
    """A row for each plan, or other places, that a host has shown."""
    return pa.table({
        "time_ns": pa.array([plan.time_ns for plan in plans], pa.int64()),
        "robot": pa.array([plan.robot for plan in plans], pa.string()),
        "kind": pa.array([plan.kind for plan in plans], pa.string()),
        "x_mm": pa.array([plan.xy_mm[:, 0] for plan in plans], _PLACES),
        "y_mm": pa.array([plan.xy_mm[:, 1] for plan in plans], _PLACES),
        "texts": pa.array([plan.texts for plan in plans], pa.list_(pa.string()))})


def walls_table(walls: Sequence[StandingWall]) -> pa.Table:
    """A row for each wall, with the time that it stood."""
    columns = list(zip(*walls, strict=True)) or [()] * len(StandingWall._fields)
    return pa.table({name: pa.array(column, pa.string() if name == "material" else pa.int64())
                     for name, column in zip(StandingWall._fields, columns, strict=True)})


def in_mm(values_m: np.ndarray) -> np.ndarray:
    """int32 mm of lengths in m."""
    return np.rint(values_m * MM_PER_M).astype(np.int32)


RECORDED = ("events", "poses", "moving_obstacles", "growth", "plans", "walls")


def recorded(recorder: Recorder) -> dict[str, pa.Table]:
    """The tables of a recording that is complete, but for the events, which are written as
    they come."""
    times_ns, robots = np.array(recorder.times_ns, np.int64), recorder.robots
    return {
        "poses": poses_table(times_ns, robots, np.array(recorder.poses).reshape(
            len(times_ns), len(robots), 3)),
        "moving_obstacles": obstacles_table(times_ns, recorder.moving_obstacles()),
        "growth": growth_table(recorder.growths()), "plans": plans_table(recorder.plans),
        "walls": walls_table(recorder.walls)}
