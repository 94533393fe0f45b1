"""A dispatcher: a host without a body gives orders to robots, which carry them out."""

import math
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.optimize import linear_sum_assignment

from desim import ports
from desim.ports.delivery import TransportOrder
from desim.robot.coordination.assignment import NO_WAY_M, finite_costs_m
from desim.robot.coordination.orders.desk import MOST_ORDERS, OrderDeskParams
from desim.robot.coordination.orders.order_strategy import OrderStrategy


class Dispatcher(OrderStrategy):
    """Robots carry out the orders that a host without a body gives them, over the network.

    The same class runs on the robots and on that host. Every ``period`` a robot reports, and the
    host sends all robots their orders. ``hungarian`` gives waiting orders to robots without one, so
    that the total way to the picks is least (Kuhn 1955). ``insertion`` puts each order where
    it lengthens some robot's route least; a robot has two orders at most (cheapest insertion:
    Rosenkrantz, Stearns, Lewis 1977). Failsafe: a robot that hears nothing carries out the orders
    that it has; those of a robot that is silent for ``failsafe_after`` go to others, unless it has
    reported the load. If both come to the pick, the second finds the load gone.
    """

    class Params(OrderDeskParams):
        assignment: Literal["hungarian", "insertion"] = Field("hungarian", description=(
            "how the host solves it"))

    def __init__(self, params: Params) -> None:
        super().__init__(params)
        self._assignment = params.assignment
        self._ways_m: np.ndarray | None = None  # at the host, from station to station

    def _assign(self, host: ports.StrategyContext) -> None:
        if self._desk.waiting():
            (self._hungarian if self._assignment == "hungarian" else self._insert)(host)

    def _hungarian(self, host: ports.StrategyContext) -> None:
        desk, idle = self._desk, self._desk.free(1)
        orders = desk.waiting()[:len(idle)]  # the oldest: none waits for ever
        if not orders:
            return
        picks = [host.task.at(order.pick).place for order in orders]
        costs_m = finite_costs_m([host.path_lengths_m(picks, desk.reports[name].at)
                                  for name in idle])
        for robot, order in zip(*linear_sum_assignment(costs_m), strict=True):
            if costs_m[robot, order] < NO_WAY_M:
                desk.assign(idle[robot], orders[order].number)

    def _insert(self, host: ports.StrategyContext) -> None:
        desk, stations = self._desk, host.task.stations
        places = [one.place for one in stations]
        if self._ways_m is None or not np.isfinite(self._ways_m).all():
            self._ways_m = np.array([host.path_lengths_m(places, place) for place in places])
        index = {one.name: k for k, one in enumerate(stations)}
        first_m = {name: host.path_lengths_m(places, desk.reports[name].at)
                   for name in desk.free(MOST_ORDERS)}
        for order in desk.waiting():
            options = [(self._added_m(name, place, order, index, first_m[name]), i, place, name)
                       for i, name in enumerate(desk.free(MOST_ORDERS))
                       for place in self._places_in(name)]
            if not options or min(options)[0] == math.inf:
                return
            _, _, place, name = min(options)
            desk.assign(name, order.number, place)

    def _places_in(self, name: str) -> range:
        """The places of a new order among a robot's: not before the load that it has."""
        own = self._desk.assigned.get(name, [])
        has_load = bool(own) and own[0] == self._desk.reports[name].loaded
        return range(int(has_load), len(own) + 1)

    def _added_m(self, name: str, place: int, order: TransportOrder, index: dict[str, int],
                 first_m: np.ndarray) -> float:
        """By how much ``order`` at this ``place`` makes the robot's ways longer."""
        assert self._ways_m is not None
        desk, ways_m = self._desk, self._ways_m
        own = [desk.open[number] for number in desk.assigned.get(name, ())]
        before_m = ways_m[index[own[place - 1].drop]] if place else first_m
        pick, drop = index[order.pick], index[order.drop]
        added_m = before_m[pick] + ways_m[pick, drop]
        if place < len(own):
            then = index[own[place].pick]
            added_m += ways_m[drop, then] - before_m[then]
        return float(added_m)
