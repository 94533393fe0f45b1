"""The contract of bodies: how robots move, and what they touch, by another simulator of physics."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from desim.ports.networks import Obstacles
from desim.ports.worlds import BodyType


class Arena(NamedTuple):
    """A fleet at its start, and what stands around it.

    ``robots``: names in natural order, which gives the indices of all arrays | ``types``: of their
    bodies | ``poses`` [n, 3] x m, y m, yaw rad |
    ``obstacles``: walls and closed doors, with their thickness and height | ``tick_s``: the time
    between two calls of ``advance``.
    """

    robots: tuple[str, ...]
    types: tuple[BodyType, ...]
    poses: np.ndarray
    obstacles: Obstacles
    tick_s: float


class Bodies(Protocol):
    """The bodies of a fleet on the plane. desim keeps sensors, maps and networks. Named in
    ``physics.model`` instead of a world, and constructed without arguments.

    ``poses`` [n, 3] x m, y m, yaw rad | ``velocities`` [n, 3] forward, left m/s, turn rad/s |
    ``travelled_m`` [n] the length of the way that each has gone. They are those of the last tick.
    """

    poses: np.ndarray
    velocities: np.ndarray
    travelled_m: np.ndarray

    def start(self, arena: Arena) -> None:
        """Take the fleet, at time 0. Raises ``InputError`` for what cannot be simulated."""

    def command(self, robot: int, velocity: tuple[float, float, float], now_ns: int) -> None:
        """Set the velocity that ``robot`` shall have from the next tick on: forward, left m/s, turn
        rad/s. It accelerates to that; without a new one it stops after
        ``types[robot].command_timeout_ns``."""

    def surround(self, walls: np.ndarray, tops_m: np.ndarray, discs: np.ndarray) -> None:
        """Set what stands around from now on: ``walls`` [w, 4] m (from, to) that are ``tops_m`` [w]
        high, closed doors last, and moving obstacles ``discs`` [d, 3] x m, y m, radius m. Called
        after ``start``, and before each tick where doors or obstacles move."""

    def advance(self, now_ns: int, dt_s: float) -> list[tuple[int, int]]:
        """Make one tick of ``dt_s`` that ends at ``now_ns``. Returns the contacts that began:
        (robot, other robot or -1)."""

    def ahead(self, after_ns: int) -> np.ndarray:
        """[n, 3] the poses ``after_ns`` after the last tick, at most a tick."""
