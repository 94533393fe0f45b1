"""Frames that arrive later, out of order or twice."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from pydantic import Field, model_validator
from scipy.special import gammainccinv, ndtri

from desim import ports
from desim.units import Duration, Period, Ratio
from netmodels.random_loss import PairStreams

# The delay that is exceeded with chance u, in jitters from the mean. The same u is a late frame in
# all of them.
_QUANTILES: dict[str, Callable[[float], float]] = {
    "uniform": lambda u: 1.0 - 2.0 * u,
    "normal": lambda u: -ndtri(u),
    "exponential": lambda u: -math.log(u) - 1.0,
    "pareto": lambda u: (u ** (-1 / 3) - 1.5) / math.sqrt(0.75),
}


class Latency:
    """All arrives later, by ``delay`` on the average, with the standard deviation ``jitter``.

    As with netem, ``uniform`` goes from delay - jitter to delay + jitter. ``exponential`` begins at
    delay - jitter, ``gamma`` at 0 with the shape (delay / jitter)^2, and ``pareto`` has the
    exponent 3 (netem's; its table is 4/3 * 0.866 = 1.155 times as wide). A delay is
    never negative.

    Each frame at each receiver draws its own delay, each ordered pair of hosts from its own stream:
    frames overtake each other by their jitter, and those before ``until`` are overtaken by those
    after it. netem orders its packets by when they are due, and so reorders likewise.
    """

    class Params(ports.Params):
        delay_ns: Duration = Field(description="one way")
        jitter_ns: Duration = Field("0 ns", description="(none)")
        distribution: Literal["uniform", "normal", "exponential", "gamma", "pareto"] = Field(
            "uniform", description="of the delay (netem)")

        @model_validator(mode="after")
        def _has_a_shape(self) -> Latency.Params:
            if self.distribution == "gamma" and self.jitter_ns and not self.delay_ns:
                raise ValueError("gamma needs a delay above zero")
            return self

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._delay_ns, self._jitter_ns = params.delay_ns, params.jitter_ns
        self._fixed = ports.Deliver(params.delay_ns)
        self._quantile = _QUANTILES.get(params.distribution, self._gamma)

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "jitter", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        if not self._jitter_ns:
            return [self._fixed] * len(receivers)
        return [ports.Deliver(self._draw_ns(frame.source, receiver)) for receiver in receivers]

    def _draw_ns(self, source: int, receiver: int) -> int:
        """A delay, rounded down or up by the same draw: from end to end of a uniform law, each
        nanosecond is as likely as any other."""
        draw = self._streams(source, receiver).random()
        late_ns = max(self._jitter_ns * self._quantile(1.0 - draw), -self._delay_ns)
        return self._delay_ns + math.floor(late_ns + draw)

    def _gamma(self, u: float) -> float:
        ratio = self._delay_ns / self._jitter_ns
        return gammainccinv(ratio ** 2, u) / ratio - ratio


class Reordering:
    """Each frame arrives ``delay`` later with ``probability``, independently of all others.

    Whatever is sent meanwhile and is not held back arrives before it. Each ordered pair of hosts
    draws from its own stream. netem's ``delay 10ms reorder 25%``, where 25 % go at once, is a
    probability of 75 % here. (``latency`` with jitter reorders, too.)

    A stream has one message on the wire at a time, which nothing overtakes: it becomes slower only.
    """

    class Params(ports.Params):
        probability: Ratio = Field(description="that a frame is held back")
        delay_ns: Period = Field(examples=["20 ms"], description="for how long")

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._probability = params.probability
        self._later = ports.Deliver(params.delay_ns)

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "reordering", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [self._later if self._streams(frame.source, receiver).random() < self._probability
                else ports.PASS for receiver in receivers]


class Duplication:
    """Each packet arrives twice with ``probability``, independently of all others. This is netem's
    ``duplicate``; each ordered pair of hosts draws from its own stream. A train comes twice where
    all its packets do: probability^segments.

    The copy is made behind the medium, as where something on the way repeats what has arrived
    after all: it takes no capacity, and where the original is lost there is none.
    """

    class Params(ports.Params):
        probability: Ratio = Field(description="of one packet at one receiver")
        after_ns: Duration = Field("1 ms", description="from the original to its copy (a few "
                                                       "attempts of a link layer; netem: at once)")

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._probability = params.probability
        self._twice = ports.Duplicate(params.after_ns)

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "duplication", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        probability = self._probability ** frame.segments
        return [self._twice if self._streams(frame.source, receiver).random() < probability
                else ports.PASS for receiver in receivers]
