"""Delivery: what a fleet that carries loads is told, and what its robots say at stations.

All of it goes from hand to hand (``StrategyContext.act``, ``FollowsTask.on_task``): a robot at a
station, or a host at which orders arrive. Over the network strategies tell each other.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Literal, NamedTuple

from desim.ports.strategies import Place


class Station(NamedTuple):
    """A place where robots take a load (``pick``), leave it (``drop``), or charge."""

    name: str
    kind: Literal["pick", "drop", "charge"]
    place: Place


class Delivery(NamedTuple):
    """A briefing: the stations. A robot whose centre is within ``reach_m`` of one can be served."""

    stations: tuple[Station, ...]
    reach_m: float

    def at(self, name: str) -> Station:
        """The station of this name."""
        return next(station for station in self.stations if station.name == name)


class TransportOrder(NamedTuple):
    """A load that is to be carried from station ``pick`` to ``drop``. Told to hosts without a body
    that run a strategy, or to all robots where there is none, at the time at which it arrives."""

    number: int
    pick: str
    drop: str


class Carries(NamedTuple):
    """Told to a robot that asks: the order whose load it carries."""

    order: TransportOrder


class AskLoad(NamedTuple):
    """An action: a robot that has started asks what it carries, which its program forgot if it had
    one. Without a load it is told nothing."""


class Serve(NamedTuple):
    """A robot's action: it wants to be served at ``station``, and waits there for its turn; at a
    pick it names the ``order`` whose load it comes for."""

    station: str
    order: int | None = None


class AskOrders(NamedTuple):
    """An action: the host asks for all orders whose loads wait, as after a start."""


class ServiceEnd(StrEnum):
    """The end of a service. ``gone``: the load is not there (any more); ``loaded``: the robot has a
    load already; ``empty``: it has none for this station; ``away``: it was not within reach when
    its turn came, or at the end of the service."""

    DONE = "done"
    GONE = "gone"
    LOADED = "loaded"
    EMPTY = "empty"
    AWAY = "away"


class Served(NamedTuple):
    """Told to a robot: its turn at ``station`` is over. ``order``: the one that it now carries, or
    that was done."""

    station: str
    order: int | None
    outcome: ServiceEnd


class Charge(NamedTuple):
    """Told to a robot: so much of its battery is left, 0 to 1."""

    share: float
