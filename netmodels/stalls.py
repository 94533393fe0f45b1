"""Stalls of a link: now and then nothing gets through for a while, and then all of it at once."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Duration, Pace


class StallLaw(ports.Params):
    """The law of stalls: how rare they are, and how long. Lengths are ``least`` and a generalized
    Pareto time on top, whose tail is that of (1 + shape t / scale)^(-1 / shape)."""

    every_ns: Pace = Field("84 s", description="mean time from the end of one to the next")
    least_ns: Duration = Field("340 ms", description="of each")
    scale_ns: Pace = Field("114 ms", description="of the time on top")
    shape: float = Field(0.88, ge=0.0, lt=1.0, description="(0: exponential)")


class Stalls:
    """The stalls of one link, from ``stream``: a function of time and of the stream alone. At time
    0 there is none."""

    def __init__(self, stream: np.random.Generator, law: StallLaw) -> None:
        self._stream, self._law = stream, law
        self._end_ns = 0
        self._next()

    def over_ns(self, now_ns: int) -> int:
        """The time when something sent at ``now_ns`` gets on: ``now_ns``, or the end of the stall.
        ``now_ns`` never decreases."""
        while self._end_ns <= now_ns:
            self._next()
        return self._end_ns if self._begin_ns <= now_ns else now_ns

    def _next(self) -> None:
        law, stream = self._law, self._stream
        self._begin_ns = self._end_ns + round(law.every_ns * stream.standard_exponential())
        tail = stream.standard_exponential()
        if law.shape:
            tail = np.expm1(law.shape * tail) / law.shape
        self._end_ns = self._begin_ns + law.least_ns + round(law.scale_ns * tail)
