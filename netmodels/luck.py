"""Links on which packets get lost by chance."""

from __future__ import annotations

from collections.abc import Iterable

from desim import ports
from netmodels.rules.streams import PairStreams

REASONS = ("out_of_range", "out_of_reach", "random_loss")

_LOST = ports.Drop("random_loss")


class Luck:
    """Settles frames whose packets get lost independently of each other; a train with one lost
    packet is lost. Each ordered pair of hosts draws from its own stream, once for each frame,
    whatever its chance: where chances rise, only more arrives."""

    def __init__(self, context: ports.Context, use: str, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._streams = PairStreams(context, use, hosts)

    def settle(self, frame: ports.Frame, chances: Iterable[float], delay_ns: int) -> None:
        """``chances`` of one packet, receiver by receiver; where it is 0 the receiver is out of
        range. What arrives does so after ``delay_ns``."""
        arrived, lost, far = [], [], []
        streams, source, packets = self._streams, frame.source, frame.segments
        for receiver, chance in zip(frame.receivers, chances, strict=True):
            lucky = streams(source, receiver).random() < chance ** packets
            (arrived if lucky else lost if chance else far).append(receiver)
        beyond = ports.Drop("out_of_reach" if frame.broadcast else "out_of_range")
        for receivers, fate in ((arrived, ports.Deliver(delay_ns)), (lost, _LOST), (far, beyond)):
            if receivers:
                self._context.settle_many(frame, receivers, fate)
