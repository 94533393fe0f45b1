"""The contract of an agent's control over its robot: its decisions, observations and actions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from gymnasium import spaces

from desim.ports import StrategyContext
from desim.scenario.schema.robot import Equipment
from desim.stepping import Turns

Observation = dict[str, np.ndarray]
Action = Mapping[str, np.ndarray]  # by name; also numbers of NumPy


def numbers(*shape: int) -> spaces.Box:
    """The space of arrays of this shape."""
    return spaces.Box(-np.inf, np.inf, shape, np.float32)


class Control(Protocol):
    """The control of robots through ``StrategyContext``s, one decision each ``turns.period_ns``."""

    @property
    def turns(self) -> Turns:
        """The instants of its decisions."""

    def actions(self) -> Mapping[str, spaces.Space]:
        """New spaces of an agent's actions, by name."""

    def observations(self, robot: Equipment) -> Mapping[str, spaces.Box]:
        """The spaces of what ``observe`` returns for such a robot."""

    def observe(self, context: StrategyContext) -> Observation:
        """The knowledge of the robot now, as far as this control adds to every agent's."""

    def act(self, context: StrategyContext, action: Action, observed: Observation) -> None:
        """Act at the robot's turn; the action was chosen after what was ``observed``."""
