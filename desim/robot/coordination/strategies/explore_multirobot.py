"""The published explore of the paper's testbed (yzrobot/explore_multirobot, explore.cpp)."""

import math
from typing import Literal

from pydantic import Field

from desim import ports
from desim.units import Duration, Length, Period

NEUTRAL = 50  # navfn's potential of a step into a free cell (COST_NEUTRAL)
_STILL_M = 0.01  # a goal that moved less is the same one
_ALIKE_CELLS = 2  # a goal that is nearer to a blacklisted one, in x and in y, is avoided


class ExploreMultirobot:
    """Each second, make the frontier of least cost the goal:

        cost = potential_scale * potential - gain_scale * length

    ``potential`` is navfn's, 50 a free cell and more beside obstacles; ``length`` is that of the
    frontier. So 1 m of free path costs 1.25, and 1 m of frontier lowers the cost by 1. Frontiers
    shorter than ``min_frontier`` do not count. A goal is avoided for good once the drive to it has
    failed, or the robot has made no progress towards it for longer than ``progress_timeout``.
    Teammates matter only through the map.

    Differences from the code: the robot drives to the place of ``Frontier``, and not to the
    centroid of the frontier; the path to an unchanged goal is not planned anew each second; there
    is no detour to close loops; the cost has no term of orientation, whose scale is 0 in the launch
    file.
    """

    class Params(ports.Params):
        """The defaults are those of the published launch file (mrs_testbed, pioneer3dx.launch)."""

        period_ns: Period = Field("1 s", description="of goals (explore.cpp planner_frequency)")
        potential_scale: float = Field(0.005, ge=0, description="(the published launch file)")
        gain_scale: float = Field(1.0, ge=0, description="per metre (the published launch file)")
        min_frontier_m: Length = Field("1.8 m", description=(
            "shorter ones are left out (inscribed_scale 10 times the inscribed radius of 0.18 m)"))
        progress_timeout_ns: Duration = Field("3 s", description=(
            "without progress for longer: avoid the goal (the published launch file)"))
        done: Literal["for_good", "until_news"] = Field("for_good", description=(
            "without a goal it stops for good (explore.cpp), or until the map changes"))

    def __init__(self, params: Params) -> None:
        self._params = params
        self._done = False
        self._avoided: list[ports.Place] = []
        self._goal = ports.Place(math.inf, math.inf)  # at the last look
        self._at = ports.Place(math.inf, math.inf)  # the robot's place likewise
        self._stalled_ns = 0
        self._chosen_ns = 0  # the last look at frontiers
        self._seen: tuple[int, list[ports.Frontier]] | None = None  # by ``on_map``, and when

    def on_start(self, robot: ports.StrategyContext) -> None:
        if robot.has_body:
            robot.every(self._params.period_ns, self._watch)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | None:
        if self._done:
            return None
        seen, self._seen = self._seen, None
        if seen is not None and seen[0] == robot.now_ns:  # explore.cpp searches once a second
            return self._best(robot, seen[1])
        return self._best(robot, robot.frontiers())

    def on_map(self, robot: ports.StrategyContext) -> None:
        """Replace the goal if another one is better now. Only a change of the map can make one
        better: on the path to the best frontier the cost of no other one falls faster."""
        if self._done or robot.goal is None:  # then ``choose`` is called
            return
        if robot.now_ns - self._chosen_ns < self._params.period_ns:
            return
        self._seen = robot.now_ns, robot.frontiers()
        best = self._best(robot, self._seen[1])
        if best is not None:
            robot.go(best)

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end is ports.GoalEnd.FAILED:
            self._avoided.append(place)

    def _watch(self, robot: ports.StrategyContext) -> None:
        """Avoid a goal towards which the robot makes no progress: the number of cells in its plan
        has not changed. (A plan to another goal counts as progress.)"""
        goal, pose = robot.goal, robot.pose
        if goal is None or pose is None or self._done:
            return
        nearer = math.dist(pose[:2], self._at) >= robot.grid.resolution_m
        if nearer or math.dist(goal, self._goal) >= _STILL_M:
            self._stalled_ns = 0
        else:
            self._stalled_ns += self._params.period_ns
        self._goal, self._at = goal, ports.Place(*pose[:2])
        if self._stalled_ns > self._params.progress_timeout_ns:
            self._avoided.append(goal)
            best = self._best(robot, robot.frontiers())
            if best is None:
                robot.stop()
            else:
                robot.go(best)

    def _best(self, robot: ports.StrategyContext, frontiers: list[ports.Frontier]
              ) -> ports.Frontier | None:
        """The one of ``frontiers`` of least cost that is not avoided; without any, the robot may be
        done."""
        resolution_m, params = robot.grid.resolution_m, self._params
        self._chosen_ns = robot.now_ns

        def way(frontier: ports.Frontier) -> float:
            return params.potential_scale * (NEUTRAL * frontier.path_m / resolution_m)

        def gain(frontier: ports.Frontier) -> float:
            return params.gain_scale * frontier.cells * resolution_m

        candidates = [one for one in frontiers
                      if one.cells * resolution_m >= params.min_frontier_m
                      and not self._is_avoided(one, _ALIKE_CELLS * resolution_m)]
        robot.show("cost", (ports.Mark(*one[:2], f"cost {way(one) - gain(one):.1f} m: way "
                                       f"{way(one):.1f} m, gain {gain(one):.1f} m")
                            for one in candidates))
        best = min(candidates, key=lambda one: way(one) - gain(one), default=None)
        self._done = best is None and params.done == "for_good"
        return best

    def _is_avoided(self, frontier: ports.Frontier, alike_m: float) -> bool:
        return any(abs(frontier.x_m - place.x_m) < alike_m and abs(frontier.y_m - place.y_m)
                   < alike_m for place in self._avoided)
