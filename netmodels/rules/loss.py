"""Packets get lost by chance."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Ratio
from netmodels.rules.streams import PairStreams


class Loss:
    """Each packet is lost with ``probability``, independently of all others (Bernoulli); a train
    with one lost packet is lost: 1 - (1 - probability)^segments. Each ordered pair of hosts draws
    from its own stream."""

    class Params(ports.Params):
        probability: Ratio = Field(description="of one packet at one receiver")

    reasons = ("random_loss",)

    def __init__(self, params: Params) -> None:
        self._survival = 1.0 - params.probability

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "loss", hosts)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        survival = self._survival ** frame.segments
        return [ports.PASS if self._streams(frame.source, receiver).random() < survival
                else ports.Drop("random_loss") for receiver in receivers]
