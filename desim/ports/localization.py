"""The contract of localization: a robot's estimate of its pose, from what its sensors read.

A plug-in gets each reading of the odometer, with the scan that belongs to it, and returns a pose in
the map's frame. The difference between the two is ROS's transform ``map -> odom``. A plug-in that
makes the map, too (SLAM), says from which pose each scan is drawn, and draws all of them anew when
it has better poses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from desim.ports import parameters
from desim.ports.sharing import SharedMessage, Sized
from desim.ports.strategies import Pose2D
from desim.ports.traits import Traits


class LaserGeometry(NamedTuple):
    """A planar laser: beam i points to ``angle_min_rad + i * increment_rad`` from its heading. A
    beam that meets nothing reads ``longest_m`` or more; a range below ``shortest_m`` is no return.
    ``mount``: its pose on the robot."""

    angle_min_rad: float
    increment_rad: float
    longest_m: float
    shortest_m: float = 0.05  # a nearer return is of the robot itself (our estimate)
    mount: Pose2D = Pose2D(0.0, 0.0, 0.0)


class OdometryErrors(NamedTuple):
    """Standard deviations of the odometer's errors: errors of each reading against the true pose
    or, if it ``drifts``, of each step between two readings."""

    drifts: bool
    position_m: float
    heading_rad: float


class MapSettings(NamedTuple):
    """The settings of the map: the width of a cell; the motion after which a scan is due; the range
    up to which beams are used (a longer one clears space up to there and marks nothing)."""

    resolution_m: float
    linear_update_m: float
    angular_update_rad: float
    usable_range_m: float


class ScanWithOdometry(Protocol):
    """A scan, and the odometry of its instant."""

    @property
    def odometry(self) -> Pose2D:
        """The odometry at the instant of the scan, interpolated where there is no reading."""

    @property
    def ranges(self) -> np.ndarray:
        """[beams] m, not to be changed. They are computed when they are first read."""


class LocalizationContext(Protocol):
    """The robot of a plug-in: its knowledge, and its actions."""

    @property
    def name(self) -> str:
        """The robot's name."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def start(self) -> Pose2D | None:
        """The pose in the map at the start of the run, as a launch file has it; None after a
        restart."""

    @property
    def laser(self) -> LaserGeometry:
        """The laser whose scans the plug-in gets."""

    @property
    def odometry_errors(self) -> OdometryErrors | None:
        """The odometer's errors; None where they are not known, as in a real robot's log."""

    @property
    def map(self) -> MapSettings:
        """The settings of the map."""

    @property
    def bodies_m(self) -> float:
        """The width of the widest teammate, which a laser may see; 0 without one."""

    @property
    def team(self) -> tuple[str, ...]:
        """The names of the robots that it can tell something, and that share its map's frame."""

    @property
    def strangers(self) -> tuple[str, ...]:
        """The names of those that it can tell something, and whose frames it does not know."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this robot's own."""

    def key(self, *name: str | int) -> int:
        """A key for noise by counter (``desim.ports.kernels``), this robot's own."""

    # --------------------------------------------------------------------------------- actions

    def draw(self, scan: ScanWithOdometry, pose: Pose2D) -> None:
        """Draw the scan of this call of ``on_odometry`` into the map, from this pose of the robot.
        Only a plug-in that ``draws_map`` may."""

    def redraw(self, poses: np.ndarray) -> None:
        """Draw the map anew: ``poses`` [n, 3] (x m, y m, yaw rad) of all n scans that were drawn,
        in their order. Where none of them has moved by a cell, the map stays."""

    def publish(self, content: Sized) -> None:
        """Send ``content`` to the team's plug-ins (topic ``/localization/ROBOT``, as a stream)."""

    def listen(self, callback: Callable[[LocalizationContext, SharedMessage], object]) -> None:
        """Call ``callback(context, message)`` for each message of the team, and be heard."""

    def closed(self, source: str, theirs: int, own: int, motion: np.ndarray) -> None:
        """Report a loop closure: scan ``own`` of those that were drawn lies at ``motion`` [3] (x m,
        y m, yaw rad) as seen from scan ``theirs`` of ``source``. Only the monitor reads it, to
        compare it with the truth."""

    def place(self, source: str, frame: Pose2D) -> None:
        """Say where the frame of stranger ``source`` lies: the pose of its first scan in this map.
        Map sharing asks for it (``SharingContext.frame_of``)."""

    def every(self, period_ns: int, callback: Callable[[LocalizationContext], object]) -> None:
        """Call ``callback(context)`` every ``period_ns``, at least 1 ms, for the first time after a
        random part of a period."""

    def worked(self, **quantities: int) -> None:
        """Add to the work of the present callback, by the names of ``ports.computers.QUANTITIES``:
        where computers get busy, how long it takes depends on that."""


@dataclass(frozen=True, kw_only=True)
class LocalizationTraits(Traits):
    """The traits of localization.

    ``draws_map``: it makes the robot's map (``LocalizationContext.draw``); if not, the robot itself
    draws scans from the poses that the plug-in returns, after enough motion.
    """

    draws_map: bool = False


class Localization(Protocol):
    """Finds a robot's pose. Built as ``Localization(params)``, one for each life of a robot.

    Its class may declare ``traits``, a ``LocalizationTraits``.
    """

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def start(self, context: LocalizationContext) -> None:
        """The robot has started; no sensor has read anything yet."""

    def on_odometry(self, context: LocalizationContext, odometry: Pose2D,
                    scan: ScanWithOdometry | None) -> Pose2D:
        """The robot's pose in the map now, at this reading of the odometer. ``scan``: the
        newest scan, if it has the stamp of this reading (or lies between this reading and the last,
        where stamps never agree); else None."""
