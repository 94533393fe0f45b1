"""Utility minus cost: goals of teammates make frontiers near by less useful (Burgard 2005)."""

import math

from pydantic import Field

from desim import ports
from desim.units import Length


class GreedyAssignment:
    """Choose the frontier with the largest utility minus cost (Burgard, Moors, Stachniss, Schneider
    2005, algorithm 1, each robot for itself).

    The cost is the length of the path. The utility is 1, minus ``1 - d / range`` for each goal of a
    teammate at a distance ``d`` below the range.
    """

    class Params(ports.Params):
        beta_m: Length = Field("25 m", description=(
            "way that one unit of utility is worth (a range of the laser; maze_8, seeds 1 to 3: "
            "127 s)"))
        range_m: Length = Field("25 m", gt=0, description=(
            "of the laser: a goal at a distance d takes 1 - d / range of the utility (usable_range)"
            ))

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: Params) -> None:
        self._beta_m, self._range_m = params.beta_m, params.range_m

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        goals = [peer.goal for peer in context.peers.values() if peer.goal is not None]

        def value_m(frontier: ports.Frontier) -> float:
            utility = 1.0 - sum(max(0.0, 1.0 - math.dist(frontier[:2], goal) / self._range_m)
                                for goal in goals)
            return self._beta_m * utility - frontier.path_m

        values_m = {frontier: value_m(frontier) for frontier in context.frontiers()}
        context.show("value", (ports.Mark(*one[:2], f"value {value:.0f} m: way "
                                         f"{one.path_m:.0f} m")
                               for one, value in values_m.items()))
        return max(values_m, key=lambda one: values_m[one], default=None)
