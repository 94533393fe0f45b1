"""The contract of a world: matter, and what sensors see of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

from desim.ports.networks import Obstacles

BodyType: TypeAlias = Any  # a desim.scenario.schema.fleet.BodyType


class Snapshot(NamedTuple):
    """The matter at one instant, immutable. Sensor readings are computed from it on demand.

    ``poses`` [robots, 3] x m, y m, yaw rad (read-only) | ``geometry`` is opaque to all but the
    world that made it.
    """

    time_ns: int
    poses: np.ndarray
    geometry: Any


class RandomStreams(Protocol):
    """Random numbers by name, from a run's seed."""

    def __call__(self, *name: str | int) -> np.random.Generator:
        """The generator of this name, always the same one."""

    def key(self, *name: str | int) -> int:
        """A key below 2**64 for noise by counter (``desim.ports.kernels``)."""


class World(Protocol):
    """Matter: terrain, bodies, sensors, collisions. Robots are indices in sorted-name order."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Their names."""

    @classmethod
    def build(cls, scenario: Any, streams: RandomStreams) -> World:
        """The world at time 0 of a complete ``desim.scenario.schema.scenario.Scenario`` whose paths
        are absolute. Random numbers come from ``streams``. Raises ``InputError`` whose lines begin
        with the path of what is wrong, e.g. ``fleet.start: it stands in a wall``."""

    def advance(self, to_ns: int) -> None:
        """Move everything to ``to_ns``: one kernel call for the whole fleet."""

    def body(self, robot: int) -> BodyType:
        """The robot's type."""

    def grid(self, resolution_m: float) -> GridSpec:
        """The raster for maps of this terrain."""

    def ground(self, spec: GridSpec, robots: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """The truth that maps are judged by, two arrays [height, width]: uint8, 0 where a cell is
        free; bool, the free cells that lasers can come to see from where ``robots`` stand."""

    def travelled_m(self) -> np.ndarray:
        """[robots] m, the true length of the way that each has gone."""

    def command(self, robot: int, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        """Set the target velocity of ``robot``; its motors get it there."""

    def snapshot(self) -> Snapshot:
        """The present state; the same object until ``advance`` is called."""

    def snapshot_at(self, time_ns: int) -> Snapshot:
        """The state at ``time_ns``, at most a tick ahead, with poses carried on from the last
        tick."""

    def scan(self, snapshot: Snapshot, robots: np.ndarray, tick: int, laser: int = 0
             ) -> np.ndarray:
        """[len(robots), beams] float32 ranges in m of laser number ``laser`` of each of ``robots``,
        with noise number ``tick``; these lasers are all of one kind. The transducers of a sonar
        count as lasers, after the others."""

    def odometry(self, snapshot: Snapshot, robot: int, tick: int) -> np.ndarray:
        """[3] x m, y m, yaw rad as this robot's odometry reports reading number ``tick``."""

    def contacts(self) -> list[tuple[int, int]]:
        """Collision episodes that began since the last call: (robot, other robot or -1 for wall),
        sorted."""

    def obstacles(self) -> Obstacles:
        """The terrain as the network sees it, at the present epoch."""


@runtime_checkable
class MovesObstacles(Protocol):
    """A world with obstacles that move and are no robots. Replays show them."""

    def moving_obstacles(self) -> np.ndarray:
        """[obstacles, 3] x m, y m, radius m now, always in the same order; a new array after each
        move."""


@runtime_checkable
class HasDoubts(Protocol):
    """A world that was made from files that may mean something else than they say."""

    def doubts(self) -> tuple[str, ...]:
        """Sentences on what is likely to be wrong with them, which name the file. Runs show them
        among their warnings."""


class GridSpec(NamedTuple):
    """The raster that the fleet's maps and the ground truth share.

    Cell (col, row) covers [x_m + col * resolution_m, ... + resolution_m) in x, and row likewise in
    y: (x_m, y_m) is the lower left corner of cell (0, 0). Arrays over it are [height, width].
    """

    resolution_m: float
    width: int
    height: int
    x_m: float
    y_m: float

    @property
    def cells(self) -> int:
        """The number of cells."""
        return self.width * self.height

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """(col, row) of the cell that holds the point; it may lie outside the raster."""
        return (math.floor((x_m - self.x_m) / self.resolution_m),
                math.floor((y_m - self.y_m) / self.resolution_m))

    def bounds(self) -> tuple[float, float, float, float]:
        """x0, y0, x1, y1 in m of the whole raster."""
        return (self.x_m, self.y_m, self.x_m + self.width * self.resolution_m,
                self.y_m + self.height * self.resolution_m)
