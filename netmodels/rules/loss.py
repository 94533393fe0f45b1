"""Packets get lost by chance."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Ratio
from netmodels.random_loss import drop, losses
from netmodels.rules.streams import PairStreams


class Loss:
    """Each packet is lost with ``probability``, independently of all others (Bernoulli). Each
    ordered pair of hosts draws from its own stream, once for each packet.

    Capabilities: JudgesTransmissions.
    """

    class Params(ports.Params):
        probability: Ratio = Field(description="of one packet at one receiver")

    reasons = ("random_loss",)
    per_transmission = True

    def __init__(self, params: Params) -> None:
        self._probability = params.probability

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "loss", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [self._verdict(frame, receiver) for receiver in receivers]

    def _verdict(self, frame: ports.Frame, receiver: int) -> ports.Verdict:
        stream = self._streams(frame.source, receiver)
        lost = losses(stream, frame.segments, self._probability)
        return drop("random_loss", lost, frame.segments) if lost else ports.PASS
