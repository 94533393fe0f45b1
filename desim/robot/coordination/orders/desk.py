"""The book of a host that gives orders to robots, and what both sides say about it.

Messages carry states, not changes: each report of a robot and each list of orders holds all that
counts, so that one that is lost is made good by the next.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from pydantic import Field

from desim import ports
from desim.ports.delivery import Station, TransportOrder
from desim.robot.coordination.orders.porter import Porter
from desim.units import Duration, Period

MOST_ORDERS = 2  # of a robot: the present one, and the next


class OrderDeskParams(ports.Params):
    """The parameters of all strategies that give orders over the network."""

    period_ns: Period = Field("1 s", description="of reports and lists (as the team's state)")
    failsafe_after_ns: Duration = Field("15 s", description=(
        "without a report of a robot: its orders whose loads it has not reported go to others (15 "
        "periods)"))


class Report:
    """A robot's report of itself: ``at``, x and y in m; ``loaded``, the order whose load it has;
    ``ended``, its last orders that were done or gone; ``is_charging``."""

    def __init__(self, content: Mapping[str, object]) -> None:
        at, ended = content["at"], content["ended"]
        assert isinstance(at, list) and isinstance(ended, list)
        self.at, self.ended = ports.Place(*at), ended
        self.loaded, self.is_charging = content["loaded"], bool(content["charging"])

    @staticmethod
    def of(robot: ports.StrategyContext, porter: Porter) -> dict[str, object]:
        """The content of a report."""
        assert robot.pose is not None
        return {"at": [round(value, 2) for value in robot.pose[:2]], "loaded": porter.loaded,
                "ended": porter.ended, "charging": porter.is_charging}


class OrderDesk:
    """The orders that are open, and who has which. ``assigned``: by robot, in the order in which it
    shall carry them out."""

    def __init__(self, params: OrderDeskParams) -> None:
        self._params = params
        self.open: dict[int, TransportOrder] = {}
        self.assigned: dict[str, list[int]] = {}
        self.reports: dict[str, Report] = {}
        self._heard_ns: dict[str, int] = {}
        self._loaded: dict[int, str] = {}  # by order, who has its load

    def add(self, order: TransportOrder) -> None:
        """An order has arrived."""
        self.open[order.number] = order

    def heard(self, name: str, report: Report, now_ns: int) -> None:
        """A robot has reported."""
        self.reports[name], self._heard_ns[name] = report, now_ns
        if isinstance(report.loaded, int):
            self._loaded[report.loaded] = name
        for number in report.ended:
            self._close(number)

    def expire(self, now_ns: int) -> None:
        """Robots that are silent keep only the orders whose loads they have."""
        for name, heard_ns in self._heard_ns.items():
            if now_ns - heard_ns >= self._params.failsafe_after_ns and name in self.reports:
                del self.reports[name]
                self.assigned[name] = [number for number in self.assigned.get(name, ())
                                       if self._loaded.get(number) == name]

    def waiting(self) -> list[TransportOrder]:
        """The open orders that nobody has, the oldest first."""
        taken = {number for own in self.assigned.values() for number in own} | set(self._loaded)
        return [order for number, order in sorted(self.open.items()) if number not in taken]

    def free(self, most: int) -> list[str]:
        """The robots that report, do not charge, and have fewer than ``most`` orders."""
        return sorted((name for name, report in self.reports.items() if not report.is_charging
                       and len(self.assigned.get(name, ())) < most), key=ports.natural_key)

    def assign(self, name: str, number: int, place: int | None = None) -> None:
        """Give an order to a robot, last or at a ``place`` among its orders."""
        own = self.assigned.setdefault(name, [])
        own.insert(len(own) if place is None else place, number)

    def lists(self) -> dict[str, list[list[object]]]:
        """The content of the message to robots: for each, its orders."""
        return {name: [list(self.open[number]) for number in own]
                for name, own in self.assigned.items()}

    def marks(self, stations: Iterable[Station]) -> Iterable[ports.Mark]:
        """For the replay: at each pick, how many loads wait."""
        for one in stations:
            count = sum(order.pick == one.name for order in self.waiting())
            yield ports.Mark(*one.place, f"{one.name}: {count}" if count else one.name)

    def _close(self, number: int) -> None:
        self.open.pop(number, None)
        self._loaded.pop(number, None)
        for own in self.assigned.values():
            if number in own:
                own.remove(number)


def way_m(robot: ports.StrategyContext, places: Iterable[ports.Place]) -> float:
    """The length of the robot's way through ``places``, inf where there is none."""
    total_m, at = 0.0, None
    for place in places:
        total_m += float(robot.path_lengths_m([place], at)[0])
        at = place
        if math.isinf(total_m):
            break
    return total_m
