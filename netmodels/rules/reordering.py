"""Some frames are held back, and those behind overtake them."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Period, Ratio
from netmodels.rules.streams import PairStreams


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
