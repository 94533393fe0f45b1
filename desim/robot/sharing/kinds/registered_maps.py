"""Map merging with unknown starts: robots register the maps that they receive with their own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from pydantic import Field

from desim import ports
from desim.middleware.contents import POSE_STAMPED_BYTES, occupancy_grid_bytes
from desim.ports import GridSpec, Pose2D
from desim.ports.sharing import (
    Contribution,
    Evidence,
    LocalMap,
    Scan,
    SharedMessage,
    SharingContext,
    SharingTraits,
)
from desim.robot.mapping.tiles import FREE, OCCUPIED, cropped, raster
from desim.robot.sharing.map_resampling import resampled
from desim.robot.sharing.rates import MERGING_HZ
from desim.robot.sharing.registration import Hypothesis, TrinaryMap, refined, register
from desim.robot.transforms import compose, motion_between
from desim.units import NS_PER_S, Length, Pace, Ratio

GROWTH = 1.2  # maps are compared again when both together know so many times as much


class FramedMap(NamedTuple):
    """A robot's own map and pose in its own frame, whose origin is where it started at ``session``
    ns: int8 ``log_odds`` [rows, columns], cut to what it knows; the corner is at ``left_m``,
    ``low_m``. On the wire a nav_msgs/OccupancyGrid, a geometry_msgs/PoseStamped, a std_msgs/UInt64.
    """

    session: int
    version: int
    pose: Pose2D
    left_m: float
    low_m: float
    cell_m: float
    log_odds: np.ndarray

    @property
    def size_bytes(self) -> int:
        return occupancy_grid_bytes(self.log_odds.size) + POSE_STAMPED_BYTES + 8

    @property
    def trinary(self) -> TrinaryMap:
        """Its walls and free cells."""
        cells = self.log_odds
        state = (cells >= OCCUPIED).astype(np.int8) - (cells <= FREE).astype(np.int8)
        return TrinaryMap(self.left_m, self.low_m, self.cell_m, state)


@dataclass
class StartFrame:
    """A robot's own frame, that of its start: the origin is at ``start`` [3] in the coordinates
    that the robot drives by. ``scans`` since then, in ``local_map`` as seen from there; ``grid`` is
    its raster."""

    start: np.ndarray
    session: int
    grid: GridSpec
    local_map: LocalMap
    scans: list[tuple[Scan, float]] = field(default_factory=list)

    def enter(self, pose: Pose2D, scan: Scan, usable_range_m: float) -> None:
        """Draw a scan from ``pose``, in the coordinates that the robot drives by."""
        seen = motion_between(self.start, np.array(pose)).tolist()
        self.local_map.integrate(Pose2D(*seen), scan, usable_range_m)


@dataclass
class Teammate:
    """A teammate: its newest map, and where its frame lies in one's own, if that is known.
    ``compared`` is the number of cells that both maps knew when they were last compared."""

    newest: FramedMap
    frame: np.ndarray | None = None
    compared: float = 0.0


class RegisteredMaps:
    """Sends the robot's own map in its own frame, every ``period`` if it changed. A receiver
    registers it with its own map. It accepts the frame that fits best if the walls agree and no
    other frame fits nearly as well; before that it uses neither the map nor the pose. It takes both
    back if the walls disagree later."""

    # A frame is found by laying maps over the own one.
    traits = SharingTraits(common_frame=False, needs_body=True)

    class Params(ports.Params):
        """The period of maps, and the acceptance of frames."""

        period_ns: Pace = Field("5 s", description="(gmapping map_update_interval)")
        confidence: Ratio = Field("95 %", description=(
            "the share of walls seen by both that must agree (Birk and Carpin 2006 name 0.95 "
            "certain enough; theirs is of free cells, too)"))
        rival: float = Field(0.5, ge=0, description=(
            "the most evidence that another place may have, as a share of the best one's (at 0.6 "
            "five times as many merges are false: docs/map-sharing.md)"))
        walls_m: Length = Field("20 m", description=(
            "of walls that must agree (about two sides of a cell of the maze)"))

    def __init__(self, params: Params) -> None:
        self._params = params
        self._frame: StartFrame | None = None
        self._own: tuple[Evidence, FramedMap] | None = None  # the last map, and its evidence
        self._sent: Evidence | None = None
        self._teammates: dict[str, Teammate] = {}

    def start(self, context: SharingContext) -> None:
        context.advertise(latch=True)
        self._inbox = context.latest()
        context.every(self._params.period_ns, self._on_period)
        context.every(NS_PER_S // MERGING_HZ, self._listen)

    # ------------------------------------------------------------------------------ its own map

    def on_scan(self, context: SharingContext, pose: Pose2D, scan: Scan,
                usable_range_m: float) -> None:
        """Draw it in the own frame, which begins with the first."""
        if self._frame is None:
            grid = _around(context.grid)
            self._frame = StartFrame(np.array(pose), context.now_ns, grid, context.local_map(grid))
        self._frame.scans.append((scan, usable_range_m))
        self._frame.enter(pose, scan, usable_range_m)

    def on_redraw(self, context: SharingContext, poses: Sequence[Pose2D]) -> None:
        """Draw all scans anew from the poses that SLAM has found."""
        frame = self._frame
        if frame is not None:
            frame.local_map = context.local_map(frame.grid)
            for pose, (scan, usable_range_m) in zip(poses, frame.scans, strict=True):
                frame.enter(pose, scan, usable_range_m)

    def _on_period(self, context: SharingContext) -> None:
        own = self._map(context)
        if own is not None and self._own is not None and self._own[0] is not self._sent:
            self._sent = self._own[0]
            context.publish(own)

    def _map(self, context: SharingContext) -> FramedMap | None:
        """The own map as it is now; the same object until it changes."""
        frame, pose = self._frame, context.pose
        if frame is None or pose is None:
            return None
        evidence = frame.local_map.evidence()
        if self._own is None or self._own[0] is not evidence:
            row, column, cells = cropped(raster(frame.grid, evidence.cells()))
            if not cells.any():
                return None
            cell_m = frame.grid.resolution_m
            self._own = evidence, FramedMap(
                frame.session, context.now_ns,
                Pose2D(*motion_between(frame.start, np.array(pose)).tolist()),
                frame.grid.x_m + cell_m * column, frame.grid.y_m + cell_m * row, cell_m, cells)
        return self._own[1]

    # ------------------------------------------------------------------------ those of teammates

    def _listen(self, context: SharingContext) -> None:
        heard = self._inbox.news()
        contributions = [one for message in heard for one in self._heard(context, message)]
        if contributions:
            context.take_in(contributions)

    def _heard(self, context: SharingContext, message: SharedMessage) -> list[Contribution]:
        """The evidence that the newest map of a teammate adds, or takes back."""
        source, said = message.source, message.content
        own, teammate = self._map(context), self._teammates.get(source)
        if teammate is None or teammate.newest.session < said.session:
            back = [] if teammate is None else self._forgotten(context, source, teammate)
            teammate = self._teammates[source] = Teammate(said)
            return back + self._compared(context, own, source, teammate)
        if said.version <= teammate.newest.version:
            return []
        teammate.newest = said
        return self._compared(context, own, source, teammate)

    def _compared(self, context: SharingContext, own: FramedMap | None, source: str,
                  teammate: Teammate) -> list[Contribution]:
        if own is None:
            return []
        placed = context.frame_of(source)
        if placed is not None and self._frame is not None:
            teammate.frame = motion_between(self._frame.start, np.array(placed))
            context.place(source, placed)
            return [self._seen_from_here(context, source, teammate.newest, teammate.frame)]
        known = np.count_nonzero(own.log_odds) + np.count_nonzero(teammate.newest.log_odds)
        if known >= GROWTH * teammate.compared:
            teammate.compared = float(known)
            found = self._found(own.trinary, teammate.newest.trinary, teammate.frame)
            if found is None and teammate.frame is not None:
                return self._forgotten(context, source, teammate)
            teammate.frame = found
            if found is not None and self._frame is not None:
                context.place(source, Pose2D(*compose(self._frame.start, found).tolist()))
        if teammate.frame is None:
            return []
        return [self._seen_from_here(context, source, teammate.newest, teammate.frame)]

    def _found(self, own: TrinaryMap, other: TrinaryMap, frame: np.ndarray | None
               ) -> np.ndarray | None:
        """The other's frame, if it can be accepted. If one was accepted before, the search begins
        there, at ``frame``."""
        if frame is not None:
            known = refined(own, other, frame)
            return known.frame if self._agrees(own, known) else None
        registration = register(own, other)
        if registration is None or registration.rival > self._params.rival \
                or not self._agrees(own, registration.best):
            return None
        return registration.best.frame

    def _agrees(self, own: TrinaryMap, hypothesis: Hypothesis) -> bool:
        # Both robots' wall cells are counted.
        return (hypothesis.confidence >= self._params.confidence
                and 0.5 * hypothesis.agree * own.cell_m >= self._params.walls_m)

    def _seen_from_here(self, context: SharingContext, source: str, said: FramedMap,
                        frame: np.ndarray) -> Contribution:
        """A teammate's map and pose, in the coordinates that this robot drives by."""
        assert self._frame is not None
        where = compose(self._frame.start, frame)
        grid = context.grid
        row, column, part = resampled(grid, said.log_odds, said.cell_m, (said.left_m, said.low_m),
                                      Pose2D(*where.tolist()))
        cells = np.zeros((grid.height, grid.width), np.int8)
        cells[row:row + part.shape[0], column:column + part.shape[1]] = part
        pose = Pose2D(*compose(where, np.array(said.pose)).tolist())
        return Contribution(source, said.version, pose, context.drawn(cells))

    def _forgotten(self, context: SharingContext, source: str, teammate: Teammate
                   ) -> list[Contribution]:
        """Take back the evidence that was taken in of a teammate."""
        if teammate.frame is None:
            return []
        teammate.frame, teammate.compared = None, 0.0
        context.place(source, None)
        grid = context.grid
        nothing = context.drawn(np.zeros((grid.height, grid.width), np.int8))
        return [Contribution(source, teammate.newest.version, None, nothing)]


def _around(grid: GridSpec) -> GridSpec:
    """A raster with room for the terrain, whatever the robot's start in it."""
    cells = math.ceil(math.hypot(grid.width, grid.height)) + 1
    corner_m = -cells * grid.resolution_m
    return GridSpec(grid.resolution_m, 2 * cells, 2 * cells, corner_m, corner_m)
