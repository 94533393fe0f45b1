"""The ``SharingContext`` of a host: the knowledge and the actions of a kind of map sharing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from desim.errors import below
from desim.middleware.message import Message
from desim.middleware.topics import WaitSet
from desim.ports import Peer, Pose2D
from desim.ports.arguments import (
    check_advertised,
    check_callback,
    check_content,
    check_period,
    name_of,
)
from desim.ports.sharing import SharedMessage, SharingContext, Sized
from desim.robot.sharing.map_access import MapAccess
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.robot.sharing.node import MapSharing


_new = tuple.__new__  # a named tuple at half the price


class MapContext(MapAccess):
    """The ``SharingContext`` of a host."""

    def __init__(self, node: MapSharing) -> None:
        super().__init__(node.robot_map, node.own_map)
        self._node = node
        self.take_in = node.take_in
        self._topics: set[str] = set()  # advertised

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

    def place(self, source: str, frame: Pose2D | None) -> None:
        self._node.place(source, frame)

    def advertise(self, topic: str = "", *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        self._topics.add(topic)
        with below("coordination.exchange"):
            self._node.advertise(_absolute(self.name, topic), transport=transport, latch=latch,
                                 queue=queue, via=via)

    def has_subscribers(self, topic: str = "") -> bool:
        return self._node.has_subscribers(_absolute(self.name, topic))

    def publish(self, content: Sized, topic: str = "") -> None:
        check_advertised(topic, self._topics)
        check_content(content)
        self._node.publish(_absolute(self.name, topic), content)

    def subscribe(self, callback: Callable[[SharingContext, SharedMessage], object],
                  topic: str = "", *, queue: int = 10) -> None:
        check_callback(callback, "context", "message")
        for peer in self.team:
            self._node.subscribe(_absolute(peer, topic), lambda message: callback(
                self, self._shared(message)), queue)

    def latest(self, topic: str = "") -> TeamInbox:
        inbox = TeamInbox(self._shared)
        for peer in self.team:
            self._node.latest(_absolute(peer, topic), inbox.waiting)
        return inbox

    def every(self, period_ns: int, callback: Callable[[SharingContext], object]) -> None:
        check_period(period_ns)
        check_callback(callback, "context")
        self._node.timer(Fraction(NS_PER_S, period_ns), lambda _: callback(self),
                         name=name_of(callback))

    def worked(self, **quantities: int) -> None:
        self._node.worked(**quantities)

    def _shared(self, message: Message) -> SharedMessage:
        """``message``, which is read now, for the plug-in."""
        team, origin = self._node.team, message.origin
        if team.hears_signals:
            team.received(message)
        return _new(SharedMessage, (origin.name, message.content, origin.clock_ns(message.born_ns)))


class TeamInbox:
    """The newest message of each teammate on one topic. ``shared`` makes of each what a plug-in
    reads."""

    def __init__(self, shared: Callable[[Message], SharedMessage]) -> None:
        self.waiting = WaitSet()
        self._shared = shared

    def news(self) -> list[SharedMessage]:
        """The messages that have arrived and have not been read yet."""
        return [self._shared(message) for _, message in self.waiting.news()]


def _absolute(host: str, topic: str) -> str:
    return f"/map_exchange/{host}/{topic}" if topic else f"/map_exchange/{host}"
