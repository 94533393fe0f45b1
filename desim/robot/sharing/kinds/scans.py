"""Robots send their scans, and each makes a map of each other robot's scans."""

from __future__ import annotations

from typing import NamedTuple

from pydantic import Field

from desim import ports
from desim.middleware.contents import POSE_STAMPED_BYTES
from desim.ports import Pose2D
from desim.ports.sharing import (
    Contribution,
    LocalMap,
    Scan,
    SharedMessage,
    SharingContext,
)
from desim.robot.sharing.rates import REFRESH_PERIODS
from desim.units import Pace

MOST = 100  # scans in a message, 88 kB of 180 beams


class PosedScan(NamedTuple):
    """A scan and the pose that it was taken from: sensor_msgs/LaserScan, geometry_msgs/PoseStamped.
    """

    pose: Pose2D
    scan: Scan


class ScanBatch(NamedTuple):
    """Scans of a robot, counted from ``first`` on since it started, at ``session`` ns. Beside them
    on the wire: these two (std_msgs/UInt64), ``usable_range_m`` (Float64), and a length."""

    session: int
    first: int
    usable_range_m: float
    scans: tuple[PosedScan, ...]

    @property
    def size_bytes(self) -> int:
        return 28 + sum(POSE_STAMPED_BYTES + posed.scan.size_bytes for posed in self.scans)


class WantedScans(NamedTuple):
    """A request to ``source``: its scans from ``first`` on (std_msgs/String, two UInt64)."""

    source: str
    session: int
    first: int

    @property
    def size_bytes(self) -> int:
        return 4 + len(self.source) + 16


class TeammateMap(NamedTuple):
    """The map of a teammate: of its first ``scans`` scans since ``session``."""

    session: int
    scans: int
    local_map: LocalMap


class Scans:
    """Sends every ``period`` the scans that the robot has entered in its own map since the last
    time, with their poses. A receiver that misses some asks for them, and the sender sends all from
    there on again. After six periods without new scans it sends a batch without scans,
    which has their number."""

    class Params(ports.Params):
        """The period of batches."""

        period_ns: Pace = Field("5 s", description="(as own_maps, for comparison)")

    def __init__(self, params: Params) -> None:
        self._params = params
        self._scans: list[PosedScan] = []  # all since the start
        self._next = 0  # the first that the next batch has
        self._silent = 0  # periods since the last batch
        self._usable_range_m = 0.0
        self._teammates: dict[str, TeammateMap] = {}

    def start(self, context: SharingContext) -> None:
        self._session = context.now_ns
        context.advertise(queue=0)
        context.advertise("wanted")
        context.subscribe(self._on_batch, queue=0)
        context.subscribe(self._on_wanted, "wanted")
        context.every(self._params.period_ns, self._on_period)

    def on_scan(self, context: SharingContext, pose: Pose2D, scan: Scan,
                usable_range_m: float) -> None:
        """Keep the scan for the next batch."""
        self._scans.append(PosedScan(pose, scan))
        self._usable_range_m = usable_range_m

    def _on_period(self, context: SharingContext) -> None:
        self._silent += 1
        scans = tuple(self._scans[self._next:self._next + MOST])
        if self._scans and (scans or self._silent >= REFRESH_PERIODS):
            context.publish(ScanBatch(self._session, self._next, self._usable_range_m, scans))
            self._next += len(scans)
            self._silent = 0

    def _on_wanted(self, context: SharingContext, message: SharedMessage) -> None:
        wanted: WantedScans = message.content
        if (wanted.source, wanted.session) == (context.name, self._session):
            self._next = min(self._next, wanted.first)

    def _on_batch(self, context: SharingContext, message: SharedMessage) -> None:
        source, batch = message.source, message.content
        known = self._teammates.get(source)
        if known is None or known.session < batch.session:
            known = TeammateMap(batch.session, 0, context.local_map())
        elif known.session > batch.session:
            return
        missed = batch.first - known.scans
        if missed > 0:
            context.publish(WantedScans(source, batch.session, known.scans), "wanted")
        fresh = () if missed > 0 else batch.scans[-missed:]
        for pose, scan in fresh:
            known.local_map.integrate(pose, scan, batch.usable_range_m)
        self._teammates[source] = known._replace(scans=known.scans + len(fresh))
        if fresh:
            context.take_in([Contribution(source, message.sent_ns, fresh[-1].pose,
                                          known.local_map.evidence())])
