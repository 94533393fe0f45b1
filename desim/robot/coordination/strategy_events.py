"""Calls of a strategy's methods for events."""

from __future__ import annotations

from desim.ports import (
    FollowsGoals,
    FollowsMap,
    FollowsTask,
    FollowsTeam,
    GoalEnd,
    Place,
    Starts,
    Strategy,
    StrategyContext,
)
from desim.robot.team import Team


class StrategyEvents:
    """Calls ``on_start``, ``on_goal``, ``on_map``, ``on_task`` and ``on_teammate`` of a strategy
    that has them."""

    def __init__(self, strategy: Strategy, context: StrategyContext, team: Team) -> None:
        self._context, self._team = context, team
        self._starts = strategy if isinstance(strategy, Starts) else None
        self._goals = strategy if isinstance(strategy, FollowsGoals) else None
        self._maps = strategy if isinstance(strategy, FollowsMap) else None
        self._teammates = strategy if isinstance(strategy, FollowsTeam) else None
        self._follows_task = strategy if isinstance(strategy, FollowsTask) else None
        self._seen = 0  # the map's version at the last ``on_map``

    def started(self) -> None:
        """The host has started."""
        if self._starts is not None:
            self._starts.on_start(self._context)

    def goal_ended(self, place: Place, end: GoalEnd) -> None:
        """The drive to ``place`` has ended."""
        if self._goals is not None:
            self._goals.on_goal(self._context, place, end)

    def notified(self, content: object) -> None:
        """The task tells something."""
        if self._follows_task is not None:
            self._follows_task.on_task(self._context, content)

    def tick(self, now_ns: int, map_version: int) -> None:
        """Report what has changed since the last tick: the team first, then the map."""
        if self._teammates is not None:
            for name, heard in self._team.changes(now_ns):
                self._teammates.on_teammate(self._context, name, heard)
        if self._maps is not None and map_version != self._seen:
            self._seen = map_version
            self._maps.on_map(self._context)
