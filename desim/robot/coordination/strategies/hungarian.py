"""Hungarian assignment of robots to frontiers, with the least total path length (Kuhn 1955)."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from desim import ports
from desim.robot.coordination.assignment import finite_costs_m


class Hungarian:
    """Assign frontiers to all robots that the robot has heard of, and choose its own.

    Each robot solves the whole assignment in its own map. If maps and poses agree, so do the
    solutions. A robot without a frontier of its own takes the nearest.
    """

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        frontiers = context.frontiers()
        if not frontiers:
            return None
        places = [ports.Place(one.x_m, one.y_m) for one in frontiers]
        costs_m = np.array([[one.path_m for one in frontiers], *(
            context.path_lengths_m(places, ports.Place(peer.x_m, peer.y_m))
            for peer in context.peers.values())])
        robots, chosen = linear_sum_assignment(finite_costs_m(costs_m))
        pairs = list(zip(robots.tolist(), chosen.tolist(), strict=True))
        names = [context.name, *context.peers]
        context.show("assignment", (ports.Mark(places[place].x_m, places[place].y_m, names[robot])
                                    for robot, place in pairs))
        own = dict(pairs).get(0)
        return frontiers[0] if own is None else frontiers[own]
