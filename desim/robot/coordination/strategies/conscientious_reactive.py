"""Conscientious reactive patrol (Machado, Ramalho, Zucker, Drogoul 2002)."""

import math

from pydantic import Field

from desim import ports
from desim.ports.tasks import Patrol
from desim.robot.coordination.strategies.nearest_frontier import nearest


class ConscientiousReactive:
    """Drive to the one of the nearest places that the robot itself has not visited for longest.

    Robots exchange no messages. A drive that failed counts as a visit, so that no place holds a
    robot up. If no path to a place is known the robot explores as ``nearest_frontier``.
    """

    class Params(ports.Params):
        neighbours: int = Field(4, ge=1, description=(
            "so many places are the nearest (those of a crossing of streets: the literature's are "
            "the neighbours in a graph)"))

    traits = ports.StrategyTraits(needs=Patrol)

    def __init__(self, params: Params) -> None:
        self._neighbours = params.neighbours
        self._last_ns: dict[ports.Place, int] = {}
        self._here: ports.Place | None = None

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end in (ports.GoalEnd.REACHED, ports.GoalEnd.FAILED):
            self._last_ns[place], self._here = robot.now_ns, place

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | ports.Place | None:
        places = [place for place in robot.task.places if place != self._here]
        ways = zip(robot.path_lengths_m(places).tolist(), places, strict=True)
        near = sorted(way for way in ways if way[0] < math.inf)[:self._neighbours]
        if not near:
            return nearest(robot)
        return min(near, key=lambda way: (self._last_ns.get(way[1], -1), way))[1]
