"""A robot without a simulator: a ``SharingContext`` with a map, and a clock that a check turns."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from desim.engine.streams import Streams
from desim.middleware.contents import LaserScan
from desim.ports import GridSpec, Peer, Pose2D
from desim.ports.arguments import (
    check_callback,
    check_content,
    check_contribution,
    check_frame,
    check_period,
    check_work,
)
from desim.ports.sharing import (
    Contribution,
    FollowsScans,
    PlansWithMerged,
    SharedMessage,
    Sharing,
    SharingContext,
    Sized,
)
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import LayerSnapshot, TilePool
from desim.robot.sharing.map_access import MapAccess
from desim.robot.team import Team

GRID = GridSpec(0.5, 128, 128, 0.0, 0.0)  # 4 x 4 tiles
_REACH_M = 4.0
_SCAN = LaserScan(0, np.full(12, 5.0, np.float32), -1.5, 0.25, 5.0)  # no beam meets anything

Callback = Callable[[SharingContext], object]
OnMessage = Callable[[SharingContext, SharedMessage], object]


class Letters:
    """An inbox: the newest message of each teammate."""

    def __init__(self) -> None:
        self._waiting: dict[str, SharedMessage] = {}

    def put(self, message: SharedMessage) -> None:
        """A message has come."""
        self._waiting[message.source] = message

    def news(self) -> list[SharedMessage]:
        """The messages that have come and were not read yet."""
        waiting, self._waiting = self._waiting, {}
        return list(waiting.values())


class SharingBench(MapAccess):
    """A robot with ``sharing``, which starts at ``now_ns``. Its messages wait in ``published``,
    with their topics, until a check delivers them, or loses them."""

    def __init__(self, sharing: Sharing, name: str, team: tuple[str, ...], pool: TilePool,
                 now_ns: int) -> None:
        self.robot_map = RobotMap(GRID, pool)
        super().__init__(self.robot_map, self.robot_map)
        self.name, self.team, self.now_ns = name, team, now_ns
        self.pose: Pose2D | None = None
        self.published: list[tuple[str, SharedMessage]] = []
        self.sizes: list[int] = []  # of all messages
        self.contributions: list[Contribution] = []
        self.places: list[tuple[str, Pose2D | None]] = []  # of teammates' frames
        self._sharing, self._teammates = sharing, Team(team, 0)
        self._timers: list[tuple[int, int, Callback]] = []  # period, next, callback
        self._inboxes: list[tuple[str, Letters]] = []
        self._callbacks: list[tuple[str, OnMessage]] = []
        self._advertised: set[str] = set()
        sharing.start(self)

    @property
    def peers(self) -> Mapping[str, Peer]:
        return self._teammates.peers

    def stream(self, *name: str | int) -> np.random.Generator:
        return Streams(0)(self.name, *name)

    def take_in(self, contributions: Iterable[Contribution]) -> None:
        taken = list(contributions)
        own = (self.name,) if isinstance(self._sharing, PlansWithMerged) else ()
        for one in taken:
            check_contribution(one, (*self.team, *own))
        self.contributions += taken
        for source, version, pose, _ in taken:
            if pose is not None:
                self._teammates.note_pose(source, *pose, version, self.now_ns)
        updates = [(source, version, layer) for source, version, _, layer in taken
                   if isinstance(layer, LayerSnapshot)]
        if updates:
            self.robot_map.receive(updates)

    def place(self, source: str, frame: Pose2D | None) -> None:
        check_frame(source, frame, self.team)
        self.places.append((source, frame))

    def advertise(self, topic: str = "", *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        assert topic not in self._advertised, f"{topic!r} is advertised twice"
        self._advertised.add(topic)

    def has_subscribers(self, topic: str = "") -> bool:
        return True

    def publish(self, content: Sized, topic: str = "") -> None:
        assert topic in self._advertised, f"{topic!r} is published but not advertised"
        check_content(content)
        self.sizes.append(content.size_bytes)
        self.published.append((topic, SharedMessage(self.name, content, self.now_ns)))

    def subscribe(self, callback: OnMessage, topic: str = "", *, queue: int = 10) -> None:
        self._callbacks.append((topic, callback))

    def latest(self, topic: str = "") -> Letters:
        self._inboxes.append((topic, inbox := Letters()))
        return inbox

    def every(self, period_ns: int, callback: Callback) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._timers.append((period_ns, self.now_ns + period_ns // 2, callback))

    def worked(self, **quantities: int) -> None:
        check_work(self.name, quantities)

    # ------------------------------------------------------------------------------ for a check

    def see(self, pose: Pose2D) -> None:
        """Drive to ``pose`` and scan: there is free space all around."""
        self.pose = pose
        self.robot_map.integrate_scan(*pose, _SCAN, _REACH_M)
        if isinstance(self._sharing, FollowsScans):
            self._sharing.on_scan(self, pose, _SCAN, _REACH_M)

    def run(self, until_ns: int) -> None:
        """Call the timers that are due by then, each at its time."""
        while self._timers:
            k = min(range(len(self._timers)), key=lambda k: self._timers[k][1])
            period_ns, due_ns, callback = self._timers[k]
            if due_ns > until_ns:
                break
            self.now_ns = due_ns
            self._timers[k] = period_ns, due_ns + period_ns, callback
            callback(self)
        self.now_ns = until_ns

    def deliver(self, topic: str, message: SharedMessage) -> None:
        """Put a message where its topic is subscribed to."""
        for name, inbox in self._inboxes:
            if name == topic:
                inbox.put(message)
        for name, callback in self._callbacks:
            if name == topic:
                callback(self, message)
