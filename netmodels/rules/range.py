"""Nobody farther away than a distance is reached."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Length


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

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        places = self._context.positions(self._context.now_ns)
        x_m, y_m = places[frame.source].tolist()
        return [ports.Drop("out_of_range") if (rx_m - x_m) ** 2 + (ry_m - y_m) ** 2
                > self._distance_m2 else ports.PASS  # NaN compares False
                for rx_m, ry_m in places[list(receivers)].tolist()]
