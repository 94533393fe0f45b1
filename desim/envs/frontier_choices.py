"""Agents that choose among the frontiers of their robots' maps."""

from __future__ import annotations

import math

import numpy as np
from gymnasium import spaces

from desim.envs.control import Action, Observation, numbers
from desim.ports import StrategyContext
from desim.scenario.schema.robot import Equipment
from desim.stepping import Turns
from desim.units import NS_PER_S


class FrontierChoices:
    """Each agent chooses every ``period_ns``: ``goal`` 0 leaves it to the scenario's own strategy,
    k sends the robot to frontier k - 1 of those that it was shown, or now nearest to it. A
    frontier that is not there means 0.

    It observes ``frontiers`` [count, 4]: x, y (m), ``path_m``, ``cells``, nearest path first, then
    zeros; and ``goal`` [3]: 1 if there is one, x, y (m).
    """

    def __init__(self, period_ns: int = 2 * NS_PER_S, count: int = 16) -> None:
        self.turns, self._count = Turns(period_ns), count

    def actions(self) -> dict[str, spaces.Space]:
        """See ``Control.actions``."""
        return {"goal": spaces.Discrete(self._count + 1)}

    def observations(self, robot: Equipment) -> dict[str, spaces.Box]:
        """See ``Control.observations``."""
        return {"frontiers": numbers(self._count, 4), "goal": numbers(3)}

    def observe(self, context: StrategyContext) -> Observation:
        """See ``Control.observe``."""
        frontiers, goal = np.zeros((self._count, 4), np.float32), np.zeros(3, np.float32)
        found = [] if context.pose is None else context.frontiers()[:self._count]
        if found:
            frontiers[:len(found)] = found
        if context.goal is not None:
            goal[:] = 1.0, *context.goal
        return {"frontiers": frontiers, "goal": goal}

    def act(self, context: StrategyContext, action: Action, observed: Observation) -> None:
        """See ``Control.act``."""
        goal = int(action["goal"])
        shown = observed["frontiers"][goal - 1]
        if not goal or not shown[3]:
            return
        place = shown[:2].tolist()
        nearest = min(context.frontiers(), default=None,
                      key=lambda frontier: math.dist(frontier[:2], place))
        if nearest is not None:
            context.go(nearest)
