"""Agents that steer their robots by velocities."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from desim.envs.control import Action, Observation, numbers
from desim.ports import StrategyContext
from desim.scenario.schema.robot import Equipment
from desim.stepping import ControlPeriods
from desim.units import NS_PER_S


class Velocities:
    """Each agent commands its robot every ``period_ns``: ``velocity`` [2], forward (m/s) and of
    turning (rad/s), both up to ``limits``. Nobody else does: no strategy, no planner.

    It observes ``scan`` [beams], the first laser's ranges (m), zeros before the first scan.
    """

    def __init__(self, period_ns: int = NS_PER_S // 5, limits: tuple[float, float] = (0.5, 1.0)
                 ) -> None:
        self.turns, self._limits = ControlPeriods(period_ns), np.array(limits, np.float32)

    def actions(self) -> dict[str, spaces.Space]:
        """See ``Control.actions``."""
        return {"velocity": spaces.Box(-self._limits, self._limits)}

    def observations(self, robot: Equipment) -> dict[str, spaces.Box]:
        """See ``Control.observations``."""
        return {"scan": numbers(robot.first_laser.beams)}

    def observe(self, context: StrategyContext) -> Observation:
        """See ``Control.observe``."""
        scan = context.scan()
        return {} if scan is None else {"scan": scan.ranges}

    def act(self, context: StrategyContext, action: Action, observed: Observation) -> None:
        """See ``Control.act``."""
        forward_mps, turn_radps = map(float, action["velocity"])
        context.drive(forward_mps, 0.0, turn_radps)
