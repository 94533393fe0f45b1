"""A dispatcher: a host without a body gives orders to robots, which carry them out."""

import math
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.optimize import linear_sum_assignment

from desim import ports
from desim.ports.delivery import AskOrders, Delivery, TransportOrder
from desim.robot.coordination.assignment import NO_WAY_M, finite_costs_m
from desim.robot.coordination.order_desk import MOST_ORDERS, OrderDesk, OrderDeskParams, Report
from desim.robot.coordination.porter import Porter
from desim.units import NS_PER_S

_STEP_NS = NS_PER_S // 2  # in which a robot looks whether it has arrived


class Dispatcher:
    """Robots carry out the orders that a host without a body gives them, over the network.

    The same class runs on the robots and on that host. Every ``period`` a robot reports, and the
    host sends all robots their orders. ``hungarian`` gives waiting orders to robots without one, so
    that the total way to the picks is least (Kuhn 1955). ``insertion`` puts each order where it
    makes the ways of some robot least longer, as its next but one at most (cheapest insertion:
    Rosenkrantz, Stearns, Lewis 1977). Failsafe: a robot that hears nothing carries out the orders
    that it has; those of a robot that is silent for ``failsafe_after`` go to others, unless it has
    reported the load. If both come to the pick, the second finds the load gone.
    """

    class Params(OrderDeskParams):
        assignment: Literal["hungarian", "insertion"] = Field("hungarian", description=(
            "how the host solves it"))

    traits = ports.StrategyTraits(needs=Delivery, needs_coordinator=True)

    def __init__(self, params: Params) -> None:
        self._params, self._desk, self._porter = params, OrderDesk(params), Porter()
        self._ways_m: np.ndarray | None = None  # at the host, from station to station

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            host.advertise("report")
            host.subscribe("orders", self._on_orders)
            host.every(self._params.period_ns, self._report)
            host.every(_STEP_NS, self._porter.step)
        else:
            host.advertise("orders")
            host.subscribe("report", self._on_report)
            host.every(self._params.period_ns, self._assign)
            host.act(AskOrders())

    def on_task(self, host: ports.StrategyContext, content: object) -> None:
        if isinstance(content, TransportOrder):
            self._desk.add(content)
        else:
            self._porter.notified(host, content)
            self._report(host)

    # -------------------------------------------------------------------------------- a robot

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        """The porter drives by itself."""
        return None

    def _report(self, robot: ports.StrategyContext) -> None:
        if robot.pose is not None:
            robot.publish("report", Report.of(robot, self._porter))

    def _on_orders(self, robot: ports.StrategyContext, lists: ports.StrategyMessage) -> None:
        self._porter.take(TransportOrder(*one) for one in lists.content.get(robot.name, ()))
        self._porter.step(robot)

    # --------------------------------------------------------------------------------- the host

    def _on_report(self, host: ports.StrategyContext, report: ports.StrategyMessage) -> None:
        self._desk.heard(report.source, Report(report.content), host.now_ns)

    def _assign(self, host: ports.StrategyContext) -> None:
        desk = self._desk
        desk.expire(host.now_ns)
        if desk.waiting():
            (self._hungarian if self._params.assignment == "hungarian" else self._insert)(host)
        host.show("stations", desk.marks(host.task.stations))
        host.publish("orders", desk.lists())

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
