"""The node through which a robot shares its map with its team: the host of a plug-in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import partial

import numpy as np

from desim.engine.trace import bits
from desim.errors import ModelError, below
from desim.middleware.contents import Empty, LaserScan
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import Latest, WaitSet
from desim.ports import GridSpec, Peer, Pose2D
from desim.ports.sharing import (
    Contribution,
    FollowsRedraws,
    FollowsScans,
    PlansWithMerged,
    Scan,
    SharedMessage,
    Sharing,
    SharingContext,
    Sized,
)
from desim.robot.robot_map import RobotMap
from desim.robot.team import Team
from desim.robot.tiles import LayerSnapshot, Received, TilePool, drawn
from desim.units import NS_PER_S


class MapSharing(Node):
    """Runs ``sharing`` (None: the robot shares nothing) and hands what it takes in to
    ``robot_map`` and ``team``. ``drawn`` is the map of its own scans, often the same.

    The event ``map`` announces to other nodes of the host that this changed the map, the event
    ``peers`` that ``team`` has one peer more.
    """

    def __init__(self, host: Host, sharing: Sharing | None, robot_map: RobotMap,
                 peers: tuple[str, ...], team: Team, drawn: RobotMap) -> None:
        super().__init__(host, "map_sharing")
        self.robot_map, self.peers, self.team, self.drawn = robot_map, peers, team, drawn
        self._sharing = sharing
        self._pose = Latest(host)

    def start(self) -> None:
        sharing = self._sharing
        if sharing is None:
            return
        self.advertise("map")
        self.advertise("peers")
        self._pose = self.latest("pose")
        context = MapContext(self)
        sharing.start(context)
        if isinstance(sharing, FollowsScans):
            self.drawn.scan_observers.append(partial(sharing.on_scan, context))
        if isinstance(sharing, FollowsRedraws):
            self.drawn.redraw_observers.append(partial(sharing.on_redraw, context))

    @property
    def pose(self) -> Pose2D | None:
        """The newest pose of localization."""
        message = self._pose.message
        return None if message is None else Pose2D(*message.content[1:])

    def take_in(self, contributions: Iterable[Contribution]) -> None:
        """See ``SharingContext.take_in``."""
        team, now_ns, before = self.team, self.now_ns, len(self.team.peers)
        updates: list[tuple[str, int, LayerSnapshot]] = []
        for source, version, pose, evidence in contributions:
            if pose is not None:
                team.note_pose(source, *pose, version, now_ns)
            if isinstance(evidence, LayerSnapshot):
                updates.append((source, version, evidence))
            elif evidence is not None:
                raise ModelError(f"evidence comes from a context, from own() or drawn(), not "
                                 f"{evidence!r}")
        if len(team.peers) > before:
            self.publish("peers", Empty())
        if updates and self.robot_map.receive(updates):
            self.publish("map", Empty())

    def place(self, source: str, frame: Pose2D | None) -> None:
        """See ``SharingContext.place``."""
        number = self._graph.names.id(source)
        if frame is None:
            self.record("frame_lost", number)
            return
        self.record("frame_of", number)
        self.record("frame_at", *map(bits, frame))


def drawn_beside(robot_map: RobotMap, sharing: Sharing | None) -> RobotMap:
    """The map of the robot's own scans: ``robot_map`` itself, or one beside it, where map sharing
    makes the map to plan with."""
    raytrace_range_m = sharing.raytrace_range_m if isinstance(sharing, PlansWithMerged) else None
    if raytrace_range_m is None:
        return robot_map
    drawn = RobotMap(robot_map.spec, robot_map.pool)

    def see_near_by(pose: Pose2D, scan: LaserScan, usable_range_m: float) -> None:
        robot_map.integrate_scan(*pose, scan, min(raytrace_range_m, usable_range_m))

    drawn.scan_observers.append(see_near_by)
    return drawn


class MapAccess:
    """The part of a ``SharingContext`` that is about the robot's map. ``drawn``: see
    ``MapSharing``."""

    def __init__(self, robot_map: RobotMap, drawn: RobotMap) -> None:
        self._map, self._drawn = robot_map, drawn

    @property
    def grid(self) -> GridSpec:
        return self._map.spec

    def own(self) -> LayerSnapshot:
        return self._drawn.own.snapshot()

    def received(self) -> Mapping[str, Received]:
        return self._map.received

    def canvas(self, grid: GridSpec | None = None) -> ScanCanvas:
        return ScanCanvas(grid or self._map.spec, self._map.pool)

    def drawn(self, log_odds: np.ndarray) -> LayerSnapshot:
        spec = self._map.spec
        if log_odds.shape != (spec.height, spec.width) or log_odds.dtype != np.int8:
            raise ModelError(f"evidence is int8 [{spec.height}, {spec.width}], not "
                             f"{log_odds.dtype} {list(log_odds.shape)}")
        return drawn(self._map.pool, spec, log_odds)


class MapContext(MapAccess):
    """The ``SharingContext`` of a host."""

    def __init__(self, node: MapSharing) -> None:
        super().__init__(node.robot_map, node.drawn)
        self._node = node

    @property
    def name(self) -> str:
        return self._node.host.name

    @property
    def now_ns(self) -> int:
        return self._node.now_ns

    @property
    def pose(self) -> Pose2D | None:
        return self._node.pose

    @property
    def team(self) -> tuple[str, ...]:
        return self._node.peers

    @property
    def peers(self) -> Mapping[str, Peer]:
        return self._node.team.peers

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._node.stream("sharing", *name)

    def take_in(self, contributions: Iterable[Contribution]) -> None:
        self._node.take_in(contributions)

    def place(self, source: str, frame: Pose2D | None) -> None:
        self._node.place(source, frame)

    def advertise(self, topic: str = "", *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        with below("coordination.exchange"):
            self._node.advertise(_absolute(self.name, topic), transport=transport, latch=latch,
                                 queue=queue, via=via)

    def has_subscribers(self, topic: str = "") -> bool:
        return self._node.has_subscribers(_absolute(self.name, topic))

    def publish(self, content: Sized, topic: str = "") -> None:
        self._node.publish(_absolute(self.name, topic), content)

    def subscribe(self, callback: Callable[[SharingContext, SharedMessage], object],
                  topic: str = "", *, queue: int = 10) -> None:
        for peer in self.team:
            self._node.subscribe(_absolute(peer, topic), lambda message: callback(
                self, _shared(message)), queue)

    def latest(self, topic: str = "") -> TeamInbox:
        inbox = TeamInbox()
        for peer in self.team:
            self._node.latest(_absolute(peer, topic), inbox.waiting)
        return inbox

    def every(self, period_ns: int, callback: Callable[[SharingContext], object]) -> None:
        if type(period_ns) is not int or period_ns <= 0:
            raise ModelError(f"a timer's period is an int > 0 of ns, not {period_ns!r}")
        self._node.timer(Fraction(NS_PER_S, period_ns), lambda _: callback(self))


class TeamInbox:
    """The newest message of each teammate on one topic."""

    def __init__(self) -> None:
        self.waiting = WaitSet()

    def news(self) -> list[SharedMessage]:
        """The messages that have come and were not read yet."""
        return [_shared(message) for _, message in self.waiting.news()]


class ScanCanvas:
    """An empty map."""

    def __init__(self, grid: GridSpec, pool: TilePool) -> None:
        self._map = RobotMap(grid, pool)

    def integrate(self, pose: Pose2D, scan: Scan, usable_range_m: float) -> None:
        """Add the evidence of a scan."""
        if not isinstance(scan, LaserScan):
            raise ModelError(f"a scan comes from on_scan, not {scan!r}")
        self._map.integrate_scan(*pose, scan, usable_range_m)

    def evidence(self) -> LayerSnapshot:
        """All that was entered so far."""
        return self._map.own.snapshot()


def _shared(message: Message) -> SharedMessage:
    return SharedMessage(message.origin.name, message.content, message.born_ns)


def _absolute(host: str, topic: str) -> str:
    return f"/map_exchange/{host}/{topic}" if topic else f"/map_exchange/{host}"
