"""The contract of local planners: from a path, and what is around the robot, to its next velocity.

A plug-in is asked at ``robot.navigation.control_rate`` while the robot has a path. What it sees is
what the robot knows: its pose, the path of the global planner, what its lasers see, and poses that
teammates have sent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from desim.ports import parameters
from desim.ports.traits import Traits


class MotionLimits(NamedTuple):
    """The limits of the base; ``period_s``: the time between two commands."""

    speed_mps: float
    turn_radps: float
    acceleration_mps2: float
    turn_acceleration_radps2: float
    period_s: float


class BodyShape(NamedTuple):
    """The body: the circle around it, the largest circle in it, and its corners, x ahead and y to
    the left; a disc has none."""

    radius_m: float
    inscribed_m: float
    corners_m: tuple[tuple[float, float], ...] = ()


class Inflation(NamedTuple):
    """Costs around obstacles, as costmap_2d has them (``robot.navigation``): up to ``radius_m``,
    252 exp(-scaling (distance - inscribed radius))."""

    radius_m: float
    scaling: float


class NearbyBody(NamedTuple):
    """A body that moves, as the robot knows it now: place and velocity on the map,
    extrapolated. ``name``: of a teammate whose messages told it; empty if only lasers did."""

    name: str
    x_m: float
    y_m: float
    x_mps: float
    y_mps: float
    radius_m: float


class LocalArrays(NamedTuple):
    """The costmaps as compiled loops read them, not to be changed.

    ``setup`` one record: the body, and what ``robot.navigation`` says of rollouts | ``cover``
    [k, 3] points of a polygon's footprint | ``near2`` [n, n] float32 squared distances in m^2 from
    the centre of each cell to the nearest point seen (x ahead, y left, row by y, the robot in the
    middle as of the last scan) | ``layer`` one record: what has the right of way | ``scan`` one
    record with that scan's pose: ``x_m``, ``y_m``, ``yaw_rad`` | ``flat`` and ``frame``: the costs
    of the whole map, 255 unknown, 254 an obstacle, 253 within the inscribed radius of one, and
    where they lie
    """

    setup: np.ndarray
    cover: np.ndarray
    near2: np.ndarray
    layer: np.ndarray
    scan: np.ndarray
    flat: np.ndarray
    frame: np.ndarray


class LocalContext(Protocol):
    """The knowledge of a plug-in's robot."""

    @property
    def name(self) -> str:
        """The robot's name."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def limits(self) -> MotionLimits:
        """The limits of the base."""

    @property
    def shape(self) -> BodyShape:
        """The body."""

    @property
    def inflation(self) -> Inflation:
        """Costs around obstacles."""

    @property
    def cell_m(self) -> float:
        """The width of a cell of the local costmap."""

    @property
    def goal_tolerance_m(self) -> float:
        """The distance at which the goal counts as reached; the robot is not asked any more."""

    @property
    def position(self) -> tuple[float, float, float]:
        """x m, y m, yaw rad on the map, now."""

    @property
    def speed_mps(self) -> float:
        """The forward speed, as far as the motors follow the last commands."""

    @property
    def turn_radps(self) -> float:
        """The turn rate, likewise."""

    @property
    def path(self) -> np.ndarray:
        """[n, 2] m: the way points, the goal last."""

    @property
    def arrays(self) -> LocalArrays:
        """The costmaps for compiled loops; the same arrays for the whole run."""

    def rest(self) -> np.ndarray:
        """[k, 2] m, k at least 2: the path from its point nearest to the robot to its end."""

    def carrot(self, ahead_m: float) -> tuple[float, float]:
        """The point of the path so far ahead, or nearer, if the map has obstacles on the line to
        it."""

    def points(self) -> np.ndarray:
        """[k, 2] m, on the map, of what the lasers saw last."""

    def clearances_m(self, poses: np.ndarray) -> np.ndarray:
        """[k] m from the body to what was seen last, if the robot were at ``poses`` [k, 3] on the
        map; below 0 within, and at least the inflation radius where nothing is near."""

    def neighbours(self) -> Sequence[NearbyBody]:
        """Bodies that move nearby, teammates too; none without ``follows_neighbours``."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this robot's own."""

    def worked(self, **quantities: int) -> None:
        """Add to the work of the present callback, by the names of ``ports.computers.QUANTITIES``:
        where computers get busy, how long it takes depends on that."""


@dataclass(frozen=True, kw_only=True)
class LocalPlannerTraits(Traits):
    """The traits of a local planner.

    ``follows_neighbours``: moving bodies in the laser's view are followed, and robots announce
    their poses to the team every second, unless ``coordination.team_state`` says otherwise.
    """

    follows_neighbours: bool = False


class LocalPlanner(Protocol):
    """Finds the next velocity. Built as ``LocalPlanner(params)``, one for each life of a robot.

    Its class may declare ``traits``, a ``LocalPlannerTraits``.
    """

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def start(self, context: LocalContext) -> None:
        """The robot has started; there is no path yet."""

    def on_path(self, context: LocalContext) -> None:
        """There is another path, ``context.path``."""

    def steer(self, context: LocalContext) -> tuple[float, float, float, bool]:
        """The forward speed in m/s and the turn rate in rad/s to have next, the length in m of the
        rest of the path, and whether no velocity is clear (recoveries depend on these two)."""
