"""The size of a map message of a whole terrain.

A robot's laser scans at one place after the other until the map is complete.
"""

from __future__ import annotations

import numpy as np

from desim.engine.streams import Streams
from desim.middleware.contents import LaserScan
from desim.monitor.coverage import EXPLORED
from desim.ports.tasks import Ground
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import FREE, TilePool, raster
from desim.robot.sharing.kinds.own_maps import OwnMaps
from desim.robot.sharing.map_message import MapFormat
from desim.simulation.simulation import Simulation

_COUNT = 20  # scans between two counts of the known cells
_MOST = 5000  # scans; a terrain that needs more is known well enough after these


def whole_map_bytes(parts: Simulation, exchange: OwnMaps.Params, streams: Streams) -> int:
    """The size of an update with all of a robot's own evidence, in the scenario's content and
    encoding, when 99 % of what can be seen is known from scans at free places that are drawn."""
    ground = parts.monitor.truth.ground
    robot_map = RobotMap(ground.grid, TilePool())
    wanted = EXPLORED * np.count_nonzero(ground.reachable)
    for number in range(_MOST):
        if number % _COUNT == 0:
            known = raster(ground.grid, robot_map.fused) <= FREE
            if np.count_nonzero(known & ground.reachable) >= wanted:
                break
        _scan(parts, robot_map, streams, number)
    padding = parts.scenario.robot.mapping.padding(ground.grid.width * ground.grid.height)
    return MapFormat(ground.grid, exchange.content, exchange.encoding, padding).size_bytes(
        robot_map.own.snapshot())


def free_place(ground: Ground, streams: Streams, *name: str | int) -> tuple[float, float]:
    """x, y in m of the middle of a cell that can be seen, drawn by ``name``."""
    grid, cells = ground.grid, np.flatnonzero(ground.reachable)
    row, column = divmod(int(cells[streams.integer(len(cells), *name)]), grid.width)
    return (grid.x_m + (column + 0.5) * grid.resolution_m,
            grid.y_m + (row + 0.5) * grid.resolution_m)


def _scan(parts: Simulation, robot_map: RobotMap, streams: Streams, number: int) -> None:
    """Scan ``number`` of the first robot, from a place and with a heading of its own."""
    ground, robot = parts.monitor.truth.ground, parts.scenario.robot
    x_m, y_m = free_place(ground, streams, "survey", number)
    yaw_rad = float(streams("survey", "heading", number).uniform(-np.pi, np.pi))
    snapshot = parts.world.snapshot()
    poses = snapshot.poses.copy()
    poses[0] = x_m, y_m, yaw_rad
    ranges = parts.world.scan(snapshot._replace(poses=poses), np.array([0]), number)[0]
    angle_rad = robot.first_laser.field_of_view_rad
    robot_map.integrate_scan(x_m, y_m, yaw_rad, LaserScan(
        0, ranges, -0.5 * angle_rad, angle_rad / (robot.first_laser.beams - 1),
        robot.first_laser.max_range_m), robot.mapping.usable_range_m)
