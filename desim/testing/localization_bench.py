"""A robot's sensors without a simulator: a ``LocalizationContext`` that is read to."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.engine.streams import Streams
from desim.ports import Pose2D
from desim.ports.arguments import check_content, check_work, is_pose
from desim.ports.localization import (
    LaserGeometry,
    Localization,
    LocalizationContext,
    LocalizationTraits,
    MapSettings,
    OdometryErrors,
    ScanWithOdometry,
)
from desim.ports.sharing import SharedMessage, Sized
from desim.robot.localization.checks import checked_path, writes_checked
from desim.testing.advice import need

LASER = LaserGeometry(-2.25, 4.5 / 180, 12.0, 0.05)  # 181 beams
DRIFT = OdometryErrors(True, 0.01, 0.01)

Callback = Callable[[LocalizationContext], object]
Listener = Callable[[LocalizationContext, SharedMessage], object]


class BenchScan(NamedTuple):
    """A scan with the odometry of its instant; see ``ScanWithOdometry``."""

    odometry: Pose2D
    ranges: np.ndarray


class LocalizationBench:
    """A robot with ``localization``, which starts at ``now_ns``, at ``start`` if that is known;
    then ``robot_2`` shares its frame, if it is no stranger. The clock goes on with each reading."""

    def __init__(self, localization: Localization, start: Pose2D | None, now_ns: int = 0,
                 strangers: tuple[str, ...] = ()) -> None:
        self.name, self.start, self.now_ns = "robot_1", start, now_ns
        self.laser, self.odometry_errors = LASER, DRIFT
        self.map = MapSettings(0.1, 0.5, 0.5, 10.0)
        self.bodies_m = 0.0
        self.strangers = strangers
        self.team = ("robot_2",) if start is not None and not strangers else ()
        self.places: list[tuple[str, Pose2D]] = []  # of strangers' frames
        self.published: list[Sized] = []
        self.closures: list[tuple[str, int, int, np.ndarray]] = []
        self.poses: list[Pose2D] = []  # that it returned
        self.drawn: list[Pose2D] = []
        self.redrawn: list[np.ndarray] = []
        self._localization = localization
        self._undrawn: BenchScan | None = None
        self._listener: Listener | None = None
        self._timers: list[tuple[int, int, Callback]] = []  # period, next, callback
        localization.start(self)

    def stream(self, *name: str | int) -> np.random.Generator:
        return Streams(0)(self.name, *name)

    def key(self, *name: str | int) -> int:
        return Streams(0).key(self.name, *name)

    def draw(self, scan: ScanWithOdometry, pose: Pose2D) -> None:
        self._need(LocalizationTraits.of(self._localization).draws_map,
                   "declare traits = LocalizationTraits(draws_map=True), as it draws")
        self._need(scan is self._undrawn and scan is not None,
                   "draw the scan that has just come, and once")
        self._need(is_pose(pose), f"draw from a Pose2D of three finite numbers, not {pose!r}")
        self._undrawn = None
        self.drawn.append(pose)

    def redraw(self, poses: np.ndarray) -> None:
        self.redrawn.append(checked_path(self._localization, poses, len(self.drawn)).copy())

    def publish(self, content: Sized) -> None:
        check_content(content)
        self._need(self._listener is not None, "listen to the team before it publishes")
        self.published.append(content)

    def listen(self, callback: Listener) -> None:
        self._need(self._listener is None, "listen once")
        self._listener = callback

    def closed(self, source: str, theirs: int, own: int, motion: np.ndarray) -> None:
        self._need(source in (self.name, *self.team) and 0 <= own <= len(self.drawn),
                   f"report closures of its own scans, not of {source!r} and {own}")
        self.closures.append((source, theirs, own, motion))

    def place(self, source: str, frame: Pose2D) -> None:
        self._need(source in self.strangers and is_pose(frame),
                   f"place strangers, by a Pose2D, not {source!r} by {frame!r}")
        self.places.append((source, frame))

    def every(self, period_ns: int, callback: Callback) -> None:
        self._need(type(period_ns) is int and period_ns >= 1_000_000,
                   f"call something every 1 ms or more, in ns, not {period_ns!r}")
        self._timers.append((period_ns, self.now_ns + period_ns // 2, callback))

    def worked(self, **quantities: int) -> None:
        check_work(self.name, quantities)

    # ------------------------------------------------------------------------------ for a check

    def hear(self, content: Sized) -> None:
        """Hand over a message of ``robot_2``."""
        if self._listener is not None:
            self._listener(self, SharedMessage("robot_2", content, self.now_ns))

    def read(self, now_ns: int, odometry: Pose2D, scan: BenchScan | None = None) -> None:
        """Call the timers that are due by then, each at its time, and hand over a reading."""
        while self._timers:
            k = min(range(len(self._timers)), key=lambda k: self._timers[k][1])
            period_ns, due_ns, callback = self._timers[k]
            if due_ns > now_ns:
                break
            self.now_ns = due_ns
            self._timers[k] = period_ns, due_ns + period_ns, callback
            callback(self)
        self.now_ns, self._undrawn = now_ns, scan
        with writes_checked(self._localization):
            pose = self._localization.on_odometry(self, odometry, scan)
        self._need(is_pose(pose), f"return a Pose2D of three finite numbers, not {pose!r}")
        self.poses.append(Pose2D(*map(float, pose)))
        self._undrawn = None

    def _need(self, kept: bool, advice: str) -> None:
        need(kept, type(self._localization), advice)
