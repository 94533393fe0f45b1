"""Delivery: loads are to be carried from station to station, as orders for them arrive."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError, ModelError
from desim.monitor.delivery.batteries import Batteries
from desim.monitor.delivery.carrying import CarryingRobot
from desim.monitor.delivery.orders import (
    Arrival,
    OrderRecord,
    from_file,
    listed,
    poisson,
)
from desim.monitor.delivery.stations import ServiceQueue, Visit
from desim.monitor.places import free_cells, trouble_at
from desim.monitor.times import mean_s, worst_s
from desim.ports.delivery import (
    AskLoad,
    AskOrders,
    Carries,
    Delivery,
    Serve,
    Served,
    ServiceEnd,
    Station,
    TransportOrder,
)
from desim.ports.tasks import TaskContext, TaskTraits
from desim.units import LENGTH, NS_PER_S, Duration, Length, Period, Position


class StationParams(ports.Params):
    """A station."""

    kind: Literal["pick", "drop", "charge"] = Field(description=(
        "robots take loads there, leave them, or charge"))
    at_m: tuple[Position, Position] = Field(description="x, y")
    service_ns: Duration = Field("10 s", description=(
        "time for one robot; charge: for a battery that is empty, else in proportion (an example)"))


class Deliveries:
    """Carry loads from where they are picked to where they are dropped. A robot has room for one; a
    station serves one robot at a time, in the order in which they ask."""

    class Params(ports.Params):
        stations: dict[str, StationParams] = Field(min_length=2, description=(
            "name to station; at least one pick and one drop"))
        times: Literal["fixed", "exponential"] = Field("fixed", description=(
            "of services at picks and drops, which have the mean service"))
        every_ns: Period | None = Field(None, description=(
            "mean time between orders, which arrive at random (Poisson), from any pick to any drop "
            "alike"))
        orders: tuple[tuple[Duration, str, str], ...] = Field((), description=(
            "time, pick and drop of each, in place of every; done when all are delivered"))
        file: ports.File | None = Field(None, description=(
            "a CSV of orders with the columns time, pick and drop, likewise"))
        due_ns: Duration = Field("5 min", description=(
            "time from the arrival of an order after which it is late (an example)"))
        reach_m: Length = Field("2.5 m", gt=0, description=(
            "a robot that is so near to a station can be served and waits for its turn"))

    leads = ("orders_per_hour", "orders_done", "time_in_system_s")
    traits = TaskTraits(gives=Delivery, quantities=("orders_done", "orders_open"))

    def __init__(self, params: Params) -> None:
        self._params = params
        self._orders: list[OrderRecord] = []
        self._all_arrived, self._done = False, 0

    def start(self, context: TaskContext) -> None:
        self._context, params = context, self._params
        stations = tuple(Station(name, one.kind, ports.Place(*one.at_m))
                         for name, one in params.stations.items())
        self._briefing = Delivery(stations, params.reach_m)
        _check_places(context, stations)
        self._arrivals = self._all_arrivals()
        self._carriers = {name: CarryingRobot() for name in context.explorers}
        self._batteries = Batteries(context)
        self._queues = {one.name: ServiceQueue(one, self._lasts_ns, self._objection, self._ended)
                          for one in stations}
        self._draws = {one.name: context.stream("service", one.name) for one in stations}
        self._arriving = next(self._arrivals, None)
        self._await_next()

    def briefing(self) -> Delivery:
        return self._briefing

    def gives_map(self) -> bool:
        """Robots of a warehouse know it."""
        return True

    # ------------------------------------------------------------------------ orders that arrive

    def _all_arrivals(self) -> Iterator[Arrival]:
        params, kinds = self._params, self._params.stations.items()
        picks, drops = ([name for name, one in kinds if one.kind == kind]
                        for kind in ("pick", "drop"))
        if not picks or not drops:
            raise InputError(f".stations: there is no {'drop' if picks else 'pick'}; allowed: at "
                             "least one pick and one drop")
        if (params.every_ns is not None) + bool(params.orders) + (params.file is not None) != 1:
            raise InputError(".every: orders arrive by one of every, orders and file; give one of "
                             "them")
        if params.every_ns is not None:
            return poisson(picks, drops, params.every_ns, self._context.stream("orders"))
        return iter(from_file(params.file, picks, drops) if params.file
                    else listed(params.orders, picks, drops))

    def _await_next(self) -> None:
        """Wait for the next order."""
        if self._arriving is None:
            self._all_arrived = True
        else:
            self._context.after(self._arriving[0] - self._context.now_ns, self._arrive_all)

    def _arrive_all(self, context: TaskContext) -> None:
        """All orders of this instant arrive."""
        while self._arriving is not None and self._arriving[0] <= context.now_ns:
            self._arrive(*self._arriving[1:])
            self._arriving = next(self._arrivals, None)
        self._await_next()

    def _arrive(self, pick: str, drop: str) -> None:
        context, order = self._context, TransportOrder(len(self._orders), pick, drop)
        self._orders.append(OrderRecord(order, context.now_ns))
        context.record("order", None, order.number)
        for host in context.desks or context.explorers:
            context.notify(host, order)

    # ------------------------------------------------------------------------------ at a station

    def on_act(self, context: TaskContext, host: str, content: object) -> None:
        if isinstance(content, AskOrders):
            for entry in self._orders:
                if not entry.is_picked:
                    context.notify(host, entry.order)
        elif isinstance(content, AskLoad) and host in self._carriers:
            load = self._carriers[host].load
            if load is not None:
                context.notify(host, Carries(load))
        elif isinstance(content, Serve) and content.station in self._queues \
                and host in self._carriers:
            station = self._briefing.at(content.station)
            if station.kind == "pick":
                self._carriers[host].begin(context.now_ns)
            self._queues[station.name].join(
                context, Visit(host, station, content.order, context.now_ns))
        else:
            raise ModelError(f"{host} cannot do {content!r}; allowed: Serve at a station and "
                             "AskLoad, by robots, and AskOrders")

    def _objection(self, visit: Visit) -> ServiceEnd | None:
        context, load = self._context, self._carriers[visit.robot].load
        x_m, y_m, _ = context.poses()[context.robots.index(visit.robot)].tolist()
        if math.dist((x_m, y_m), visit.station.place) > self._params.reach_m:
            return ServiceEnd.AWAY
        if visit.station.kind == "pick":
            if load is not None:
                return ServiceEnd.LOADED
            return None if self._waits(visit.order, visit.station.name) else ServiceEnd.GONE
        if visit.station.kind == "drop" and (load is None or load.drop != visit.station.name):
            return ServiceEnd.EMPTY
        return None

    def _waits(self, number: int | None, pick: str) -> bool:
        """Whether the load of this order waits at ``pick``."""
        if number is None or not 0 <= number < len(self._orders):
            return False
        return not self._orders[number].is_picked and self._orders[number].order.pick == pick

    def _lasts_ns(self, visit: Visit) -> int:
        mean_ns = self._params.stations[visit.station.name].service_ns
        if visit.station.kind == "charge":
            return round(mean_ns * (1.0 - self._batteries.share(self._context, visit.robot)))
        if self._params.times == "fixed":
            return mean_ns
        return round(self._draws[visit.station.name].exponential(mean_ns))

    def _ended(self, visit: Visit, outcome: ServiceEnd) -> None:
        context, carrier = self._context, self._carriers[visit.robot]
        travelled_m = float(context.travelled_m()[context.robots.index(visit.robot)])
        order = carrier.load.number if carrier.load else visit.order
        if outcome is ServiceEnd.DONE:
            {"pick": self._picked, "drop": self._dropped, "charge": self._charged}[
                visit.station.kind](visit, carrier, travelled_m)
        elif outcome is ServiceEnd.GONE:
            carrier.wasted += 1
            context.record("order_gone", visit.robot, order or 0)
        if carrier.load is None:
            carrier.end(context.now_ns)
        context.notify(visit.robot, Served(visit.station.name, order, outcome))

    def _picked(self, visit: Visit, carrier: CarryingRobot, travelled_m: float) -> None:
        assert visit.order is not None
        entry = self._orders[visit.order]
        entry.is_picked = True
        carrier.take(entry.order, travelled_m)
        self._context.record("order_picked", visit.robot, visit.order)

    def _dropped(self, visit: Visit, carrier: CarryingRobot, travelled_m: float) -> None:
        assert carrier.load is not None
        entry, now_ns = self._orders[carrier.load.number], self._context.now_ns
        entry.done_ns = now_ns
        self._done += 1
        carrier.leave(travelled_m)
        self._context.record("order_done", visit.robot, entry.order.number,
                             now_ns - entry.arrived_ns)
        if self._all_arrived and self._done == len(self._orders):
            self._context.end("delivered")

    def _charged(self, visit: Visit, carrier: CarryingRobot, travelled_m: float) -> None:
        self._batteries.fill(self._context, visit.robot)
        self._context.record("charged", visit.robot)

    # ---------------------------------------------------------------------------------- results

    def measure(self) -> dict[str, float]:
        return {"orders_done": self._done, "orders_open": len(self._orders) - self._done}

    def metrics(self) -> dict[str, object]:
        context, carriers = self._context, self._carriers
        now_ns = max(context.now_ns, 1)
        ways = dict(zip(context.robots, context.travelled_m().tolist(), strict=True))
        loaded_m = {name: one.way_m(ways[name]) for name, one in carriers.items()}
        in_system_ns = [entry.done_ns - entry.arrived_ns for entry in self._orders
                        if entry.done_ns is not None]
        late_ns = [max(0, time_ns - self._params.due_ns) for time_ns in in_system_ns]
        return {
            "orders": len(self._orders), "orders_done": len(in_system_ns),
            "orders_picked": sum(one.load is not None for one in carriers.values()),
            "orders_waiting": sum(not entry.is_picked for entry in self._orders),
            "orders_per_hour": len(in_system_ns) * 3600 * NS_PER_S / now_ns,
            "time_in_system_s": mean_s(in_system_ns),
            "time_in_system_worst_s": worst_s(in_system_ns),
            "orders_late": sum(time_ns > 0 for time_ns in late_ns), "lateness_s": mean_s(late_ns),
            "loaded_m": math.fsum(loaded_m.values()),
            "empty_m": math.fsum(ways[name] - loaded_m[name] for name in carriers),
            "utilization": math.fsum(one.busy_until_ns(now_ns) for one in carriers.values())
            / now_ns / max(len(carriers), 1),
            "wasted_picks": sum(one.wasted for one in carriers.values()),
            "batteries_empty": self._batteries.empty,
            "station_utilization": {name: one.busy_until_ns(now_ns) / now_ns
                                    for name, one in self._queues.items()},
            "station_wait_s": {name: one.waited_ns / one.begun / NS_PER_S if one.begun else None
                               for name, one in self._queues.items()},
            "orders_by_robot": {name: one.delivered for name, one in carriers.items()}}


def _check_places(context: TaskContext, stations: tuple[Station, ...]) -> None:
    """Raises ``InputError`` for stations in walls, and for those to which no robot gets."""
    grid = context.ground.grid
    robots = [context.robots.index(name) for name in context.explorers]
    cells_m = free_cells(context.ground, context.poses()[robots, :2], context.radius_m)
    for station in stations:
        x_m, y_m = station.place
        at = f".stations.{station.name}.at: {LENGTH.format(x_m)}, {LENGTH.format(y_m)} is"
        trouble = trouble_at(context.ground, x_m, y_m)
        if trouble:
            raise InputError(f"{at} {trouble}")
        if not (np.hypot(*(cells_m - (x_m, y_m)).T) <= 2 * grid.resolution_m).any():
            raise InputError(f"{at} where no robot gets: no way of {2 * context.radius_m:.2f} m "
                             "leads there from where they start")
