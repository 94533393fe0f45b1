"""The contract of a strategy: it chooses where a robot goes next, and may send messages.

A strategy is asked for a goal (``choose``). It may have the methods of the small protocols at the
end, too, and is then called when the robot starts, a drive ends, or the map or the team changes. In
each call it gets a ``StrategyContext``, through which it acts.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from pydantic import Field

from desim.ports import parameters
from desim.ports.traits import Traits
from desim.ports.worlds import GridSpec
from desim.units import Duration


class Place(NamedTuple):
    """A place on the plane, m."""

    x_m: float
    y_m: float


class Frontier(NamedTuple):
    """A cluster of known free cells beside the unknown.

    ``x_m, y_m``: the place to drive to, at one of its cells or up to 1 m before that on the path |
    ``path_m``: the cost of the path to that cell, in metres of free cells; steps near obstacles
    count for more | ``cells``: its size, the number of its cells.
    """

    x_m: float
    y_m: float
    path_m: float
    cells: int


class Pose2D(NamedTuple):
    """A robot's place on the plane, and its heading."""

    x_m: float
    y_m: float
    yaw_rad: float


class Peer(NamedTuple):
    """The last state of another robot that was received: its pose, and its goal if it sent one."""

    x_m: float
    y_m: float
    yaw_rad: float
    heard_ns: int
    goal: Place | None = None


class TeamLink:
    """A teammate as the radio hears it.

    ``heard_ns``: the time at which anything last came from it (a map update, a pose, a message of
    its strategy) | ``signal``: computes the power when ``signal_dbm`` is first read; None: there
    is none.
    """

    def __init__(self, heard_ns: int, signal: Callable[[], float | None] | None = None) -> None:
        self.heard_ns, self._signal = heard_ns, signal

    @cached_property
    def signal_dbm(self) -> float | None:
        """The power at which its last message was received, in dBm. It stays when nothing more
        comes. None: the network model has no signals, or no message has come from the teammate
        itself, without other hosts that forward or relay."""
        return None if self._signal is None else self._signal()


class TeamArea(NamedTuple):
    """The area that a teammate has seen with its own laser, as far as its maps have arrived.

    ``seen``: bool [height, width], read-only | ``sent_ns``: the teammate's clock when the
    newest of them was taken.
    """

    seen: np.ndarray
    sent_ns: int


class StrategyMessage(NamedTuple):
    """A message of a teammate's strategy. ``content`` is a copy of what was published; after
    ``publish`` without a size it is what JSON makes of it: tuples become lists."""

    source: str
    topic: str
    content: Any
    sent_ns: int


class Mark(NamedTuple):
    """A place with a few words, for people who look at a recording."""

    x_m: float
    y_m: float
    text: str


class GoalEnd(StrEnum):
    """The end of the drive to a goal. ``obsolete``: the goal is no frontier any more, or is
    blocked; ``replaced``: the strategy set another goal, or none."""

    REACHED = "reached"
    FAILED = "failed"
    OBSOLETE = "obsolete"
    REPLACED = "replaced"


class Ranges(Protocol):
    """One sweep of a laser, immutable (sensor_msgs/LaserScan)."""

    @property
    def ranges(self) -> np.ndarray:
        """[beams] float32 m, read-only; a beam that met nothing reads ``range_max_m``."""

    @property
    def range_max_m(self) -> float:
        """The longest range."""

    @property
    def angle_min_rad(self) -> float:
        """The angle of the first beam, from the robot's front."""

    @property
    def angle_increment_rad(self) -> float:
        """The angle between two beams."""


