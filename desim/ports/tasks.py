"""The contract of a task: what a fleet is to do, when that is done, and how well it was done.

A task stands on the side of the truth, with the monitor: it sees all. Robots know its
``briefing``, which does not change in a run, and what it tells them on the spot: a load is there, a
battery is empty. No network carries that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from desim.ports import parameters
from desim.ports.strategies import Place
from desim.ports.traits import Traits
from desim.ports.worlds import GridSpec


@dataclass(frozen=True)
class Ground:
    """The truth that maps are judged by, rows from the lowest y upwards.

    ``solid`` uint8 [height, width], 0 where a cell is free | ``reachable`` bool [height, width], G:
    the free cells that lasers can come to see | ``doubts``: what is likely to be wrong with the
    files that all this came from.
    """

    grid: GridSpec
    solid: np.ndarray
    reachable: np.ndarray
    doubts: tuple[str, ...] = ()

    @property
    def cell_m2(self) -> float:
        return self.grid.resolution_m ** 2


class Patrol(NamedTuple):
    """A briefing: the places that are to be visited again and again."""

    places: tuple[Place, ...]


class Journeys(NamedTuple):
    """A briefing: by robot, the places that it has to get to one after another. ``within_m``: so
    near it is there."""

    goals: Mapping[str, tuple[Place, ...]]
    within_m: float


class SweepingTool(NamedTuple):
    """A briefing: the ground is to be passed over with a tool, a disc of ``width_m`` around a
    robot's centre."""

    width_m: float


class Formation(NamedTuple):
    """A briefing: ``leader`` drives to ``places`` in turn, and each robot of ``offsets`` keeps its
    place beside it: forward and left of the leader, in m."""

    leader: str
    places: tuple[Place, ...]
    offsets: Mapping[str, tuple[float, float]]
    within_m: float


class Knowledge(Protocol):
    """The numbers of cells of G that robots know. That of one robot may fall, that of the union of
    all robots never does."""

    @property
    def cells(self) -> int:
        """The number of all cells of G."""

    @property
    def known(self) -> Sequence[int]:
        """The number of cells known to each of ``explorers``."""

    @property
    def union_known(self) -> int:
        """The number of cells that some robot knows or has known."""

    def cells_for(self, share: float) -> int:
        """The least number of cells that is at least ``share`` of G."""


class TaskContext(Protocol):
    """The truth about a fleet, and what a task may do."""

    @property
    def robots(self) -> tuple[str, ...]:
        """All names, in the order of indices."""

    @property
    def explorers(self) -> tuple[str, ...]:
        """The names of those that carry software."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def started_ns(self) -> int:
        """The time at which the first robot's software started."""

    @property
    def ground(self) -> Ground:
        """The terrain."""

    @property
    def knowledge(self) -> Knowledge:
        """The knowledge of it in the robots' maps."""

    @property
    def stop_explored(self) -> float:
        """``stop.explored`` of the scenario."""

    @property
    def stop_by(self) -> Literal["any", "union", "all", "none"]:
        """``stop.by`` of the scenario."""

    def poses(self) -> np.ndarray:
        """[robots, 3] the true poses now: x m, y m, yaw rad."""

    def travelled_m(self) -> np.ndarray:
        """[robots] the distances driven so far, in m."""

    def every(self, period_ns: int, callback: Callable[[TaskContext], object]) -> None:
        """Call ``callback(context)`` every ``period_ns``, from one period after the start on."""

    def after(self, delay_ns: int, callback: Callable[[TaskContext], object]) -> None:
        """Call ``callback(context)`` once, ``delay_ns`` from now."""

    @property
    def radius_m(self) -> float:
        """The inscribed radius of the narrowest robot of the fleet."""

    @property
    def desks(self) -> tuple[str, ...]:
        """The names of the hosts without a body that run a strategy."""

    def notify(self, host: str, content: object) -> None:
        """Let the strategy of ``host`` know, if it is a ``ports.FollowsTask`` and the host is up:
        what it feels, sees or is given on the spot."""

    def energy_j(self) -> np.ndarray:
        """[robots] the energy used so far, NaN of those without ``robot.power``."""

    def battery_j(self) -> np.ndarray:
        """[robots] ``robot.power.battery``, NaN likewise."""

    def hold(self, robot: str) -> None:
        """Block the robot's drive: it brakes, and follows no command. The end of a fault ``stuck``
        frees it."""

    def record(self, kind: str, robot: str | None, a: int = 0, b: int = 0) -> None:
        """Write a trace row about ``robot``, or about none. All that metrics count must have a row,
        so that runs with equal rows have equal metrics."""

    def end(self, reason: str) -> None:
        """The task is done: the run ends, and its ``stop_reason`` is ``reason``."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, the task's own."""


@dataclass(frozen=True, kw_only=True)
class TaskTraits(Traits):
    """The traits of a task.

    ``gives``: the class of its briefing | ``quantities``: the names of what it ``Measures``.
    """

    gives: type = type(None)
    quantities: tuple[str, ...] = ()


class Task(Protocol):
    """The work of a fleet. Built as ``Task(params)``, one for each run.

    Its class may declare ``traits``, a ``TaskTraits``.
    """

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    @property
    def leads(self) -> tuple[str, ...]:
        """The names of its metrics, or of quantities of every run, that reports show first; of its
        class, at least one."""

    def start(self, context: TaskContext) -> None:
        """The run is put together; no software has started. Raises ``InputError`` for parameters
        that do not fit the terrain, as ``.places.2: ...``."""

    def metrics(self) -> Mapping[str, object]:
        """The task's part of ``summary.json``, when the run is over: numbers, words, None, and
        mappings of them."""


@runtime_checkable
class Briefs(Protocol):
    """A task that its robots have to know something of."""

    def briefing(self) -> object:
        """The object that every strategy finds in ``StrategyContext.task``; immutable. Asked
        after ``start``."""


@runtime_checkable
class VisitsPlaces(Protocol):
    """A task whose robots have to get to places: a run warns of those to which no path leads."""

    def briefing(self) -> Patrol:
        """The places."""

    def unvisited(self) -> list[int]:
        """The indices of the places that nobody has visited."""


@runtime_checkable
class GivesMap(Protocol):
    """A task in a terrain that is known, where the scenario says so."""

    def gives_map(self) -> bool:
        """Whether every robot starts with the map of the terrain (as of a ROS map_server)."""


@runtime_checkable
class FollowsKnowledge(Protocol):
    """A task that looks at what robots know."""

    def on_knowledge(self, context: TaskContext, explorer: int) -> None:
        """The map of a robot has changed, and ``knowledge`` has its new count. ``explorer``: its
        index in ``explorers``."""


@runtime_checkable
class JudgesMap(Protocol):
    """A task that says whose map is judged."""

    def judged(self) -> int | None:
        """The robot's index in ``explorers``; None: the one that knows most."""


@runtime_checkable
class TakesActions(Protocol):
    """A task in which robots do more than drive."""

    def on_act(self, context: TaskContext, host: str, content: object) -> None:
        """The strategy of ``host`` does something (``StrategyContext.act``). Raises ``ModelError``
        for what cannot be done in this task."""


@runtime_checkable
class Measures(Protocol):
    """A task with quantities of its own for samples and for ``stop.when``, whose names are in
    ``TaskTraits.quantities``."""

    def measure(self) -> Mapping[str, float]:
        """Their present values, all of them."""
