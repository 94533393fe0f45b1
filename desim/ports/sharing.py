"""The contract of map sharing: what a robot sends its team of its map, and what it takes in.

A plug-in sends what it likes, when it likes. It hands what it has received to the robot's map as
evidence with a source and a version. Of each tile the newest version counts, so that messages may
come late, twice or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from desim.ports import parameters
from desim.ports.strategies import Peer, Pose2D
from desim.ports.traits import Traits
from desim.ports.worlds import GridSpec


class Sized(Protocol):
    """The content of a message: any object that nobody changes after it is published."""

    @property
    def size_bytes(self) -> int:
        """Its size on the wire, without the headers of transports."""


class Evidence(Protocol):
    """The evidence of one source at an instant, or a part of it; immutable. A tile is a square of
    32 x 32 cells; tiles count row by row from the lower left."""

    @property
    def tiles(self) -> np.ndarray:
        """[k] the numbers of its tiles."""

    @property
    def complete(self) -> bool:
        """Whether these are all tiles of the raster."""

    def filled(self) -> np.ndarray:
        """The numbers of the tiles that hold any evidence."""

    def cells(self) -> np.ndarray:
        """[k, 1024] int8, a copy: log-odds in units of 0.05 nat, positive for occupied."""

    def only(self, tiles: np.ndarray) -> Evidence:
        """A part of complete evidence: these tiles."""

    def changed_since(self, before: Self) -> np.ndarray:
        """The numbers of the tiles written to since ``before``; both complete, of one source, and
        ``before`` was held all the time."""


class ReceivedEvidence(Evidence, Protocol):
    """The evidence taken in from one source: complete, of tiles of different versions."""

    @property
    def sent(self) -> np.ndarray:
        """[tiles] the version of each tile, -1 where none came."""


class Contribution(NamedTuple):
    """News of ``source``, a robot. ``version`` is the source's clock (ns) when pose and evidence
    were taken: it grows, also over a restart. None for the pose or the evidence means no news."""

    source: str
    version: int
    pose: Pose2D | None
    evidence: Evidence | None


class SharedMessage(NamedTuple):
    """A message of a teammate's plug-in; ``content`` is the object that was published."""

    source: str
    content: Any
    sent_ns: int


class Scan(Protocol):
    """One sweep of a laser, immutable (sensor_msgs/LaserScan)."""

    @property
    def size_bytes(self) -> int:
        """The size of its ROS message."""


class LocalMap(Protocol):
    """An empty map, in which scans can be entered."""

    def integrate(self, pose: Pose2D, scan: Scan, usable_range_m: float) -> None:
        """Add the evidence of a scan from this pose. Longer beams clear space up to
        ``usable_range_m`` and mark nothing."""

    def evidence(self) -> Evidence:
        """All that was entered so far."""


class Inbox(Protocol):
    """A topic of the team without a callback: the newest message of each teammate waits."""

    def news(self) -> Sequence[SharedMessage]:
        """The messages that have come and were not read yet."""