class StrategyContext(Protocol):
    """The host of a strategy: its knowledge, sensed and received, and its actions.

    The host is a robot's, or a computer without a body: there ``pose`` is None, what only a robot
    does raises ``ModelError``, and ``frontiers`` and ``path_lengths_m`` need an ``origin``.
    """

    @property
    def name(self) -> str:
        """The name of the host; a robot's host has the robot's name."""

    @property
    def has_body(self) -> bool:
        """Whether the host is a robot's."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def pose(self) -> Pose2D | None:
        """The robot's own pose, as localization estimates it."""

    @property
    def task(self) -> Any:
        """The briefing of the scenario's task: a ``desim.ports.tasks.Patrol`` for ``patrolling``,
        None for ``exploration``."""

    @property
    def goal(self) -> Place | None:
        """The goal that the robot drives to."""

    @property
    def peers(self) -> Mapping[str, Peer]:
        """The other robots that it has heard of, by name."""

    @property
    def team(self) -> tuple[str, ...]:
        """The names of all other hosts that run a strategy."""

    def links(self) -> dict[str, TeamLink]:
        """The teammates that were ever heard of, by name."""

    def areas(self) -> dict[str, TeamArea]:
        """The areas of teammates, by name, as far as they have sent maps of their own. (The goal of
        one is ``peers[name].goal``.)"""

    # ----------------------------------------------------------------------------- the own map

    def frontiers(self, limit: int | None = None, origin: Place | None = None) -> list[Frontier]:
        """Reachable frontiers in the order of ``path_m``. Paths begin at ``origin``, or at the
        robot's pose. Blacklisted frontiers are left out; those that are too small, or too near to
        obstacles, are returned if there are no others.

        With a ``limit``, those of them alone that the search meets first. It spreads in the order
        of costs, and so meets a frontier at its nearest cell. ``path_m`` belongs to a cell up to
        2 m further in, so that a frontier that is met later may have a smaller one:
        ``frontiers(1)[0]`` is not always ``frontiers()[0]``. (Where frontiers that are too small or
        too near are returned, those with the smallest ``path_m``.)"""

    def path_lengths_m(self, places: Sequence[tuple[float, float]], origin: Place | None = None
                       ) -> np.ndarray:
        """[n] costs of the paths to ``places``, in metres of free cells as ``Frontier.path_m``; inf
        where there is none."""

    def gain_m2(self, place: tuple[float, float]) -> float:
        """The unknown area that the laser would see from ``place`` if all that is unknown were free
        (the expected information gain)."""

    @property
    def grid(self) -> GridSpec:
        """The raster of ``occupancy`` and ``costmap``."""

    def known_m2(self) -> float:
        """The area that the own map shows as free or occupied."""

    def occupancy(self) -> np.ndarray:
        """[height, width] int8, read-only: 0 free, 100 occupied, -1 unknown (nav_msgs)."""

    def costmap(self) -> np.ndarray:
        """[height, width] uint8, read-only: 0 to 252 free, 253 too near to an obstacle for the
        robot's centre, 254 obstacle, 255 unknown (costmap_2d)."""

    # --------------------------------------------------------------------------------- actions

    def go(self, place: tuple[float, float] | Frontier) -> bool:
        """Drive to ``place`` instead of the present goal. If the robot cannot be there by its own
        map, this changes nothing and returns False."""

    def stop(self) -> None:
        """Give the goal up, and stand."""

    def drive(self, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        """Give the goal up, and drive at these velocities: until the next ones, the next goal, or
        the ``command_timeout`` of the robot's type."""

    def scan(self) -> Ranges | None:
        """The newest scan of the robot's first laser, None before the first. At its first call the
        strategy subscribes to them: call it in ``on_start``."""

    def act(self, content: object) -> None:
        """Do what the task knows of, where the robot is: be served at a station. Raises
        ``ModelError`` where it knows of nothing."""

    def share_map(self) -> None:
        """Send the team now what is new in the own map, as ``coordination.exchange`` does each
        ``period``, or with ``period: null`` only then. Raises ``ModelError`` where its plug-in is
        no ``ports.sharing.SharesOnRequest``."""

    def advertise(self, topic: str, *, via: str = "unicast", transport: str = "stream",
                  queue: int = 1, latch: bool = False) -> None:
        """Make ``topic`` known, to publish it later. Subscribers connect by the rules of the
        middleware; messages published before that do not reach them, unless ``latch``."""

    def subscribe(self, topic: str, callback: Callable[[StrategyContext, StrategyMessage], object],
                  *, sources: Collection[str] | None = None, queue: int = 10) -> None:
        """Call ``callback(context, message)`` for each message of ``topic`` from the team, or from
        those of it that ``sources`` names."""

    def publish(self, topic: str, content: Any, size_bytes: int | None = None) -> None:
        """Send ``content`` to the subscribers of ``topic``. Without a size it is sent as JSON in a
        std_msgs/String; with one it may be anything that can be pickled."""

    def after(self, delay_ns: int, callback: Callable[[StrategyContext], object]) -> None:
        """Call ``callback(context)`` once, ``delay_ns`` from now."""

    def every(self, period_ns: int, callback: Callable[[StrategyContext], object]) -> None:
        """Call ``callback(context)`` every ``period_ns``, at least 1 ms, for the first time after a
        random part of a period."""

    def worked(self, **quantities: int) -> None:
        """Add to the work of the present callback, by the names of ``ports.computers.QUANTITIES``:
        where computers get busy, how long it takes depends on that."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this host's own."""

    def show(self, kind: str, marks: Iterable[Mark]) -> None:
        """Show ``marks`` in the replay, in place of the last ones of this ``kind``. A run that is
        not recorded does not iterate over ``marks``, so nothing in a run may depend on that."""


@dataclass(frozen=True, kw_only=True)
class StrategyTraits(Traits):
    """The traits of a strategy.

    ``reads_team_state``: it gets the poses and goals of ``peers`` every second, unless the scenario
    says otherwise (``coordination.team_state``) | ``needs_coordinator``: it is refused on robots
    unless a host without a body runs it, too | ``needs``: a class; it serves only tasks whose
    briefing is of that class.
    """

    reads_team_state: bool = False
    needs_coordinator: bool = False
    needs: type = object


class Strategy(Protocol):
    """Decides where a robot goes next. Built as ``Strategy(params)``, one for each host.

    Its class may declare ``traits``, a ``StrategyTraits``.
    """

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def choose(self, context: StrategyContext) -> Frontier | Place | None:
        """The place to drive to, or None when there is nothing to do. Asked when the robot has no
        goal and its map has changed, and when its goal is obsolete. Never asked on a host without a
        body. A ``Place`` where the robot cannot be by its own map counts as None, and ``choose`` is
        asked again some seconds later; one off the map is an error."""


@runtime_checkable
class Starts(Protocol):
    """A strategy that prepares: ``on_start`` is the place to advertise, subscribe, set timers."""

    def on_start(self, context: StrategyContext) -> None:
        """The host has started. There is no map and no pose yet."""


@runtime_checkable
class FollowsGoals(Protocol):
    """A strategy that is notified of the ends of its drives."""

    def on_goal(self, context: StrategyContext, place: Place, end: GoalEnd) -> None:
        """The drive to ``place`` has ended. When it is replaced, the new goal is set already."""


@runtime_checkable
class FollowsMap(Protocol):
    """A strategy that acts on news of the map, also while the robot drives."""

    def on_map(self, context: StrategyContext) -> None:
        """The map has changed since the last call; at most once in ``robot.exploration.rate``."""


@runtime_checkable
class FollowsTeam(Protocol):
    """A strategy that is notified when teammates are heard of or lost."""

    def on_teammate(self, context: StrategyContext, name: str, heard: bool) -> None:
        """``name`` was heard of for the first time or again (``heard``), or was not for
        ``coordination.lost_after``."""


@runtime_checkable
class FollowsTask(Protocol):
    """A strategy to which the task says what happens on the spot."""

    def on_task(self, context: StrategyContext, content: object) -> None:
        """The task tells ``content``, as ``desim.ports.delivery.Served``; no network carries it."""


class RecordedPaths(parameters.Params):
    """Parameters of a strategy whose robots move as a recording says, in a world that can do that:
    it reads the file, and no command moves them. See ``desim.world.recorded_paths``."""

    file: parameters.File = Field(description="a CSV of poses, relative to the scenario that names "
                                              "it")
    names: dict[str, str | int] = Field({}, description=(
        "by robot, its name in the recording (its own)"))
    begin_ns: Duration | None = Field(None, description=(
        "the moment of the recording at which the run begins (null: its first pose)"))
