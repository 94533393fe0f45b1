"""500 ms there and 500 ms back."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from netmodels.ideal import Ideal
from netmodels.rules.latency import Latency

DELAY = "500 ms"


class RoundTrip:
    """A round trip with 500 ms each way: exactly 1000 ms. (ROS-NetSim, which couples simulators in
    windows of time, measured 1008.736 ms.)"""

    source = "ROS-NetSim, README: 500 ms one way"

    def checks(self, play: Play) -> Iterator[Check]:
        flow = Flow("a", ("b",), 98, 56, "periodic", 1_000_000_000, echo=True)
        found = play(Setup(Ideal(Ideal.Params()), {"a": NOWHERE, "b": NOWHERE}, [flow],
                           10_000_000_000, rules=[Latency(Latency.Params(delay=DELAY))]))
        yield Check("round trip: mean", found["delay_mean_ms"], 1000.0, 0.0, "ms")
        yield Check("round trip: 99 %", found["delay_p99_ms"], 1000.0, 0.0, "ms")
