"""The robot of a log: the sensors and the clock that a plug-in of localization is given."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.engine.streams import Streams
from desim.ports import Pose2D
from desim.ports.arguments import check_callback, check_period
from desim.ports.localization import (
    Localization,
    LocalizationContext,
    LocalizationTraits,
    MapSettings,
    OdometryErrors,
    ScanWithOdometry,
)
from desim.ports.sharing import SharedMessage, Sized
from desim.robot.localization.checks import (
    checked_path,
    checked_pose,
    drawable,
)
from desim.robot.slam.settings import SlamSettings
from desim.units import NS_PER_S

Callback = Callable[[LocalizationContext], object]


class LogScan(NamedTuple):
    """A scan with the odometry of its instant; see ``ScanWithOdometry``."""

    odometry: Pose2D
    ranges: np.ndarray


class LogRobot:
    """A ``LocalizationContext`` that a log is read to, scan by scan.

    Each scan is a reading of the odometer, too. The log has the laser's own poses, so the laser is
    mounted in the middle of the robot. A log has neither the start of the robot nor the errors of
    its odometer. ``drawn`` are the numbers of the scans that are in the map, ``path`` the poses
    that they are drawn from: those of the plug-in's ``draw`` or, if it does not draw itself, those
    that it returned after enough motion.
    """

    def __init__(self, localization: Localization, settings: SlamSettings, streams: Streams
                 ) -> None:
        laser = settings.laser
        self.name, self.now_ns, self.bodies_m = "robot", 0, 0.0
        self.start: Pose2D | None = None
        self.team: tuple[str, ...] = ()
        self.strangers: tuple[str, ...] = ()
        self.odometry_errors: OdometryErrors | None = None
        self.laser = laser
        self.map = MapSettings(settings.resolution_m, settings.linear_update_m,
                               settings.angular_update_rad, laser.longest_m)
        self.drawn: list[int] = []
        self.path: list[Pose2D] = []
        self.draws_map = LocalizationTraits.of(localization).draws_map
        self._localization, self._streams = localization, streams
        self._scans, self._began_s = 0, 0.0
        self._scan: LogScan | None = None  # that may be drawn now
        self._timers: list[tuple[int, int, Callback]] = []  # period, next, callback
        localization.start(self)

    def read(self, time_s: float, odometry: np.ndarray, ranges: np.ndarray) -> Pose2D:
        """Hand over the next scan (``ranges`` [beams] m) and its ``odometry`` [3]. Returns the pose
        that the plug-in returns. The clock begins with the first scan, and never goes back."""
        if not self._scans:
            self._began_s = time_s
        self.now_ns = max(self.now_ns, round((time_s - self._began_s) * NS_PER_S))
        self._call_timers()
        place = Pose2D(*odometry.tolist())
        ranges = ranges.view()
        ranges.flags.writeable = False
        self._scan = scan = LogScan(place, ranges)
        pose = checked_pose(self._localization,
                            self._localization.on_odometry(self, place, scan))
        if not self.draws_map and self._is_due(pose):
            self._enter(pose)
        self._scan = None
        self._scans += 1
        return pose

    def _call_timers(self) -> None:
        for number, (period_ns, next_ns, callback) in enumerate(self._timers):
            if next_ns <= self.now_ns:
                late_ns = (self.now_ns - next_ns) % period_ns
                self._timers[number] = period_ns, self.now_ns - late_ns + period_ns, callback
                callback(self)

    def _is_due(self, pose: Pose2D) -> bool:
        """Whether there was enough motion since the last scan that was drawn."""
        if not self.path:
            return True
        last, drawn = self.path[-1], self.map
        return (math.dist(last[:2], pose[:2]) >= drawn.linear_update_m
                or abs(math.remainder(pose.yaw_rad - last.yaw_rad, math.tau))
                >= drawn.angular_update_rad)

    def _enter(self, pose: Pose2D) -> None:
        self.drawn.append(self._scans)
        self.path.append(Pose2D(*map(float, pose)))

    # ------------------------------------------------------------------------- for the plug-in

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._streams("slam", *name)

    def key(self, *name: str | int) -> int:
        return self._streams.key("slam", *name)

    def draw(self, scan: ScanWithOdometry, pose: Pose2D) -> None:
        drawable(self._localization, scan, self._scan, pose)
        self._scan = None
        self._enter(pose)

    def redraw(self, poses: np.ndarray) -> None:
        self.path = [Pose2D(*pose) for pose in checked_path(
            self._localization, poses, len(self.drawn)).tolist()]

    def publish(self, content: Sized) -> None:
        """Do nothing: a log's robot is alone."""

    def listen(self, callback: Callable[[LocalizationContext, SharedMessage], object]) -> None:
        """Do nothing, as before."""

    def closed(self, source: str, theirs: int, own: int, motion: np.ndarray) -> None:
        """Do nothing: the relations of a log are about the whole path."""

    def place(self, source: str, frame: Pose2D) -> None:
        """Do nothing: nobody is a stranger."""

    def every(self, period_ns: int, callback: Callback) -> None:
        """The callback is called between scans, once where several periods have passed."""
        check_period(period_ns)
        check_callback(callback, "context")
        first_ns = self.now_ns + self._streams.integer(period_ns, "slam", "timer",
                                                       len(self._timers))
        self._timers.append((period_ns, first_ns, callback))

    def worked(self, **quantities: int) -> None:
        """Do nothing: nobody waits for a log's robot."""
