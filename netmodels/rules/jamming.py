"""A jammer destroys packets that are sent or received near it."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Length, Position, Ratio
from netmodels.random_loss import PairStreams, drop, losses


class Jamming:
    """From ``from`` until ``until`` each packet whose sender or receiver stands no farther than
    ``radius`` from ``at`` is lost with ``probability``. Walls do not matter, and a host without a
    place is nowhere near. Each ordered pair of hosts draws from its own stream for each packet,
    jammed or not: with a larger disc only more is lost.

    Capabilities: Separates, JudgesTransmissions.
    """

    class Params(ports.TimeWindow):
        at_m: tuple[Position, Position] = Field(
            examples=[["3 m", "-2.5 m"]], description="x and y of the middle of the disc")
        radius_m: Length = Field(gt=0, examples=["10 m"],
                                 description="of the disc, its edge included")
        probability: Ratio = Field(1.0, description="of one packet at one receiver (all)")

    reasons = ("jammed",)
    per_transmission = True

    def __init__(self, params: Params) -> None:
        self._params = params
        self._probability = params.probability

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._streams = PairStreams(context, "jamming", hosts)
        self._positions: np.ndarray | None = None  # the same object until somebody moves

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict]:
        source, segments = frame.source, frame.segments
        drawn = [losses(self._streams(source, receiver), segments, self._probability)
                   for receiver in receivers]
        jams = self._jams()
        return [drop("jammed", lost, segments) if lost and (jams[source] or jams[receiver])
                else ports.PASS for receiver, lost in zip(receivers, drawn, strict=True)]

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        jams = self._jams()
        return self._probability == 1.0 and (jams[host] or jams[other])

    def _jams(self) -> list[bool]:
        """At which hosts it is felt now."""
        now_ns = self._context.now_ns
        positions = self._context.positions(now_ns)
        if not self._params.holds(now_ns):
            return [False] * len(positions)
        if positions is not self._positions:
            self._positions = positions
            apart = positions - np.array(self._params.at_m)
            self._inside = (np.einsum("ij,ij->i", apart, apart)
                            <= self._params.radius_m ** 2).tolist()  # False for NaN
        return self._inside


class ResidualJamming(Jamming):
    """``jamming`` that a radio does not repeat: each packet is lost with ``probability``, however
    often it was transmitted."""

    per_transmission = False
