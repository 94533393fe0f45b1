"""Traffic of robots whose goals come up as they work: they tell the host where they want to be."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from desim import ports
from desim.robot.coordination.traffic.control import TrafficControl, TrafficParams
from desim.robot.coordination.traffic.planners import TrafficPlanner


class WishingRobot:
    """The context of a robot whose drives are wishes: ``go`` and ``stop`` move nothing, ``goal`` is
    the last wish. All else is the robot's own ``context``."""

    def __init__(self, context: ports.StrategyContext) -> None:
        self._context = context
        self.goal: ports.Place | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def go(self, place: tuple[float, float]) -> bool:
        """Wish to be at ``place``. False, and nothing changes, where no path leads there."""
        if math.isinf(float(self._context.path_lengths_m([place])[0])):
            return False
        self.goal = ports.Place(*place)
        return True

    def stop(self) -> None:
        """Wish for nothing."""
        self.goal = None

    def subscribe(self, topic: str, callback: Callable[..., object], **options: Any) -> None:
        """As ``StrategyContext.subscribe``; the callback gets this context."""
        self._context.subscribe(topic, lambda _, message: callback(self, message), **options)

    def every(self, period_ns: int, callback: Callable[..., object]) -> None:
        """As ``StrategyContext.every``; the callback gets this context."""
        self._context.every(period_ns, lambda _: callback(self))


class WishTraffic(TrafficControl):
    """Traffic to what robots wish for, who say so in each report; ``new_planner`` makes the host's.
    All others of the team are robots. ``wishing``: a robot's own context."""

    wishing: WishingRobot

    def __init__(self, params: TrafficParams,
                 new_planner: Callable[[ports.StrategyContext], TrafficPlanner]) -> None:
        super().__init__(params)
        self._new_planner = new_planner
        self._wishes: dict[str, ports.Place | None] = {}  # at the host

    def planner(self, host: ports.StrategyContext) -> TrafficPlanner:
        """See ``TrafficControl``."""
        return self._new_planner(host)

    def robots(self, host: ports.StrategyContext) -> Collection[str]:
        """See ``TrafficControl``."""
        return host.team

    def goal(self, host: ports.StrategyContext, name: str, place: ports.Place | None = None
             ) -> ports.Place | None:
        """See ``TrafficControl``."""
        return self._wishes.get(name)

    def says(self, robot: ports.StrategyContext, anew: bool) -> dict[str, object]:
        """See ``TrafficControl``."""
        return {"wish": self.wishing.goal}

    def learn(self, name: str, content: Mapping[str, object]) -> None:
        """See ``TrafficControl``."""
        wish = content.get("wish")
        self._wishes[name] = ports.Place(*wish) if isinstance(wish, list) else None
