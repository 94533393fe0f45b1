"""No frame gets farther than a distance."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Length

_FAR = ports.Drop("out_of_range")


class Range:
    """Drops frames to receivers farther away than ``distance``, measured when a frame is sent,
    through walls. A host without a place is in reach of everybody.

    Capabilities: LimitsReach, PassesMany.
    """

    class Params(ports.Params):
        distance_m: Length = Field("200 m", description="(the paper)")

    reasons = ("out_of_range",)

    def __init__(self, params: Params) -> None:
        self.reach_m = params.distance_m
        self._distance_m2 = params.distance_m ** 2

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._updated_ns = -1
        self._positions: np.ndarray | None = None  # until the next world tick the same object
        self._places: list[list[float]] = []
        self._all_near = False  # the box around all is no farther across than the distance
        # Hosts without a place, in reach of everybody: with one of them at either end there is
        # nothing to measure.
        self._placeless = np.isnan(context.positions(context.now_ns)).any(axis=1).tolist()

    def all_pass(self, frames: ports.Frames) -> bool:
        return self.judge(frames, frames.receivers) is None

    def judge(self, frame: ports.Frame | ports.Frames, receivers: tuple[int, ...]
              ) -> list[ports.Verdict] | None:
        source, placeless = frame.source, self._placeless
        if placeless[source] or len(receivers) == 1 and placeless[receivers[0]]:
            return None
        now_ns = self._context.now_ns
        if now_ns != self._updated_ns:
            self._update(now_ns)
        if self._all_near:
            return None
        places = self._places
        x_m, y_m = places[source]
        verdicts: list[ports.Verdict] | None = None
        limit_m2 = self._distance_m2
        for i, receiver in enumerate(receivers):
            to_x_m, to_y_m = places[receiver]
            dx_m, dy_m = to_x_m - x_m, to_y_m - y_m
            if dx_m * dx_m + dy_m * dy_m > limit_m2:  # False for NaN
                if verdicts is None:
                    verdicts = [ports.PASS] * len(receivers)
                verdicts[i] = _FAR
        return verdicts

    def _update(self, now_ns: int) -> None:
        self._updated_ns = now_ns
        positions = self._context.positions(now_ns)
        if positions is not self._positions:
            self._positions, self._places = positions, positions.tolist()
            # fmax and fmin pass over NaN
            width_m, height_m = (np.fmax.reduce(positions) - np.fmin.reduce(positions)).tolist()
            self._all_near = width_m * width_m + height_m * height_m <= self._distance_m2
