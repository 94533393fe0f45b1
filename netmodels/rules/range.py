"""Nobody farther away than a distance is reached."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Length

_FAR = ports.Drop("out_of_range")


class Range:
    """Drops what is to go farther than ``distance``, measured when it is sent, through walls. A
    host without a place is in reach of everybody."""

    class Params(ports.Params):
        distance_m: Length = Field("200 m", description="(the paper)")

    reasons = ("out_of_range",)

    def __init__(self, params: Params) -> None:
        self.reach_m = params.distance_m
        self._distance_m2 = params.distance_m ** 2

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._all_near = False
        self._positions = None  # until the next world tick they are the same object

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        positions = self._context.positions(self._context.now_ns)
        if positions is not self._positions:
            self._look(positions)
        if self._all_near:
            return [ports.PASS] * len(receivers)
        places = self._places
        x_m, y_m = places[frame.source]
        return [_FAR if (places[receiver][0] - x_m) ** 2 + (places[receiver][1] - y_m) ** 2
                > self._distance_m2 else ports.PASS  # NaN compares False
                for receiver in receivers]

    def _look(self, positions: np.ndarray) -> None:
        """Once after each move: where the box around all hosts has a diagonal within ``distance``
        nobody needs to look at pairs."""
        self._positions, self._places = positions, positions.tolist()
        width_m, height_m = (np.fmax.reduce(positions) - np.fmin.reduce(positions)).tolist()
        self._all_near = width_m ** 2 + height_m ** 2 <= self._distance_m2