class SharingContext(Protocol):
    """The host of a plug-in: its knowledge, and its actions.

    The topic ``""`` of robot_3 is ``/map_exchange/robot_3``, its topic ``x``
    ``/map_exchange/robot_3/x``.
    """

    @property
    def name(self) -> str:
        """The name of the host, which is the robot's."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def pose(self) -> Pose2D | None:
        """The robot's own pose, as localization estimates it; None before the first, and on a host
        without a body."""

    @property
    def team(self) -> tuple[str, ...]:
        """The names of the robots that it shares with."""

    @property
    def peers(self) -> Mapping[str, Peer]:
        """The newest pose of each other robot that it has heard of."""

    @property
    def grid(self) -> GridSpec:
        """The raster of the map, which the fleet has in common."""

    @property
    def padding(self) -> int:
        """Unknown cells that a whole map in a message has beside those of ``grid``
        (``robot.mapping.published_size``)."""

    def frame_of(self, source: str) -> Pose2D | None:
        """The frame of ``source``, as ``place`` takes it, if localization has found it."""

    def own(self) -> Evidence:
        """The robot's own evidence as it is now: the same object until it changes."""

    def received(self) -> Mapping[str, ReceivedEvidence]:
        """The evidence taken in from others, by source."""

    def local_map(self, grid: GridSpec | None = None) -> LocalMap:
        """An empty map of this raster, or of another one."""

    def drawn(self, log_odds: np.ndarray) -> Evidence:
        """Complete evidence: int8 ``log_odds`` [height, width], row 0 at the bottom."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this host's own."""

    # --------------------------------------------------------------------------------- actions

    def take_in(self, contributions: Iterable[Contribution]) -> None:
        """Hand to the robot's map and to its team what has come, all at once."""

    def place(self, source: str, frame: Pose2D | None) -> None:
        """Report where the frame of ``source`` lies (its start pose, in this robot's coordinates);
        None takes the report back. Only the monitor reads it, to compare it with the truth."""

    def advertise(self, topic: str = "", *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        """``topic`` may be published from now on. Subscribers connect as the middleware does it;
        what is published before is lost to them, unless ``latch``."""

    def has_subscribers(self, topic: str = "") -> bool:
        """Whether a message would have a receiver."""

    def publish(self, content: Sized, topic: str = "") -> None:
        """Send ``content`` to the subscribers of ``topic``."""

    def subscribe(self, callback: Callable[[SharingContext, SharedMessage], object],
                  topic: str = "", *, queue: int = 10) -> None:
        """Call ``callback(context, message)`` for each message of ``topic`` from the team."""

    def latest(self, topic: str = "") -> Inbox:
        """The newest messages of ``topic`` from the team, to be read at one's own rate."""

    def every(self, period_ns: int, callback: Callable[[SharingContext], object]) -> None:
        """Call ``callback(context)`` every ``period_ns``, at least 1 ms, for the first time after a
        random part of a period."""

    def worked(self, **quantities: int) -> None:
        """Add to the work of the present callback, by the names of ``ports.computers.QUANTITIES``:
        where computers get busy, how long it takes depends on that."""


@dataclass(frozen=True, kw_only=True)
class SharingTraits(Traits):
    """The traits of map sharing.

    ``fusion``: the default of ``coordination.exchange.fusion`` | ``common_frame``: robots know the
    relative poses of their frames; if not, nothing but map sharing may send teammates places |
    ``needs_body``: it merges into the map of its host's own scans; a scenario with a coordinator is
    refused, which has no body and no scans.
    """

    fusion: Literal["evidence", "max", "greedy"] = "evidence"
    common_frame: bool = True
    needs_body: bool = False


class Sharing(Protocol):
    """Shares maps. Built as ``Sharing(params)``, one for each host.

    Its class may declare ``traits``, a ``SharingTraits``.
    """

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def start(self, context: SharingContext) -> None:
        """The host has started: advertise, subscribe, set timers. There is no map and no pose
        yet."""


@runtime_checkable
class SharesOnRequest(Protocol):
    """Map sharing that a strategy can ask for (``StrategyContext.share_map``)."""

    def share(self, context: SharingContext) -> None:
        """Send what is new now."""


@runtime_checkable
class PlansWithMerged(Protocol):
    """Map sharing that decides on the map with which the robot plans. That map holds what the
    plug-in hands over (``take_in``, also under the robot's own name), and what the robot sees near
    by. The map of all its own scans (``own``) is for the plug-in alone."""

    @property
    def raytrace_range_m(self) -> float | None:
        """The range up to which the robot plans with what it sees itself; None: no limit."""


@runtime_checkable
class FollowsScans(Protocol):
    """Map sharing that wants the robot's scans."""

    def on_scan(self, context: SharingContext, pose: Pose2D, scan: Scan,
                usable_range_m: float) -> None:
        """The robot has entered ``scan`` from ``pose`` in its own map; see ``LocalMap``."""


@runtime_checkable
class FollowsRedraws(Protocol):
    """Map sharing that wants to know of SLAM's corrections."""

    def on_redraw(self, context: SharingContext, poses: Sequence[Pose2D]) -> None:
        """The robot has drawn its own map anew: ``poses`` of all scans since its start."""
