"""Robots send their frontiers, and no maps."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from desim import ports
from desim.middleware.contents import MAP_FRAME_BYTES, POSE_STAMPED_BYTES
from desim.ports import Pose2D
from desim.ports.sharing import Contribution, Evidence, SharingContext, SharingTraits
from desim.robot.mapping.kernels.tiles import MISS
from desim.robot.mapping.tiles import FREE, OCCUPIED, raster
from desim.robot.sharing.rates import MERGING_HZ, REFRESH_PERIODS
from desim.units import NS_PER_S, Pace


def grid_cells_bytes(cells: int) -> int:
    """nav_msgs/GridCells: header, cell_width, cell_height, and a geometry_msgs/Point a cell."""
    return 28 + MAP_FRAME_BYTES + 24 * cells


class FrontierUpdate(NamedTuple):
    """The cells of a robot's frontiers, ``cells`` of them, as evidence that they are free, and its
    pose: a geometry_msgs/PoseStamped and a nav_msgs/GridCells."""

    version: int
    pose: Pose2D
    layer: Evidence
    cells: int

    @property
    def size_bytes(self) -> int:
        return POSE_STAMPED_BYTES + grid_cells_bytes(self.cells)


class Frontiers:
    """Sends every ``period`` the robot's pose and the free cells of its map that are beside unknown
    ones, if these have changed. Receivers learn that these cells are free, and nothing else: each
    robot has to see the terrain itself."""

    class Params(ports.Params):
        """The period of updates."""

        period_ns: Pace = Field("5 s", description="(as own_maps, for comparison)")
        via: Literal["unicast", "broadcast"] = Field("unicast", description="(the paper: TCPROS)")

    # A host without scans would know edges of free terrain, and nothing inside.
    traits = SharingTraits(needs_body=True)

    def __init__(self, params: Params) -> None:
        self._params = params
        self._sent: Evidence | None = None  # the map at the last update
        self._silent = 0  # periods since then

    def start(self, context: SharingContext) -> None:
        context.advertise(latch=True, via=self._params.via)
        self._inbox = context.latest()
        context.every(self._params.period_ns, self._on_period)
        context.every(NS_PER_S // MERGING_HZ, self._listen)

    def _on_period(self, context: SharingContext) -> None:
        pose, known = context.pose, context.own()
        self._silent += 1
        if pose is None or not context.has_subscribers() or not len(known.filled()):
            return
        if known is self._sent and self._silent < REFRESH_PERIODS:
            return
        self._sent, self._silent = known, 0
        cells = frontier_cells(raster(context.grid, known.cells()))
        layer = context.drawn(np.where(cells, MISS, 0).astype(np.int8))
        context.publish(FrontierUpdate(context.now_ns, pose, layer, int(np.count_nonzero(cells))))

    def _listen(self, context: SharingContext) -> None:
        heard = self._inbox.news()
        if heard:
            context.take_in([Contribution(message.source, message.content.version,
                                          message.content.pose, message.content.layer)
                             for message in heard])


def frontier_cells(log_odds: np.ndarray) -> np.ndarray:
    """bool, of int8 [height, width]: the free cells with an unknown one beside them (Yamauchi
    1997); beyond the rim nothing is unknown."""
    unknown = np.pad((log_odds > FREE) & (log_odds < OCCUPIED), 1)
    beside = unknown[:-2, 1:-1] | unknown[2:, 1:-1] | unknown[1:-1, :-2] | unknown[1:-1, 2:]
    return (log_odds <= FREE) & beside
