"""Search: what a fleet that looks for victims is told, and what its robots and its base say.

All of it goes from hand to hand (``StrategyContext.act``, ``FollowsTask.on_task``). Robots have to
report over the network.
"""

from __future__ import annotations

from typing import NamedTuple

from desim.ports.strategies import Place


class VictimSearch(NamedTuple):
    """A briefing: a robot sees a victim within ``sees_m`` if no wall is between. Nobody knows how
    many there are."""

    sees_m: float


class Victim(NamedTuple):
    """Told to a robot, once: it sees this victim."""

    number: int
    place: Place


class KnowVictim(NamedTuple):
    """An action of a host without a body: it knows of the victim now."""

    number: int
