"""Voronoi cells: each robot explores the frontiers that are nearest to it."""

import math

from desim import ports


class Voronoi:
    """Choose the nearest frontier in the robot's own Voronoi cell: no teammate is nearer to it in a
    straight line. If no frontier is there, choose the one nearest to the cell."""

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        def outside_m(frontier: ports.Frontier) -> float:
            own_m = math.dist(frontier[:2], context.pose[:2]) if context.pose else 0.0
            nearest_m = min((math.dist(frontier[:2], peer[:2])
                             for peer in context.peers.values()), default=math.inf)
            return max(0.0, own_m - nearest_m)

        frontiers = context.frontiers()
        context.show("way", (ports.Mark(*one[:2], _described(one, outside_m(one)))
                             for one in frontiers))
        return min(frontiers, key=lambda one: (outside_m(one), one.path_m), default=None)


def _described(frontier: ports.Frontier, outside_m: float) -> str:
    outside = f", outside by {outside_m:.0f} m" if outside_m else ""
    return f"way {frontier.path_m:.0f} m{outside}"
