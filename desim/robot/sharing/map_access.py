"""The access of map sharing to the robot's map, and the evidence that it makes of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from desim.errors import ModelError
from desim.middleware.contents import LaserScan
from desim.ports import GridSpec, Pose2D
from desim.ports.sharing import Scan
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import LayerSnapshot, Received, TilePool, drawn


class MapAccess:
    """The part of a ``SharingContext`` that is about the robot's map. ``own_map``: see
    ``MapSharing``."""

    def __init__(self, robot_map: RobotMap, own_map: RobotMap) -> None:
        self._map, self._own_map = robot_map, own_map

    @property
    def grid(self) -> GridSpec:
        return self._map.spec

    @property
    def padding(self) -> int:
        return self._map.padding

    def frame_of(self, source: str) -> Pose2D | None:
        return self._own_map.frames.get(source)

    def own(self) -> LayerSnapshot:
        return self._own_map.own.snapshot()

    def received(self) -> Mapping[str, Received]:
        return self._map.received

    def local_map(self, grid: GridSpec | None = None) -> ScanMap:
        return ScanMap(grid or self._map.spec, self._map.pool)

    def drawn(self, log_odds: np.ndarray) -> LayerSnapshot:
        spec = self._map.spec
        is_array = isinstance(log_odds, np.ndarray)
        if not (is_array and log_odds.shape == (spec.height, spec.width)
                and log_odds.dtype == np.int8):
            what = (f"{log_odds.dtype} {list(log_odds.shape)}" if is_array
                    else type(log_odds).__name__)
            raise ModelError(f"evidence is int8 [{spec.height}, {spec.width}], not {what}")
        return drawn(self._map.pool, spec, log_odds)


class ScanMap:
    """A map of scans, empty at first (``SharingContext.local_map``)."""

    def __init__(self, grid: GridSpec, pool: TilePool) -> None:
        self._map = RobotMap(grid, pool)

    def integrate(self, pose: Pose2D, scan: Scan, usable_range_m: float) -> None:
        """Add the evidence of a scan."""
        if not isinstance(scan, LaserScan):
            raise ModelError(f"a scan comes from on_scan, not {scan!r}")
        self._map.integrate_scan(*pose, scan, usable_range_m)

    def evidence(self) -> LayerSnapshot:
        """The evidence of all scans so far."""
        return self._map.own.snapshot()
