"""The common part of strategies that give orders over the network."""

from __future__ import annotations

from abc import ABC, abstractmethod

from desim import ports
from desim.ports.delivery import AskLoad, AskOrders, Delivery, TransportOrder
from desim.robot.coordination.orders.desk import OrderDesk, OrderDeskParams, Report
from desim.robot.coordination.orders.porter import Porter
from desim.units import NS_PER_S

_STEP_NS = NS_PER_S // 2  # in which a robot looks whether it has arrived


class OrderStrategy(ABC):
    """On a robot: reports, and a porter that carries out orders. On a host without a body: a desk
    that each ``period`` assigns orders (``_assign``) and publishes those of all robots."""

    traits = ports.StrategyTraits(needs=Delivery, needs_coordinator=True)

    def __init__(self, params: OrderDeskParams) -> None:
        self._period_ns = params.period_ns
        self._desk, self._porter = OrderDesk(params), Porter()

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            host.advertise("report")
            host.subscribe("orders", self._on_orders)
            host.every(self._period_ns, self._report)
            host.every(_STEP_NS, self._porter.step)
            host.act(AskLoad())
        else:
            host.advertise("orders")
            host.subscribe("report", self._on_report)
            host.every(self._period_ns, self._give)
            host.act(AskOrders())

    def on_task(self, host: ports.StrategyContext, content: object) -> None:
        if isinstance(content, TransportOrder):
            self._desk.add(content)
        else:
            self._porter.notified(host, content)
            self._report(host)

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        """The porter drives by itself."""
        return None

    def _report(self, robot: ports.StrategyContext) -> None:
        if robot.pose is not None:
            robot.publish("report", Report.of(robot, self._porter))

    def _on_orders(self, robot: ports.StrategyContext, lists: ports.StrategyMessage) -> None:
        self._porter.take(TransportOrder(*one) for one in lists.content.get(robot.name, ()))
        self._porter.step(robot)

    def _on_report(self, host: ports.StrategyContext, report: ports.StrategyMessage) -> None:
        self._desk.heard(report.source, Report(report.content), host.now_ns)

    def _give(self, host: ports.StrategyContext) -> None:
        self._desk.expire(host.now_ns)
        self._assign(host)
        host.show("stations", self._desk.marks(host.task.stations))
        host.publish("orders", self._desk.lists())

    @abstractmethod
    def _assign(self, host: ports.StrategyContext) -> None:
        """Give waiting orders to robots."""
