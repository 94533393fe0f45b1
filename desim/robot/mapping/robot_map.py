"""The map of one robot: its own layer, the layers received from others, and their sum."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import lru_cache

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.middleware.contents import LaserScan, no_return_m
from desim.ports import GridSpec, Pose2D
from desim.robot.mapping.kernels import evidence
from desim.robot.mapping.kernels import tiles as kernels
from desim.robot.mapping.tiles import (
    CELLS,
    TILE,
    Layer,
    LayerSnapshot,
    Received,
    TilePool,
    cell_numbers,
    difference_of,
    fuse,
    replacement,
    tiles_across,
)
from desim.robot.stamped_poses import laser_at

_integrate = compiled_function(evidence.integrate)
_add = compiled_function(kernels.add_all)
_append = compiled_function(kernels.append)


_NEVER = evidence.CLAMP_HIGH + 1  # no evidence is so strong: all cells can be cleared


class _Scans:
    """Integrates scans, one at a time, into all maps of one raster."""

    def __init__(self, spec: GridSpec) -> None:
        self._spec, count = spec, math.prod(tiles_across(spec)) * CELLS
        self._scan = np.zeros(1, evidence.SCAN)
        self._sheet = evidence.Sheet(cell_numbers(spec), np.zeros(count, np.uint8),
                                     np.empty(CELLS, np.int8))
        self._stamp = -1  # that of the last scan's hits; no cell has that of the next one's

    def integrate(self, x_m: float, y_m: float, yaw_rad: float, scan: LaserScan,
                  usable_range_m: float, robot_map: RobotMap) -> int:
        """See ``RobotMap.integrate_scan``. Returns the number of changed tiles."""
        spec = self._spec
        self._stamp = (self._stamp + 2) % 254
        if self._stamp == 1:
            self._sheet.marks[:] = 0
        per_m = 1.0 / spec.resolution_m
        x_m, y_m = laser_at(x_m, y_m, yaw_rad, scan)
        self._scan[0] = (
            (x_m - spec.x_m) * per_m, (y_m - spec.y_m) * per_m, yaw_rad, scan.angle_min_rad,
            scan.angle_increment_rad, per_m, no_return_m(scan.range_max_m) * per_m,
            usable_range_m * per_m, spec.width, spec.height, self._stamp,
            _NEVER if scan.is_lowest else kernels.OCCUPIED)
        ranges = np.ascontiguousarray(scan.ranges, np.float32)  # of any world, also a plug-in's
        return _integrate(ranges, self._scan, self._sheet, robot_map.version + 1,
                          robot_map.own.indices, robot_map.pool.arrays, robot_map.sum)


_scans = lru_cache(maxsize=4)(_Scans)


class RobotMap:
    """The knowledge of one robot: ``fused`` int16 [tiles, 1024], the sum of all its layers, always
    up to date. (An int16 holds the sum of 468 sources that are all at the clamp.)

    ``version`` counts the changes of knowledge: cells that became free, occupied or unknown. More
    evidence for the same state is no change. ``tile_version`` [tiles] has the version of each
    tile's last change, ``row_version`` [tiles, 32] that of each of its rows of cells. All
    ``observers`` are called as ``observer(changed_tiles)`` after a change, all
    ``scan_observers`` as ``observer(pose, scan, usable_range_m)`` after each of the robot's own
    scans, all ``redraw_observers`` as ``observer(poses)`` after the own layer was drawn anew.
    ``padding``: the number of additional cells that the map has in messages.
    """

    def __init__(self, spec: GridSpec, pool: TilePool) -> None:
        self.spec, self.pool = spec, pool
        self.padding = 0
        self.tiles_x, self.tiles_y = tiles_across(spec)
        self.tiles = np.arange(self.tiles_x * self.tiles_y, dtype=np.int32)
        self.fused = np.zeros((len(self.tiles), CELLS), np.int16)
        self.version = 0
        self.tile_version = np.zeros(len(self.tiles), np.int64)
        self.row_version = np.zeros((len(self.tiles), TILE), np.int32)
        self.observers: list[Callable[[np.ndarray], object]] = []
        self.scan_observers: list[Callable[[Pose2D, LaserScan, float], None]] = []
        self.redraw_observers: list[Callable[[list[Pose2D]], None]] = []
        self.frames: dict[str, Pose2D] = {}  # of strangers, where localization has found them
        self.own = Layer(pool, self.tiles)
        self.received: dict[str, Received] = {}
        self.sum = kernels.Fused(self.fused, self.tile_version, self.row_version,
                                 np.empty(len(self.tiles), np.int32),
                                 np.full(len(self.tiles), -1, np.int32), np.empty(CELLS, np.int16))
        self._scans = _scans(spec)

    def integrate_scan(self, x_m: float, y_m: float, yaw_rad: float, scan: LaserScan,
                       usable_range_m: float) -> None:
        """Add the evidence of a scan from this pose to the own layer and the sum. Beams of
        ``usable_range_m`` and more clear space up to there and mark nothing."""
        self._integrate(x_m, y_m, yaw_rad, scan, usable_range_m)
        for observer in self.scan_observers:
            observer(Pose2D(x_m, y_m, yaw_rad), scan, usable_range_m)

    def receive(self, updates: Iterable[tuple[str, int, LayerSnapshot]]) -> bool:
        """Take in updates: source, version and evidence. Each tile of a snapshot replaces an older
        one of its source, and the newest version of a tile stays, so that order, duplicates and
        gaps do not matter. Returns whether that changed the knowledge."""
        taken = []  # holds what is replaced until the sum is made
        for source, version, snapshot in updates:
            change = replacement(self.received.get(source), self.tiles, version, snapshot)
            self.received[source] = change.after
            taken.append(change)
        if len(taken) == 1:
            _, _, tiles, differences = taken[0]
        else:
            tiles, at = np.concatenate([change.tiles for change in taken]), 0
            differences = np.empty((len(tiles), CELLS), np.int16)
            for change in taken:
                at = _append(change.differences, at, differences)
        return self._note(_add(tiles, differences, np.empty(len(tiles), np.int32),
                               self.version + 1, self.sum))

    def redraw_own(self, scans: Iterable[tuple[np.ndarray, LaserScan]], usable_range_m: float
                   ) -> None:
        """Replace the own layer by the evidence of ``scans``, each from its pose [3]; the
        ``scan_observers`` had them before."""
        tiles = self.own.snapshot().filled()
        differences = difference_of(self.pool, np.zeros(len(tiles), np.int32),
                                    self.own.indices[tiles])
        self.own = Layer(self.pool, self.tiles)
        self._note(_add(tiles, differences, np.empty(len(tiles), np.int32), self.version + 1,
                        self.sum))
        poses = []
        for (x_m, y_m, yaw_rad), scan in scans:
            self._integrate(x_m, y_m, yaw_rad, scan, usable_range_m)
            poses.append(Pose2D(float(x_m), float(y_m), float(yaw_rad)))
        for observer in self.redraw_observers:
            observer(poses)

    def replace_own(self, whole: LayerSnapshot) -> bool:
        """Replace the own layer by complete evidence, which another host has drawn of this robot's
        scans. Returns whether that changed the knowledge."""
        before, self.own = self.own, Layer.of(whole)
        tiles = before.changed_since(whole)
        differences = difference_of(self.pool, whole.indices[tiles], before.indices[tiles])
        return self._note(_add(tiles, differences, np.empty(len(tiles), np.int32),
                               self.version + 1, self.sum))

    def layers(self) -> tuple[LayerSnapshot, ...]:
        """Snapshots of all layers, own first: the map as it is now, immutable."""
        return (self.own.snapshot(), *self.received.values())

    def fusion_of(self, layers: tuple[LayerSnapshot, ...]) -> np.ndarray:
        """int16 [tiles, 1024]: the map that these complete snapshots, own first, would make."""
        return fuse(layers)

    def _integrate(self, x_m: float, y_m: float, yaw_rad: float, scan: LaserScan,
                   usable_range_m: float) -> None:
        self.pool.reserve(len(self.tiles))
        self.own.changing()
        self._note(self._scans.integrate(x_m, y_m, yaw_rad, scan, usable_range_m, self))

    def _note(self, count: int) -> bool:
        """Note that ``count`` tiles of the sum have changed. Returns whether the knowledge has."""
        if count:
            self.version += 1
            if self.observers:
                changed = self.sum.changed[:count].copy()
                for observer in self.observers:
                    observer(changed)
        return count > 0
