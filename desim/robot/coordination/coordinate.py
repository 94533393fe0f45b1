"""The node that runs a strategy on a host without a body: a central coordinator."""

from __future__ import annotations

from fractions import Fraction

from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.ports import Strategy
from desim.robot.coordination.context import HostContext
from desim.robot.coordination.strategy_events import StrategyEvents
from desim.robot.coordination.task_link import TaskLink
from desim.robot.navigation.map_queries import MapQueries
from desim.robot.team import Team


class Coordinate(Node):
    """Notifies the strategy of changes of the team and of the map that ``MapSharing`` of the same
    host merges.
    """

    def __init__(self, host: Host, rate_hz: Fraction, strategy: Strategy, queries: MapQueries,
                 team: Team, link: TaskLink) -> None:
        super().__init__(host, "coordinate")
        self._rate_hz, self._map = rate_hz, queries.costmap.robot_map
        self._context = HostContext(self, team, queries, None, link)
        self._events = StrategyEvents(strategy, self._context, team)

    def kept(self) -> dict[str, int]:
        """See ``Node.kept``: the costmap."""
        return {"cells": self._map.spec.cells}

    def start(self) -> None:
        self.timer(self._rate_hz, lambda _: self._events.tick(
            self.now_ns, self._map.version), name="tick")
        self._context.listen(self._events.notified)
        self._events.started()
