"""Traffic of robots each of which has places to get to, by the task."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from desim import ports
from desim.ports.tasks import Journeys
from desim.robot.coordination.traffic.control import TrafficControl, TrafficParams


class JourneysTraffic(TrafficControl):
    """Traffic whose goals are those of the task, which all hosts know."""

    traits = ports.StrategyTraits(needs=Journeys, needs_coordinator=True)

    def __init__(self, params: TrafficParams) -> None:
        super().__init__(params)
        # The number of goals that robots have reached, at the host: by the end of what is planned.
        self._reached: dict[str, int] = {}

    def robots(self, host: ports.StrategyContext) -> Collection[str]:
        """See ``TrafficControl``."""
        briefing: Journeys = host.task
        return briefing.goals

    def hosts(self, robot: ports.StrategyContext) -> list[str]:
        """See ``TrafficControl``."""
        return [name for name in robot.team if name not in robot.task.goals]

    def goal(self, host: ports.StrategyContext, name: str, place: ports.Place | None = None
             ) -> ports.Place:
        """See ``TrafficControl``: the last one if it was at all."""
        briefing: Journeys = host.task
        goals, reached = briefing.goals[name], self._reached.setdefault(name, 0)
        if place == goals[reached] and reached + 1 < len(goals):
            self._reached[name] = reached = reached + 1
        return goals[reached]

    def says(self, robot: ports.StrategyContext, anew: bool) -> dict[str, object]:
        """See ``TrafficControl``."""
        return {"reached": self._reached[robot.name]} if anew else {}

    def learn(self, name: str, content: Mapping[str, object]) -> None:
        """See ``TrafficControl``."""
        if isinstance(reached := content.get("reached"), int):
            self._reached[name] = reached
