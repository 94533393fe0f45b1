"""An auction of orders over the network: a host calls, robots bid, the host awards."""

import math

from desim import ports
from desim.ports.delivery import TransportOrder
from desim.robot.coordination.orders.desk import MOST_ORDERS, OrderDeskParams, way_m
from desim.robot.coordination.orders.order_strategy import OrderStrategy

_MOST_CALLED = 10  # orders in one call, the oldest


class Auction(OrderStrategy):
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

    def __init__(self, params: Params) -> None:
        super().__init__(params)
        self._bids: dict[str, dict[int, float]] = {}  # at the host: by robot and order, m

    def on_start(self, host: ports.StrategyContext) -> None:
        host.advertise("bids" if host.has_body else "call")
        if host.has_body:
            host.subscribe("call", self._on_call)
        else:
            host.subscribe("bids", self._on_bids)
        super().on_start(host)

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

    def _on_bids(self, host: ports.StrategyContext, bids: ports.StrategyMessage) -> None:
        self._bids[bids.source] = {int(number): bid for number, bid in bids.content.items()}

    def _give(self, host: ports.StrategyContext) -> None:
        super()._give(host)
        call = [list(order) for order in self._desk.waiting()[:_MOST_CALLED]]
        if call:
            host.publish("call", call)

    def _assign(self, host: ports.StrategyContext) -> None:
        """Award what was called."""
        desk = self._desk
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
