"""A dispatcher whose robots drive over cells that the same host grants them."""

from typing import Any, Literal

from pydantic import Field

from desim import ports
from desim.robot.coordination.strategies.dispatcher import Dispatcher
from desim.robot.coordination.traffic.control import TrafficParams
from desim.robot.coordination.traffic.planners import Pibt, Prioritized, TrafficPlanner
from desim.robot.coordination.traffic.wishes import WishingRobot, WishTraffic


class GuidedDispatcher(Dispatcher):
    """As ``dispatcher``, but robots do not drive freely: they tell the host to which station they
    want, and it plans their steps on cells, by ``pibt`` or ``prioritized``, and grants them. Who
    wants nothing is pushed aside. Without messages all stand, and orders wait."""

    class Params(TrafficParams, Dispatcher.Params):
        ahead: int = Field(3, ge=1, description=(
            "the number of steps that are planned ahead of the robot that is farthest behind; "
            "wishes change, so that few are better (ours)"))
        planner: Literal["pibt", "prioritized"] = Field("pibt", description="of the steps")

    def __init__(self, params: Params) -> None:
        super().__init__(params)
        self._planner_name = params.planner
        self._traffic = WishTraffic(params, self._new_planner)

    def on_start(self, host: ports.StrategyContext) -> None:
        self._traffic.wishing = WishingRobot(host)
        self._traffic.on_start(host)
        super().on_start(self._seen_by_orders(host))

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        self._traffic.on_goal(robot, place, end)

    def on_task(self, host: ports.StrategyContext, content: object) -> None:
        super().on_task(self._seen_by_orders(host), content)

    def _seen_by_orders(self, host: ports.StrategyContext) -> Any:
        """The context that orders are carried out in: of a robot that wishes instead of driving."""
        return self._traffic.wishing if host.has_body else host

    def _new_planner(self, host: ports.StrategyContext) -> TrafficPlanner:
        return Pibt(host.stream("ties")) if self._planner_name == "pibt" else Prioritized()
