"""The ``StrategyContext`` of a host: the knowledge of its strategy, its messages, its timers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from types import MappingProxyType
from typing import Any, Protocol, cast

import numpy as np

from desim.errors import InputError, ModelError
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.ports import (
    Frontier,
    GridSpec,
    Mark,
    Peer,
    Place,
    Pose2D,
    Ranges,
    StrategyContext,
    StrategyMessage,
    TeamArea,
    TeamLink,
)
from desim.ports.arguments import (
    check_advertised,
    check_body,
    check_callback,
    check_delay,
    check_limit,
    check_new_topic,
    check_period,
    check_sources,
    check_timers,
    check_topic,
    checked_marks,
    checked_place,
    checked_places,
    checked_velocities,
    name_of,
    start_of_ways,
)
from desim.robot.coordination.strategy_messages import Encoded, MessageCount, encoded
from desim.robot.coordination.task_link import TaskLink
from desim.robot.navigation.map_queries import MapQueries
from desim.robot.team import Team
from desim.units import NS_PER_S

Callback = Callable[[StrategyContext], object]
OnMessage = Callable[[StrategyContext, StrategyMessage], object]

_NO_DISCS = np.zeros((0, 3), np.int64)


class Drives(Protocol):
    """A robot that can be sent somewhere."""

    def pose(self) -> Pose2D | None:
        """Its pose, None before the first one."""

    def goal(self) -> Place | None:
        """The place that it drives to."""

    def go(self, place: tuple[float, float] | Frontier) -> bool:
        """See ``StrategyContext.go``."""

    def stop_driving(self) -> None:
        """See ``StrategyContext.stop``."""

    def drive(self, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        """See ``StrategyContext.drive``."""

    def scan(self) -> Ranges | None:
        """See ``StrategyContext.scan``."""

    def share_map(self) -> None:
        """See ``StrategyContext.share_map``."""

    def discs(self) -> np.ndarray:
        """The blacklist, as ``GlobalPlanner.frontiers`` takes it."""

    def show(self, frontiers: list[Frontier]) -> None:
        """Note that the strategy was given these."""


class HostContext:
    """The knowledge and the actions of a strategy on the host of ``node``. ``body``: the robot, or
    None on a host without a body | ``link``: to its task."""

    def __init__(self, node: Node, team: Team, queries: MapQueries, body: Drives | None,
                 link: TaskLink) -> None:
        self._node, self._team, self._queries, self._body = node, team, queries, body
        self.task, self._link = link.briefing, link
        self._topics: set[str] = set()  # advertised
        self._waiting = 0  # timers
        self._messages = MessageCount()

    # -------------------------------------------------------------------------------- knowledge

    @property
    def name(self) -> str:
        return self._node.host.name

    @property
    def has_body(self) -> bool:
        return self._body is not None

    @property
    def now_ns(self) -> int:
        return self._node.now_ns

    @property
    def pose(self) -> Pose2D | None:
        return None if self._body is None else self._body.pose()

    @property
    def goal(self) -> Place | None:
        return None if self._body is None else self._body.goal()

    @property
    def peers(self) -> Mapping[str, Peer]:
        return MappingProxyType(self._team.peers)

    @property
    def team(self) -> tuple[str, ...]:
        return self._team.names

    def links(self) -> dict[str, TeamLink]:
        return self._team.links()

    def areas(self) -> dict[str, TeamArea]:
        found = ((name, self._queries.seen_by(name)) for name in self._team.names)
        return {name: area for name, area in found if area is not None}

    def frontiers(self, limit: int | None = None, origin: Place | None = None) -> list[Frontier]:
        check_limit(limit)
        discs = _NO_DISCS if self._body is None else self._body.discs()
        found = self._queries.frontiers(self._from(origin), limit, discs)
        self._node.worked(plans=1, cells=self._queries.cells, candidates=len(found))
        if self._body is not None:
            self._body.show(found)
        return found

    def path_lengths_m(self, places: Sequence[tuple[float, float]], origin: Place | None = None
                       ) -> np.ndarray:
        self._node.worked(plans=1, cells=self._queries.cells, candidates=len(places))
        return self._queries.path_lengths_m(self._from(origin), checked_places(places))

    def gain_m2(self, place: tuple[float, float]) -> float:
        self._node.worked(candidates=1)
        return self._queries.gain_m2(*checked_place(place))

    @property
    def grid(self) -> GridSpec:
        return self._queries.grid

    def known_m2(self) -> float:
        return self._queries.known_m2()

    def occupancy(self) -> np.ndarray:
        return _read_only(self._queries.occupancy())

    def costmap(self) -> np.ndarray:
        return _read_only(self._queries.costs())

    # ---------------------------------------------------------------------------------- actions

    def go(self, place: tuple[float, float] | Frontier) -> bool:
        return self._driver().go(place)

    def stop(self) -> None:
        self._driver().stop_driving()

    def drive(self, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        self._driver().drive(*checked_velocities(forward_mps, left_mps, turn_radps))

    def scan(self) -> Ranges | None:
        return self._driver().scan()

    def act(self, content: object) -> None:
        self._link.act(self.name, content)

    def share_map(self) -> None:
        self._driver().share_map()

    def advertise(self, topic: str, *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        check_topic(topic, queue)
        if not self._team.common_frame:
            raise InputError("coordination.strategy: it speaks to its team, of places that mean "
                             "nothing to robots that do not know where the others started; choose "
                             "one that is silent, or another coordination.exchange.model")
        check_new_topic(topic, self._topics)
        self._topics.add(topic)
        try:
            self._node.advertise(_absolute(self.name, topic), transport=transport, latch=latch,
                                 queue=queue, via=via)
        except InputError as error:
            raise ModelError(str(error)) from error

    def subscribe(self, topic: str, callback: OnMessage, *, sources: Collection[str] | None = None,
                  queue: int = 10) -> None:
        check_topic(topic, queue)
        check_callback(callback, "context", "message")
        check_sources(sources, self.team)
        for name in self._team.names if sources is None else sources:
            self._node.subscribe(_absolute(name, topic), partial(self._receive, topic, callback),
                                 queue)

    def publish(self, topic: str, content: Any, size_bytes: int | None = None) -> None:
        check_advertised(topic, self._topics)
        self._messages.add(topic, self.now_ns, self._node.round)
        self._node.publish(_absolute(self.name, topic), encoded(content, size_bytes))

    def after(self, delay_ns: int, callback: Callback) -> None:
        check_delay(delay_ns, self._waiting)
        check_callback(callback, "context")
        self._waiting += 1
        self._node.after(delay_ns, self._call, callback, name=name_of(callback))

    def every(self, period_ns: int, callback: Callback) -> None:
        check_period(period_ns)
        check_timers(self._waiting)
        check_callback(callback, "context")
        self._waiting += 1
        self._node.timer(Fraction(NS_PER_S, period_ns), lambda _: callback(self),
                         name=name_of(callback))

    def worked(self, **quantities: int) -> None:
        self._node.worked(**quantities)

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._node.stream("strategy", *name)

    def show(self, kind: str, marks: Iterable[Mark]) -> None:
        if self._node.is_watched:
            shown = checked_marks(marks)
            places = np.array([mark[:2] for mark in shown], float).reshape(-1, 2)
            self._node.display(kind, places, tuple(mark.text for mark in shown))

    # ------------------------------------------------------------------------------------------

    def listen(self, listener: Callable[[object], object]) -> None:
        """Call ``listener(content)`` in this instant for what the task tells, while the host is up.
        """
        def hear(content: object) -> None:
            if self._node.host.up:
                self._node.after(0, listener, content, name="on_task")

        self._link.listen(self.name, hear)

    def _receive(self, topic: str, callback: OnMessage, message: Message) -> None:
        said: Encoded = message.content
        source = message.origin.name
        self._team.received(message)
        self._team.spoke(source, self.now_ns)
        callback(self, StrategyMessage(source, topic, said.decoded(), message.stamp_ns))

    def _call(self, callback: Callback) -> None:
        self._waiting -= 1
        callback(self)

    def _from(self, origin: Place | None) -> tuple[float, float]:
        return start_of_ways(origin, self.pose, self.has_body)

    def _driver(self) -> Drives:
        check_body(self.name, self.has_body)
        return cast(Drives, self._body)  # checked just now


def _absolute(host: str, topic: str) -> str:
    return f"/{host}/strategy/{topic}"


def _read_only(values: np.ndarray) -> np.ndarray:
    values.flags.writeable = False
    return values
