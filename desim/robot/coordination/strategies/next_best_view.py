"""Next best view: the most new area for the length of the path (Gonzalez-Banos, Latombe 2002)."""

import math

from pydantic import Field

from desim import ports


class NextBestView:
    """Choose the frontier with the largest ``gain * exp(-decay * path)``: the unknown area that the
    laser would see there, discounted by the length of the path."""

    class Params(ports.Params):
        decay_per_m: float = Field(0.2, ge=0, description=(
            "lambda of their formula; with 0.2, 5 m of way cost a factor e (maze_8, seeds 1 to 3: "
            "161 s)"))

    def __init__(self, params: Params) -> None:
        self._decay_per_m = params.decay_per_m

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        gains_m2 = {frontier: context.gain_m2(frontier[:2]) for frontier in context.frontiers()}

        def utility_m2(frontier: ports.Frontier) -> float:
            return gains_m2[frontier] * math.exp(-self._decay_per_m * frontier.path_m)

        context.show("utility", (
            ports.Mark(*one[:2], f"utility {utility_m2(one):.1f} m2: gain {gain:.1f} m2, way "
                                 f"{one.path_m:.0f} m") for one, gain in gains_m2.items()))
        return max(gains_m2, key=utility_m2, default=None)
