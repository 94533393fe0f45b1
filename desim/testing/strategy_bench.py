"""A robot without a simulator: a ``StrategyContext`` whose world is a list of frontiers.

What the strategy does is kept: ``goals``, ``driven``, ``acts``, ``maps_shared``, ``published``,
``timers``, ``shown``. A check plays the
part of the team: it delivers messages, or loses them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from desim import ports
from desim.engine.streams import Streams
from desim.middleware.contents import LaserScan
from desim.ports.arguments import (
    check_advertised,
    check_body,
    check_callback,
    check_delay,
    check_goal,
    check_limit,
    check_new_topic,
    check_period,
    check_sources,
    check_timers,
    check_topic,
    check_work,
    checked_marks,
    checked_place,
    checked_places,
    checked_velocities,
    start_of_ways,
)
from desim.robot.coordination.strategy_messages import MessageCount, encoded
from desim.units import NS_PER_S

Callback = Callable[[ports.StrategyContext], object]
OnMessage = Callable[[ports.StrategyContext, ports.StrategyMessage], object]

_SIDE_M = 100.0
_FREE_M = 100.0  # beyond the raster the plane goes on as far
_CELL_M = 0.5
_BEAMS, _VIEW_M = 8, 30.0


class StrategyBench:
    """A robot at the origin, with free space all around, that heard of one other robot.
    ``team_state``: whether teammates send their goals, as they do for ``reads_team_state``."""

    def __init__(self, frontiers: list[ports.Frontier], name: str = "robot_1",
                 team: tuple[str, ...] = ("robot_2", "robot_10", "base"), *,
                 team_state: bool = True) -> None:
        self.name, self.team = name, team
        self.now_ns = 10 * NS_PER_S
        self.has_body = True
        self.pose: ports.Pose2D | None = ports.Pose2D(0.0, 0.0, 0.0)
        self.goal: ports.Place | None = None
        self._their_goal = ports.Place(6.0, 5.0) if team_state else None
        self.peers = {"robot_2": ports.Peer(5.0, 5.0, 0.0, 9 * NS_PER_S, self._their_goal)}
        self.heard = {"robot_2": ports.TeamLink(9 * NS_PER_S, lambda: -60.0)}
        self.known = frontiers
        self.task: Any = None
        cells = int(_SIDE_M / _CELL_M)
        self.grid = ports.GridSpec(_CELL_M, cells, cells, -_SIDE_M / 2, -_SIDE_M / 2)
        self.goals: list[ports.Place | None] = []
        self.driven: list[list[float]] = []
        self.acts: list[object] = []
        self.maps_shared = 0
        self.shown: dict[str, list[ports.Mark]] = {}
        self.published: list[ports.StrategyMessage] = []
        self.answers = 0  # of this instant, each to the one before
        self.timers: list[Callback] = []
        self.subscriptions: list[tuple[str, OnMessage]] = []
        self._advertised: set[str] = set()
        self._messages = MessageCount()

    @property
    def peers(self) -> Mapping[str, ports.Peer]:
        return self._peers

    @peers.setter
    def peers(self, peers: Mapping[str, ports.Peer]) -> None:
        self._peers = MappingProxyType(dict(peers))

    def links(self) -> dict[str, ports.TeamLink]:
        return dict(self.heard)

    def areas(self) -> dict[str, ports.TeamArea]:
        """Of robot_2, the right half of the plane."""
        seen = np.zeros((self.grid.height, self.grid.width), bool)
        seen[:, self.grid.width // 2:] = True
        seen.flags.writeable = False
        return {name: ports.TeamArea(seen, peer.heard_ns) for name, peer in self.peers.items()}

    def frontiers(self, limit: int | None = None, origin: ports.Place | None = None
                  ) -> list[ports.Frontier]:
        check_limit(limit)
        self._from(origin)
        return self.known[:limit]

    def path_lengths_m(self, places: Sequence[tuple[float, float]],
                       origin: ports.Place | None = None) -> np.ndarray:
        start = self._from(origin)
        return np.array([math.dist(place, start) for place in checked_places(places)])

    def gain_m2(self, place: tuple[float, float]) -> float:
        at = checked_place(place)
        return sum(float(one.cells) for one in self.known if one[:2] == at)

    def known_m2(self) -> float:
        return _SIDE_M**2

    def occupancy(self) -> np.ndarray:
        return self._free(np.int8)

    def costmap(self) -> np.ndarray:
        return self._free(np.uint8)

    def go(self, place: tuple[float, float] | ports.Frontier) -> bool:
        check_body(self.name, self.has_body)
        check_goal(place)
        if self.pose is None or not self.is_free(place[0], place[1]):
            return False
        self.goal = ports.Place(place[0], place[1])
        self.goals.append(self.goal)
        return True

    def stop(self) -> None:
        check_body(self.name, self.has_body)
        self.goal = None
        self.goals.append(None)

    def drive(self, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        check_body(self.name, self.has_body)
        self.driven.append(checked_velocities(forward_mps, left_mps, turn_radps))
        self.goal = None

    def scan(self) -> LaserScan:
        """Nothing around, in all directions."""
        check_body(self.name, self.has_body)
        return LaserScan(self.now_ns, np.full(_BEAMS, _VIEW_M, np.float32), -math.pi,
                         math.tau / _BEAMS, _VIEW_M)

    def act(self, content: object) -> None:
        self.acts.append(content)

    def share_map(self) -> None:
        check_body(self.name, self.has_body)
        self.maps_shared += 1

    def advertise(self, topic: str, *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        check_topic(topic, queue)
        check_new_topic(topic, self._advertised)
        self._advertised.add(topic)

    def subscribe(self, topic: str, callback: OnMessage, *, sources: Collection[str] | None = None,
                  queue: int = 10) -> None:
        check_topic(topic, queue)
        check_callback(callback, "context", "message")
        check_sources(sources, self.team)
        self.subscriptions.append((topic, callback))

    def publish(self, topic: str, content: Any, size_bytes: int | None = None) -> None:
        check_advertised(topic, self._advertised)
        self._messages.add(topic, self.now_ns, self.answers)
        self.published.append(ports.StrategyMessage(
            self.name, topic, encoded(content, size_bytes).decoded(), self.now_ns))

    def after(self, delay_ns: int, callback: Callback) -> None:
        check_delay(delay_ns, len(self.timers))
        check_callback(callback, "context")
        self.timers.append(callback)

    def every(self, period_ns: int, callback: Callback) -> None:
        check_period(period_ns)
        check_timers(len(self.timers))
        check_callback(callback, "context")

        def again(context: ports.StrategyContext) -> None:
            self.timers.append(again)
            callback(context)

        self.timers.append(again)

    def worked(self, **quantities: int) -> None:
        check_work(self.name, quantities)

    def stream(self, *name: str | int) -> np.random.Generator:
        return Streams(0)("view", *name)

    def show(self, kind: str, marks: Iterable[ports.Mark]) -> None:
        self.shown[kind] = checked_marks(marks)

    # --------------------------------------------------------------------------- what a test does

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Whether the robot can be there: on the plane, that is."""
        return max(abs(x_m), abs(y_m)) <= _FREE_M

    def run_timers(self) -> None:
        """Call all that was set until now, once. Periodic timers stay set."""
        due, self.timers = self.timers, []
        for callback in due:
            callback(self)

    def hear(self, name: str) -> None:
        """Something of a teammate has come: its pose, and its goal if it sends that."""
        self.peers = {**self.peers, name: ports.Peer(5.0, 5.0, 0.0, self.now_ns,
                                                     self._their_goal)}
        self.heard[name] = ports.TeamLink(self.now_ns, lambda: -60.0)

    def deliver(self, message: ports.StrategyMessage) -> None:
        """Call those who subscribe to the message's topic."""
        for topic, callback in self.subscriptions:
            if topic == message.topic:
                callback(self, message)

    def _from(self, origin: ports.Place | None) -> tuple[float, float]:
        return start_of_ways(origin, self.pose, self.has_body)

    def _free(self, dtype: type[np.integer[Any]]) -> np.ndarray:
        values = np.zeros((self.grid.height, self.grid.width), dtype)
        values.flags.writeable = False
        return values
