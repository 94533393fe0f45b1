"""A robot that carries out orders: to the pick, be served, to the drop, be served, and the next."""

from __future__ import annotations

import math
from collections.abc import Iterable

from desim import ports
from desim.ports.delivery import (
    Carries,
    Charge,
    Delivery,
    Serve,
    Served,
    ServiceEnd,
    Station,
    TransportOrder,
)

_NEAR = 0.8  # of the reach, so that a robot that stands there stays within it
_RESERVE = 0.25  # of a battery; below it a robot without a load charges (a way of some minutes)
_REMEMBERED = 20  # orders that were done last


class Porter:
    """The orders of one robot, the present one first. ``step`` makes it drive on, and is called
    again and again; ``notified`` gets what the task says."""

    def __init__(self) -> None:
        self.orders: list[TransportOrder] = []
        self.loaded: int | None = None  # the order whose load it has
        self.ended: list[int] = []  # orders that were done last, or whose load was gone
        self._charge = 1.0
        self._waits = False  # at a station

    def take(self, orders: Iterable[TransportOrder]) -> None:
        """These are the orders from now on, behind the one whose load it has."""
        kept = [order for order in self.orders if order.number == self.loaded]
        self.orders = kept + [order for order in orders
                              if order.number not in (self.loaded, *self.ended)]

    def add(self, orders: Iterable[TransportOrder]) -> None:
        """These orders come last."""
        self.take([*self.orders, *orders])

    @property
    def is_charging(self) -> bool:
        """Whether it drives to a charging station as soon as it has no load."""
        return self._charge < _RESERVE

    def target(self, robot: ports.StrategyContext) -> Station | None:
        """The station that is next."""
        delivery: Delivery = robot.task
        if self.is_charging and self.loaded is None and robot.pose is not None:
            stations = [one for one in delivery.stations if one.kind == "charge"]
            ways_m = robot.path_lengths_m([one.place for one in stations]).tolist()
            if stations and min(ways_m) < math.inf:
                return stations[ways_m.index(min(ways_m))]
        if not self.orders:
            return None
        order = self.orders[0]
        return delivery.at(order.pick if self.loaded is None else order.drop)

    def step(self, robot: ports.StrategyContext) -> None:
        """Drive to the station that is next, or ask to be served there."""
        if robot.pose is None or self._waits:
            return
        station = self.target(robot)
        if station is None:
            return
        if math.dist(robot.pose[:2], station.place) <= _NEAR * robot.task.reach_m:
            self._waits = True
            robot.stop()
            robot.act(Serve(station.name, self.orders[0].number if self.orders else None))
            robot.show("load", ())
        elif robot.goal != station.place and robot.go(station.place):
            load = "" if self.loaded is None else f"load {self.loaded} to "
            robot.show("load", [ports.Mark(*station.place, f"{load}{station.name}")])

    def notified(self, robot: ports.StrategyContext, content: object) -> None:
        """The task says something."""
        if isinstance(content, Charge):
            self._charge = content.share
        elif isinstance(content, Carries):
            self.loaded = content.order.number
            self.orders.insert(0, content.order)
        elif isinstance(content, Served):
            self._waits = False
            self._served(robot.task.at(content.station), content)
            self.step(robot)

    def _served(self, station: Station, served: Served) -> None:
        if station.kind == "pick" and served.outcome in (ServiceEnd.DONE, ServiceEnd.LOADED):
            self.loaded = served.order
            self.orders.sort(key=lambda order: order.number != self.loaded)  # that one first
        elif station.kind == "drop" and served.outcome in (ServiceEnd.DONE, ServiceEnd.EMPTY):
            self.loaded = None
            self._end(served.order)
        elif served.outcome is ServiceEnd.GONE:
            self._end(served.order)

    def _end(self, number: int | None) -> None:
        self.orders = [order for order in self.orders if order.number != number]
        if number is not None:
            self.ended = [*self.ended, number][-_REMEMBERED:]
