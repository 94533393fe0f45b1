"""Robots send submaps once, and poses of submaps again when SLAM has corrected them."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from pydantic import Field

from desim import ports
from desim.middleware.contents import POSE_STAMPED_BYTES
from desim.ports import GridSpec, Pose2D
from desim.ports.sharing import Contribution, LocalMap, Scan, SharedMessage, SharingContext
from desim.robot.mapping.kernels.evidence import CLAMP_HIGH, CLAMP_LOW
from desim.robot.mapping.tiles import cropped, raster
from desim.robot.sharing.map_message import ZLIB_LEVEL
from desim.robot.sharing.map_resampling import resampled
from desim.robot.sharing.rates import REFRESH_PERIODS
from desim.units import Pace, Period

_POSE_BYTES = 24  # x, y, yaw as float64


class Submap(NamedTuple):
    """A closed piece of a robot's map, the one of this ``number`` since the robot started at
    ``session`` ns: int8 ``log_odds`` whose lower left cell is ``row``, ``column`` of the grid as
    long as its first scan has the pose ``drawn_at``. On the wire: session and number, the pose,
    four u16 of its place and sides, and the cells, compressed (zlib)."""

    session: int
    number: int
    drawn_at: Pose2D
    row: int
    column: int
    log_odds: np.ndarray
    size_bytes: int


class SubmapPoses(NamedTuple):
    """The poses of all closed submaps, and the robot's own (geometry_msgs/PoseStamped)."""

    session: int
    pose: Pose2D
    poses: tuple[Pose2D, ...]

    @property
    def size_bytes(self) -> int:
        return 12 + POSE_STAMPED_BYTES + _POSE_BYTES * len(self.poses)


class WantedSubmaps(NamedTuple):
    """A request to ``source``: these submaps (std_msgs/String, UInt64, u32 each)."""

    source: str
    session: int
    numbers: tuple[int, ...]

    @property
    def size_bytes(self) -> int:
        return 4 + len(self.source) + 12 + 4 * len(self.numbers)


class OpenSubmap(NamedTuple):
    """The submap that is being made."""

    local_map: LocalMap
    drawn_at: Pose2D
    since_ns: int


@dataclass
class TeammateSubmaps:
    """The submaps of a teammate since ``session``, and ``total`` int16 [height, width], their sum
    at their poses. ``version`` is that of the last change, the teammate's clock."""

    session: int
    total: np.ndarray
    version: int = 0
    submaps: dict[int, Submap] = field(default_factory=dict)
    poses: tuple[Pose2D, ...] = ()
    missing: frozenset[int] = frozenset()  # at the last word of its poses

    def pose_of(self, submap: Submap) -> Pose2D:
        """Its newest pose."""
        known = submap.number < len(self.poses)
        return self.poses[submap.number] if known else submap.drawn_at

    def add(self, grid: GridSpec, submap: Submap, sign: int) -> None:
        """Add (1) or take away (-1) its evidence at its newest pose."""
        row, column, cells = cells_at(grid, submap, self.pose_of(submap))
        self.total[row:row + len(cells), column:column + cells.shape[1]] += sign * cells


