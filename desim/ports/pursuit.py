"""Pursuit: what robots that chase, and robots that flee, are told.

No network carries it: it is what a robot sees. Pursuers tell each other over the network.
"""

from __future__ import annotations

from typing import NamedTuple

from desim.ports.strategies import Place


class Pursuit(NamedTuple):
    """A briefing: the names of those that flee. Robots see each other within ``sees_m`` if no wall
    is between; one that a pursuer sees within ``reach_m`` is caught."""

    evaders: tuple[str, ...]
    sees_m: float
    reach_m: float


class RobotSeen(NamedTuple):
    """Told to a pursuer of an evader and the other way round, twice a second: it is there."""

    name: str
    place: Place


class Caught(NamedTuple):
    """Told to all robots: this evader is caught, and stands."""

    name: str
