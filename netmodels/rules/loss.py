"""Packets that get lost by chance, one by one or in bursts.

A radio repeats what it loses on the way; a residual loss is behind its MAC, and is not repeated.
"""

from __future__ import annotations

from pydantic import Field, model_validator

from desim import ports
from desim.units import Ratio
from netmodels.random_loss import PairStreams, drop, losses


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


class GilbertElliott:
    """Packets get lost in bursts, by a good and a bad state of each ordered pair of hosts. A packet
    is lost with the chance of the state, and after it the state changes with ``p`` (good to bad) or
    ``r`` (back): netem's ``gemodel p r 1-h 1-k`` (Gilbert 1960, Elliott 1963).

    Of all packets p / (p + r) find the bad state, so that
    (p * loss_bad + r * loss_good) / (p + r) are lost; the bad state lasts for 1 / r packets on the
    average. The first packet finds either state with these chances. The states change with packets,
    not with time.

    Capabilities: JudgesTransmissions.
    """

    class Params(ports.Params):
        p: Ratio = Field(description="chance that the good state ends with a packet")
        r: Ratio = Field(description="chance that the bad state ends with a packet")
        loss_bad: Ratio = Field(1.0, description="1-h, loss in the bad state (netem)")
        loss_good: Ratio = Field(0.0, description="1-k, loss in the good state (netem)")

        @model_validator(mode="after")
        def _moves(self) -> GilbertElliott.Params:
            if not self.p + self.r:
                raise ValueError("p or r must be above zero")
            return self

    reasons = ("burst_loss",)
    per_transmission = True

    def __init__(self, params: Params) -> None:
        self._loss = params.loss_good, params.loss_bad
        self._change = params.p, params.r
        self._bad_share = params.p / (params.p + params.r)

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._streams = PairStreams(context, "gilbert_elliott", hosts)
        self._bad: dict[tuple[int, int], bool] = {}

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        return [self._verdict(frame, receiver) for receiver in receivers]

    def _verdict(self, frame: ports.Frame, receiver: int) -> ports.Verdict:
        link = frame.source, receiver
        stream = self._streams(*link)
        bad = self._bad[link] if link in self._bad else bool(stream.random() < self._bad_share)
        lost = []
        draws = iter(stream.random(2 * frame.segments).tolist())
        for number, (loses, changes) in enumerate(zip(draws, draws, strict=True)):
            if loses < self._loss[bad]:
                lost.append(number)
            bad ^= changes < self._change[bad]
        self._bad[link] = bad
        return drop("burst_loss", lost, frame.segments) if lost else ports.PASS


class ResidualLoss(Loss):
    """``loss`` that a radio does not repeat: each packet is lost with ``probability``, however
    often it was transmitted."""

    per_transmission = False


class ResidualGilbertElliott(GilbertElliott):
    """``gilbert_elliott`` that a radio does not repeat: the states change with packets, however
    often they were transmitted."""

    per_transmission = False
