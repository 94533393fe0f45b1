"""Our local planner: a dynamic window, clear of the obstacles of the laser."""

from __future__ import annotations

import numpy as np

from desim import ports
from desim.ports.kernels import compiled_function
from desim.ports.local_planners import LocalContext
from desim.robot.navigation.kernels import dynamic_window as kernels

_steer = compiled_function(kernels.steer)


class DynamicWindow:
    """The cheapest rollout of the velocities within reach; robots that meet keep to the right and
    yield. Its settings are those of ``robot.navigation``."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        """``params`` are empty."""

    def start(self, context: LocalContext) -> None:
        """Take the costmaps."""
        self._arrays, setup = context.arrays, context.arrays.setup
        self._candidates = int(setup[0]["speeds"] * setup[0]["turns"])
        self._state = np.zeros(1, kernels.STATE)

    def on_path(self, context: LocalContext) -> None:
        """Begin with the first leg."""
        self._state["leg"] = 0

    def steer(self, context: LocalContext) -> tuple[float, float, float, bool]:
        """The velocity with the cheapest rollout."""
        worked = context.worked
        worked(candidates=self._candidates)
        x_m, y_m, yaw_rad = context.position
        speed_mps, turn_radps, togo_m, blocked = _steer(
            x_m, y_m, yaw_rad, context.speed_mps, context.turn_radps, self._state, context.path,
            *self._arrays)
        return speed_mps, turn_radps, togo_m, blocked > 0.0