class Submaps:
    """Sends each submap once. A submap has ``scans`` scans that the robot has entered in its own
    map, or those of the time ``oldest``. The poses of all submaps, 24 B each, are sent when there
    is a new submap, when SLAM has corrected one, and after six periods without
    news. Receivers then move the submaps that they have (as Cartographer's: Hess et al. 2016), and
    ask for those that they lack. Inside a submap nothing is corrected any more."""

    class Params(ports.Params):
        """The size of submaps, and the period of poses."""

        scans: int = Field(10, ge=1, description=(
            "in a submap: 10 m of way with a scan every metre (ours)"))
        oldest_ns: Period = Field("10 s", description="the first scan of a submap that is closed "
                                                      "early (two periods)")
        period_ns: Pace = Field("5 s", description="of poses (as own_maps, for comparison)")

    def __init__(self, params: Params) -> None:
        self._params = params
        self._open: OpenSubmap | None = None
        self._firsts: list[int] = []  # of each submap, also the open one: the number of its scan
        self._poses: list[Pose2D] = []  # likewise: that scan's pose
        self._scans = 0
        self._closed: list[Submap] = []
        self._said: tuple[Pose2D, ...] = ()
        self._silent = 0  # periods since poses were sent
        self._teammates: dict[str, TeammateSubmaps] = {}

    def start(self, context: SharingContext) -> None:
        self._session = context.now_ns
        context.advertise(queue=0)
        context.advertise("poses")
        context.advertise("wanted", queue=10)
        context.subscribe(self._on_submap, queue=0)
        context.subscribe(self._on_poses, "poses")
        context.subscribe(self._on_wanted, "wanted")
        context.every(self._params.period_ns, self._on_period)

    # ------------------------------------------------------------------------------ its own map

    def on_scan(self, context: SharingContext, pose: Pose2D, scan: Scan,
                usable_range_m: float) -> None:
        """Enter it in the open submap."""
        if self._open is None:
            self._open = OpenSubmap(context.local_map(), pose, context.now_ns)
            self._firsts.append(self._scans)
            self._poses.append(pose)
        self._open.local_map.integrate(pose, scan, usable_range_m)
        self._scans += 1
        if self._scans - self._firsts[-1] >= self._params.scans:
            self._close(context)

    def on_redraw(self, context: SharingContext, poses: Sequence[Pose2D]) -> None:
        """SLAM has found better poses of all scans."""
        self._poses = [poses[first] for first in self._firsts]

    def _close(self, context: SharingContext) -> None:
        assert self._open is not None
        row, column, cells = cropped(raster(context.grid, self._open.local_map.evidence().cells()))
        submap = Submap(self._session, len(self._closed), self._open.drawn_at, row, column, cells,
                        12 + _POSE_BYTES + 8 + len(zlib.compress(cells.tobytes(), ZLIB_LEVEL)))
        self._open = None
        self._closed.append(submap)
        context.publish(submap)

    def _on_period(self, context: SharingContext) -> None:
        if self._open and context.now_ns - self._open.since_ns >= self._params.oldest_ns:
            self._close(context)
        poses, pose = tuple(self._poses[:len(self._closed)]), context.pose
        self._silent += 1
        if pose is not None and (poses != self._said or self._silent >= REFRESH_PERIODS):
            self._said, self._silent = poses, 0
            context.publish(SubmapPoses(self._session, pose, poses), "poses")

    def _on_wanted(self, context: SharingContext, message: SharedMessage) -> None:
        wanted: WantedSubmaps = message.content
        if (wanted.source, wanted.session) == (context.name, self._session):
            for number in wanted.numbers:
                context.publish(self._closed[number])

    # ------------------------------------------------------------------------ those of teammates

    def _on_submap(self, context: SharingContext, message: SharedMessage) -> None:
        submap: Submap = message.content
        theirs = self._submaps_of(context, message.source, submap.session)
        if theirs is None or submap.number in theirs.submaps:
            return
        theirs.submaps[submap.number] = submap
        theirs.add(context.grid, submap, 1)
        self._take_in(context, message, theirs, None)

    def _on_poses(self, context: SharingContext, message: SharedMessage) -> None:
        said: SubmapPoses = message.content
        theirs = self._submaps_of(context, message.source, said.session)
        if theirs is None or (message.sent_ns < theirs.version
                              and len(said.poses) < len(theirs.poses)):
            return
        before, theirs.poses = theirs.poses, said.poses
        for number, submap in theirs.submaps.items():
            was = before[number] if number < len(before) else submap.drawn_at
            if number < len(said.poses) and said.poses[number] != was:
                theirs.poses = before
                theirs.add(context.grid, submap, -1)
                theirs.poses = said.poses
                theirs.add(context.grid, submap, 1)
        missing = frozenset(range(len(said.poses))) - theirs.submaps.keys()
        late = tuple(sorted(missing & theirs.missing))  # not under way since the last time
        theirs.missing = missing
        if late:
            context.publish(WantedSubmaps(message.source, said.session, late), "wanted")
        self._take_in(context, message, theirs, said.pose)

    def _submaps_of(self, context: SharingContext, source: str, session: int
                    ) -> TeammateSubmaps | None:
        """The submaps of a teammate since it started; None for a message from before a restart."""
        theirs = self._teammates.get(source)
        if theirs is None or theirs.session < session:
            grid = context.grid
            theirs = self._teammates[source] = TeammateSubmaps(
                session, np.zeros((grid.height, grid.width), np.int16))
        return theirs if theirs.session == session else None

    def _take_in(self, context: SharingContext, message: SharedMessage, theirs: TeammateSubmaps,
                 pose: Pose2D | None) -> None:
        theirs.version = max(theirs.version + 1, message.sent_ns)  # also what comes late is news
        cells = np.clip(theirs.total, CLAMP_LOW, CLAMP_HIGH).astype(np.int8)
        context.take_in([Contribution(message.source, message.sent_ns, pose, None),
                         Contribution(message.source, theirs.version, None, context.drawn(cells))])


def cells_at(grid: GridSpec, submap: Submap, pose: Pose2D) -> tuple[int, int, np.ndarray]:
    """Row, column and log-odds of a submap whose first scan has this ``pose``."""
    drawn_at, cell_m = submap.drawn_at, grid.resolution_m
    if pose == drawn_at:
        return submap.row, submap.column, submap.log_odds
    corner_m = (grid.x_m + cell_m * submap.column - drawn_at.x_m,  # from the first scan
                grid.y_m + cell_m * submap.row - drawn_at.y_m)
    turned = Pose2D(pose.x_m, pose.y_m, pose.yaw_rad - drawn_at.yaw_rad)
    return resampled(grid, submap.log_odds, cell_m, corner_m, turned)
