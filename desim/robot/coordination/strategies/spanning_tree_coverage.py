"""Spanning tree coverage by several robots: each on its part of one tour around a tree."""

import numpy as np

from desim import ports
from desim.ports.tasks import SweepingTool
from desim.robot.coordination.sweep_tour import cyclic_runs, straight_on, sweep_tour
from desim.units import NS_PER_S

_PERIOD_NS = NS_PER_S  # of reports (as the team's state)
_SILENT_NS = 15 * _PERIOD_NS  # without a report, a robot's part is anybody's
_ON_LINE = 0.4  # of the width, so near to a cell's centre a robot covers it


class SpanningTreeCoverage:
    """Robots cover cells of the tool's width along one closed tour around a spanning tree of blocks
    of two by two cells (Gabriely and Rimon 2001), each from where it starts on to where another has
    been (multi-robot spanning tree coverage, Hazon and Kaminka 2005).

    All have the same map and so the same tour. Cells that are in no free block are visited from the
    cell of the tour that is nearest to them. A robot tells the team which cells it has covered, and
    where it is. One whose way is covered goes to the longest part that is left: to its beginning,
    or to its middle if a robot that was heard of within 15 s is on it. A robot that
    hears nothing covers everything.
    """

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(needs=SweepingTool)

    def __init__(self, params: Params) -> None:
        self._tour: list[ports.Place] = []
        self._covered = np.zeros(0, bool)  # or given up
        self._wide = np.zeros(0, bool)  # away from walls
        self._way: list[int] = []  # the cells of the present drive that are left
        self._next: int | None = None
        self._others: dict[str, tuple[int, int]] = {}  # by name: its next cell, time of its report
        self._early: list[list[int]] = []  # covered runs that were reported before there was a map

    def on_start(self, robot: ports.StrategyContext) -> None:
        robot.advertise("covered")
        robot.subscribe("covered", self._on_covered)
        robot.every(_PERIOD_NS, self._announce)

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if self._way and place == self._tour[self._way[-1]]:
            self._pass(robot)
            if end is ports.GoalEnd.REACHED:
                self._cover(len(self._way))
            elif end is ports.GoalEnd.FAILED:  # it is given up, by everybody
                self._covered[self._way[-1]] = True

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        if robot.pose is None or not self._tour and not self._plan(robot) or self._covered.all():
            return None
        if self._next is None:
            away_m = np.hypot(*(np.array(self._tour) - robot.pose[:2]).T)
            self._next = int(np.where(self._covered, np.inf, away_m).argmin())
        elif self._covered[self._next]:
            self._next = self._longest_left(robot)
        near_m = _ON_LINE * robot.task.width_m
        is_there = np.hypot(*np.subtract(self._tour[self._next], robot.pose[:2])) <= near_m
        theirs = {cell for cell, _ in self._others.values()}
        self._way = straight_on(self._next, self._tour, self._wide & ~self._covered, theirs) \
            if is_there else [self._next]
        return self._tour[self._way[-1]]

    def _cover(self, count: int) -> None:
        """The first ``count`` cells of the way are covered."""
        if count:
            self._covered[self._way[:count]] = True
            self._next, self._way = (self._way[count - 1] + 1) % len(self._tour), self._way[count:]

    def _pass(self, robot: ports.StrategyContext) -> None:
        """Cover the cells of the way that the robot has come by, up to the one that it is at."""
        if robot.pose is not None and self._way:
            places_m = np.array([self._tour[cell] for cell in self._way])
            away_m = np.hypot(*(places_m - robot.pose[:2]).T)
            if away_m.min() <= _ON_LINE * robot.task.width_m:
                self._cover(int(away_m.argmin()) + 1)

    def _plan(self, robot: ports.StrategyContext) -> bool:
        """Plan the tour, once the map is there."""
        self._tour, self._wide = sweep_tour(robot)
        self._covered = np.zeros(len(self._tour), bool)
        self._add(self._early)
        return bool(self._tour)

    def _longest_left(self, robot: ports.StrategyContext) -> int:
        """The cell from which on to cover the longest part that is left."""
        runs = cyclic_runs(~self._covered)
        begin, length = max(runs, key=lambda run: (run[1], -run[0]))
        on_it = any(robot.now_ns - heard_ns < _SILENT_NS
                    and (place - begin) % len(self._tour) < length
                    for place, heard_ns in self._others.values())
        return (begin + (length // 2 if on_it else 0)) % len(self._tour)

    def _announce(self, robot: ports.StrategyContext) -> None:
        self._pass(robot)
        if self._next is not None:
            robot.publish("covered", {"runs": [list(run) for run in cyclic_runs(self._covered)],
                                      "next": self._next})
            robot.show("cover", [ports.Mark(*self._tour[self._next],
                                            f"{self._covered.mean():.0%} covered")])

    def _on_covered(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        self._others[message.source] = message.content["next"], robot.now_ns
        self._add(message.content["runs"])
        theirs = message.content["next"]
        if theirs in self._way[1:]:  # up to there the way is this robot's
            self._way = self._way[:self._way.index(theirs)]
            robot.go(self._tour[self._way[-1]])

    def _add(self, runs: list[list[int]]) -> None:
        """Others have covered these."""
        if not self._tour:
            self._early = [*self._early, *runs]
            return
        for begin, length in runs:
            self._covered[(begin + np.arange(length)) % len(self._tour)] = True
