"""Rules against the laws that they are named after, and a round trip."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from desim import ports
from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.ideal import Ideal
from netmodels.rules.loss import GilbertElliott
from netmodels.rules.outage import Flapping
from netmodels.rules.timing import Latency

TO_BAD, DOWN, JITTER, EACH_WAY = 0.05, "10 s", "10 ms", "500 ms"

_ERRORS = 3.3  # standard errors: one comparison in a thousand is farther off by chance
_BURSTY, _FLAPPING, _LATE = 100_000, 40_000, 40_000  # frames


class Bursts:
    """Loss of ``gilbert_elliott``: p / (p + r) within 3.3 standard errors, in which packets k apart
    have (1 - p - r)^k in common."""

    source = "Gilbert 1960, Elliott 1963"

    def checks(self, play: Play) -> Iterator[Check]:
        share = 0.05 / (0.05 + 0.25)
        error = math.sqrt(share * (1 - share) * (2 - 0.3) / 0.3 / _BURSTY)
        found = _played(play, GilbertElliott(GilbertElliott.Params(p=TO_BAD, r=0.25)), _BURSTY,
                        NS_PER_S // 1000)
        yield Check("p = 5 %, r = 25 %: loss", found["loss"], share, _ERRORS * error)


class FlappingAvailability:
    """Availability of ``flapping``: up / (up + down) within 3.3 standard errors, in which the state
    is forgotten at 1 / up + 1 / down."""

    source = "alternating renewal process"

    def checks(self, play: Play) -> Iterator[Check]:
        common = math.exp(-5 * (1 / 40 + 1 / 10))
        error = math.sqrt(0.8 * 0.2 * (1 + common) / (1 - common) / _FLAPPING)
        rule = Flapping(Flapping.Params(hosts=["b"], up="40 s", down=DOWN))
        found = _played(play, rule, _FLAPPING, 5 * NS_PER_S)
        yield Check("40 s up, 10 s down: available", 1 - found["loss"], 0.8, _ERRORS * error)


class Delays:
    """Delays of ``latency``, mean 50 ms and standard deviation 10 ms: the mean within 3.3 standard
    errors, and the one that 1 % exceed within 2 % of its distance from the mean (pareto: 5 %)."""

    source = "quantiles of the distributions; gamma of shape 25, pareto with exponent 3"

    _late = {"normal": (2.3263, 0.02), "exponential": (3.6052, 0.02),
             "gamma": (2.6154, 0.02), "pareto": (3.6276, 0.05)}  # in standard deviations

    def checks(self, play: Play) -> Iterator[Check]:
        for law, (late, share) in self._late.items():
            rule = Latency(Latency.Params(delay="50 ms", jitter=JITTER, distribution=law))
            found = _played(play, rule, _LATE, NS_PER_S // 5)
            yield Check(f"{law}: mean", found["delay_mean_ms"], 50.0,
                        _ERRORS * 10 / math.sqrt(_LATE), "ms")
            yield Check(f"{law}: 99 %", found["delay_p99_ms"], 50 + 10 * late, 10 * late * share,
                        "ms")


def _played(play: Play, rule: ports.Rule, frames: int, every_ns: int) -> Mapping[str, float]:
    """The measures of ``frames`` frames on one link."""
    flow = Flow("a", ("b",), 1000, 1000, "zero", every_ns)
    return play(Setup(Ideal(Ideal.Params()), {"a": NOWHERE, "b": NOWHERE}, [flow],
                      frames * every_ns, rules=[rule]))


class RoundTrip:
    """A round trip with 500 ms each way: exactly 1000 ms. (ROS-NetSim, which couples simulators in
    windows of time, measured 1008.736 ms.)"""

    source = "ROS-NetSim, README: 500 ms one way"

    def checks(self, play: Play) -> Iterator[Check]:
        flow = Flow("a", ("b",), 98, 56, "periodic", 1_000_000_000, echo=True)
        found = play(Setup(Ideal(Ideal.Params()), {"a": NOWHERE, "b": NOWHERE}, [flow],
                           10_000_000_000, rules=[Latency(Latency.Params(delay=EACH_WAY))]))
        yield Check("round trip: mean", found["delay_mean_ms"], 1000.0, 0.0, "ms")
        yield Check("round trip: 99 %", found["delay_p99_ms"], 1000.0, 0.0, "ms")
