"""The local costmap: distances to the points that lasers see around the robot, or saw just now."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.middleware.contents import no_return_m
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.kernels import local_costmap as kernels
from desim.robot.navigation.scan_points import Directions, PlacedScan, seen_from
from desim.units import NS_PER_S

_observe = compiled_function(kernels.observe)

_MOST_REMEMBERED = 500  # points, more than ever are; maze_8: same
# Greatest distance of an obstacle to yield to. Beyond 1.68 m two robots of 1.2 m/s that approach
# each other may go at full speed anyway, by ``_YIELD_S``: 0.36 m + 0.55 s * 2.4 m/s.
_YIELD_M = 1.7


class LocalCostmap:
    """A window of ``size_m`` around the robot, as of the last scan; ``around`` is the global
    costmap.

    ``near2`` [n, n] float32 squared distances in m^2 to the points seen, exact up to ``reach_m`` |
    ``scan``, ``layer`` one record each of the kernels' ``SCAN`` and ``LAYER``
    """

    def __init__(self, size_m: float, cell_m: float, reach_m: float,
                 around: GlobalCostmap) -> None:
        cells = round(size_m / cell_m)
        self.near2 = np.full((cells, cells), kernels.FAR2, np.float32)
        self.scan = np.zeros(1, kernels.SCAN)
        self.layer = np.zeros(1, kernels.LAYER)
        self.layer[0] = (cell_m, reach_m, _YIELD_M, _YIELD_M, 0.0, 0.0, 0.0, -math.inf, 0)
        self.around = around
        self._beams = Directions()
        self._memory = np.zeros((_MOST_REMEMBERED, 3))
        self._last = np.zeros(0, np.float32), np.zeros((0, 2))  # ranges, beams

    def observe(self, scans: Sequence[PlacedScan]) -> None:
        """Replace the window by the points of ``scans``, each seen from the robot's pose at its
        instant. The window is in the robot's frame at the first one."""
        scan, (x_m, y_m, yaw_rad) = scans[0]
        longest_m = no_return_m(scan.range_max_m)
        if len(scans) == 1 and scan.x_m == scan.y_m == 0.0:
            ranges, (beams, edge_cos) = scan.ranges, self._beams.of(scan)
        else:
            ranges, beams = seen_from(scans, self._beams)
            longest_m, edge_cos = math.inf, _edge_cos(scans)
        self._last = ranges, beams
        _observe(ranges, beams, x_m, y_m, yaw_rad, scan.stamp_ns / NS_PER_S, longest_m, edge_cos,
                 self.scan, self.layer, self.around.flat, self.around.frame, self._memory,
                 self.near2)

    def points(self) -> np.ndarray:
        """[k, 2] m, on the map, of the returns of the last scans."""
        (ranges, beams), here = self._last, self.scan[0]
        is_return = (ranges > 0.0) & (ranges < here["no_return_m"])
        along = beams[is_return] * ranges[is_return, None].astype(float)
        c, s = math.cos(here["yaw_rad"]), math.sin(here["yaw_rad"])
        return np.column_stack([here["x_m"] + c * along[:, 0] - s * along[:, 1],
                                here["y_m"] + s * along[:, 0] + c * along[:, 1]])

    def clearances_m(self, poses: np.ndarray, cover: np.ndarray, inscribed_m: float) -> np.ndarray:
        """[k] m from a body to the nearest point seen, at ``poses`` [k, 3] on the map. ``cover``,
        ``inscribed_m``: its footprint, as ``footprint_cover`` has it."""
        here, size = self.scan[0], len(self.near2)
        discs = cover if len(cover) else np.array([(0.0, 0.0, 0.0)])
        yaw = poses[:, 2:] - here["yaw_rad"]
        c, s = math.cos(here["yaw_rad"]), math.sin(here["yaw_rad"])
        away = poses[:, :2] - (here["x_m"], here["y_m"])
        x = (c * away[:, :1] + s * away[:, 1:] + np.cos(yaw) * discs[:, 0]
             - np.sin(yaw) * discs[:, 1])
        y = (c * away[:, 1:] - s * away[:, :1] + np.sin(yaw) * discs[:, 0]
             + np.cos(yaw) * discs[:, 1])
        cells = np.floor(np.stack([y, x]) / float(self.layer[0]["cell_m"]) + 0.5 * size).astype(int)
        inside = ((cells >= 0) & (cells < size)).all(axis=0)
        row, column = np.clip(cells, 0, size - 1)
        near_m = np.sqrt(np.where(inside, self.near2[row, column], kernels.FAR2))
        return (near_m - discs[:, 2]).min(axis=1) - inscribed_m

    def forget(self, outside_m: float) -> None:
        """Forget the remembered points that lie outside of a square of this side around the robot
        (costmap_2d's resetMapOutsideWindow). All other points are of the last scan, which the next
        one replaces."""
        kept = self._memory[:int(self.layer[0]["remembered"])]
        here = np.array((self.scan[0]["x_m"], self.scan[0]["y_m"]))
        kept = kept[np.abs(kept[:, :2] - here).max(axis=1, initial=0.0) <= 0.5 * outside_m]
        self._memory[:len(kept)] = kept
        self.layer[0]["remembered"] = len(kept)


def _edge_cos(scans: Sequence[PlacedScan]) -> float:
    """The cosine of the angle from ahead up to which one laser sees both sides; 1 if none does."""
    views = ((-scan.angle_min_rad, scan.angle_min_rad
              + scan.angle_increment_rad * (len(scan.ranges) - 1)) for scan, _ in scans)
    return min(math.cos(min(max(min(view), 0.0), math.pi)) for view in views)
