"""The tables of a recording, as a run's folder keeps them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyarrow as pa

from desim.monitor.map_growth import MapGrowth
from desim.monitor.recorder import Display, Recorder, StandingWall
from desim.units import MM_PER_M

_PLACES = pa.list_(pa.int32())


def _poses(recorder: Recorder) -> pa.Table:
    """The poses: a row for each robot and instant, ordered by robot."""
    times_ns, robots = np.array(recorder.times_ns, np.int64), len(recorder.robots)
    poses = np.array(recorder.poses).reshape(len(times_ns), robots, 3).swapaxes(0, 1)
    x_mm, y_mm, yaw_mrad = np.rint(poses.reshape(-1, 3).T * MM_PER_M)
    robot = np.repeat(np.arange(robots, dtype=np.int32), len(times_ns))
    return pa.table({
        "time_ns": np.tile(times_ns, robots),
        "robot": pa.DictionaryArray.from_arrays(robot, pa.array(recorder.robots, pa.string())),
        "x_mm": x_mm.astype(np.int32), "y_mm": y_mm.astype(np.int32),
        "yaw_mrad": yaw_mrad.astype(np.int16)})


def _obstacles(recorder: Recorder) -> pa.Table:
    """The moving obstacles: a row for each and instant, ordered by obstacle."""
    times_ns = np.array(recorder.times_ns, np.int64)
    obstacles = recorder.moving_obstacles().swapaxes(0, 1)
    x_mm, y_mm, radius_mm = np.rint(obstacles.reshape(-1, 3).T * MM_PER_M).astype(np.int32)
    return pa.table({
        "time_ns": np.tile(times_ns, len(obstacles)),
        "obstacle": np.repeat(np.arange(len(obstacles), dtype=np.int32), len(times_ns)),
        "x_mm": x_mm, "y_mm": y_mm, "radius_mm": radius_mm})


def _growth(recorder: Recorder) -> pa.Table:
    """The maps: a row for each start of a robot's software, with the time that it ran, its raster,
    and by cell, row by row from below, since when it was known (tenths of a second after the start,
    65535: never) and, eight cells a byte, whether it was occupied."""
    def column(of: Callable[[MapGrowth], object], type_: pa.DataType) -> pa.Array:
        return pa.array([of(growth) for growth in recorder.growths], type_)

    return pa.table({
        "robot": column(lambda growth: growth.robot, pa.string()),
        "started_ns": column(lambda growth: growth.started_ns, pa.int64()),
        "until_ns": column(lambda growth: growth.until_ns, pa.int64()),
        "x_m": column(lambda growth: growth.grid.x_m, pa.float64()),
        "y_m": column(lambda growth: growth.grid.y_m, pa.float64()),
        "resolution_m": column(lambda growth: growth.grid.resolution_m, pa.float64()),
        "width": column(lambda growth: growth.grid.width, pa.int32()),
        "height": column(lambda growth: growth.grid.height, pa.int32()),
        "known_since": column(lambda growth: growth.known_since.ravel(), pa.list_(pa.uint16())),
        "occupied": column(lambda growth: np.packbits(growth.occupied.ravel()),
                           pa.list_(pa.uint8()))})


def _plans(recorder: Recorder) -> pa.Table:
    """The plans that the robots' software has shown, a row for each."""
    def places(plan: Display, axis: int) -> np.ndarray:
        return np.rint(plan.points_m[:, axis] * MM_PER_M).astype(np.int32)

    plans = recorder.plans
    return pa.table({
        "time_ns": pa.array([plan.time_ns for plan in plans], pa.int64()),
        "robot": pa.array([plan.robot for plan in plans], pa.string()),
        "kind": pa.array([plan.kind for plan in plans], pa.string()),
        "x_mm": pa.array([places(plan, 0) for plan in plans], _PLACES),
        "y_mm": pa.array([places(plan, 1) for plan in plans], _PLACES)})


def _walls(recorder: Recorder) -> pa.Table:
    """The walls, a row for each, with the time that it stood."""
    columns = list(zip(*recorder.walls, strict=True)) or [()] * len(StandingWall._fields)
    return pa.table({name: pa.array(column, pa.string() if name == "material" else pa.int64())
                     for name, column in zip(StandingWall._fields, columns, strict=True)})


EVENTS = "events.parquet"
_MADE_BY = {"poses": _poses, "moving_obstacles": _obstacles, "growth": _growth, "plans": _plans,
            "walls": _walls}
RECORDED = ("events", *_MADE_BY)


def recorded(recorder: Recorder) -> dict[str, pa.Table]:
    """The tables of a recording that is complete, but for the events, which are written as
    they come."""
    return {name: make(recorder) for name, make in _MADE_BY.items()}
