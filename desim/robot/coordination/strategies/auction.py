"""An auction of orders over the network: a host calls, robots bid, the host awards."""

import math

from desim import ports
from desim.ports.delivery import AskOrders, Delivery, TransportOrder
from desim.robot.coordination.order_desk import (
    MOST_ORDERS,
    OrderDesk,
    OrderDeskParams,
    Report,
    way_m,
)
from desim.robot.coordination.porter import Porter
from desim.units import NS_PER_S

_STEP_NS = NS_PER_S // 2  # in which a robot looks whether it has arrived
_MOST_CALLED = 10  # orders in one call, the oldest


class Auction:
    """Robots bid for orders with the way that they would drive (contract net: Smith 1980; auctions
    of single items one after another: Koenig et al. 2006).

    The same class runs on the robots and on a host without a body, the auctioneer. Every ``period``
    it calls the orders that nobody has, and awards those of the last call, the cheapest bid first,
    one to a robot. A bid is the way by the robot's own map, through its orders to the pick and on
    to the drop. A robot has two orders at most. Failsafe: a robot that hears nothing carries out
    the orders that it has; those of a robot that is silent for ``failsafe_after`` are called again,
    unless it has reported the load. If both come to the pick, the second finds the load gone.
    """

    class Params(OrderDeskParams):
        """Those of all that give orders over the network."""

    traits = ports.StrategyTraits(needs=Delivery, needs_coordinator=True)

    def __init__(self, params: Params) -> None:
        self._params, self._desk, self._porter = params, OrderDesk(params), Porter()
        self._bids: dict[str, dict[int, float]] = {}  # at the host: by robot and order, m

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            for topic in ("report", "bids"):
                host.advertise(topic)
            host.subscribe("orders", self._on_orders)
            host.subscribe("call", self._on_call)
            host.every(self._params.period_ns, self._report)
            host.every(_STEP_NS, self._porter.step)
        else:
            for topic in ("orders", "call"):
                host.advertise(topic)
            host.subscribe("report", self._on_report)
            host.subscribe("bids", self._on_bids)
            host.every(self._params.period_ns, self._award)
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

    def _on_call(self, robot: ports.StrategyContext, call: ports.StrategyMessage) -> None:
        porter, at = self._porter, robot.task.at
        if robot.pose is None or porter.is_charging or len(porter.orders) >= MOST_ORDERS:
            return
        begun = [at(name).place for order in porter.orders
                 for name in ((order.drop,) if order.number == porter.loaded else
                              (order.pick, order.drop))]
        bids = {}
        for one in call.content:
            order = TransportOrder(*one)
            length_m = way_m(robot, [*begun, at(order.pick).place, at(order.drop).place])
            if length_m < math.inf:
                bids[str(order.number)] = round(length_m, 2)
        robot.publish("bids", bids)

    # --------------------------------------------------------------------------------- the host

    def _on_report(self, host: ports.StrategyContext, report: ports.StrategyMessage) -> None:
        self._desk.heard(report.source, Report(report.content), host.now_ns)

    def _on_bids(self, host: ports.StrategyContext, bids: ports.StrategyMessage) -> None:
        self._bids[bids.source] = {int(number): bid for number, bid in bids.content.items()}

    def _award(self, host: ports.StrategyContext) -> None:
        """Award what was called, and call what is left."""
        desk = self._desk
        desk.expire(host.now_ns)
        while True:
            waiting, free = {order.number for order in desk.waiting()}, desk.free(MOST_ORDERS)
            offers = [(bid, number, free.index(name), name) for name, own in self._bids.items()
                      if name in free for number, bid in own.items() if number in waiting]
            if not offers:
                break
            _, number, _, name = min(offers)
            desk.assign(name, number)
            del self._bids[name]  # its way is another one now
        self._bids.clear()
        host.show("stations", desk.marks(host.task.stations))
        host.publish("orders", desk.lists())
        call = [list(order) for order in desk.waiting()[:_MOST_CALLED]]
        if call:
            host.publish("call", call)
