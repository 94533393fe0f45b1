"""Random loss of packets, with a random stream for each pair of hosts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from desim import ports

REASONS = ("out_of_range", "out_of_reach", "random_loss")


def losses(stream: np.random.Generator, segments: int, probability: float) -> Sequence[int]:
    """The numbers of the packets of a train that are lost, each with ``probability`` and
    independently. It draws once for each packet, so that where the probability rises, only more
    are lost."""
    if segments == 1:
        return () if stream.random() < 1.0 - probability else (0,)
    return np.flatnonzero(stream.random(segments) >= 1.0 - probability).tolist()


def drop(reason: str, packets: Sequence[int], segments: int) -> ports.Drop:
    """The verdict on a train of ``segments`` of which ``packets`` are lost."""
    return ports.Drop(reason, None if len(packets) == segments else tuple(packets))


class PairStreams:
    """A random stream for each ordered pair of hosts, named by ``use`` and the two. The k-th frame
    of a link draws the same numbers, no matter what others send or how hosts were declared."""

    def __init__(self, context: ports.RuleContext, use: str, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._use = use
        self._hosts = hosts
        self._streams: dict[tuple[int, int], np.random.Generator] = {}

    def __call__(self, source: int, receiver: int) -> np.random.Generator:
        stream = self._streams.get((source, receiver))
        if stream is None:
            stream = self._streams[source, receiver] = self._context.stream(
                self._use, self._hosts[source], self._hosts[receiver])
        return stream


class RandomLoss:
    """Settles frames whose packets get lost independently of each other. Each ordered pair of hosts
    draws from its own stream, once for each packet, whatever its chance."""

    def __init__(self, context: ports.Context, use: str, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._streams = PairStreams(context, use, hosts)

    def settle(self, frame: ports.Frame, chances: Iterable[float], delay_ns: int) -> None:
        """``chances`` that one packet arrives, receiver by receiver; where it is 0 the receiver is
        out of range. Packets arrive after ``delay_ns``."""
        arrived, lost, far = [], [], []
        context, source, segments = self._context, frame.source, frame.segments
        for receiver, chance in zip(frame.receivers, chances, strict=True):
            packets = losses(self._streams(source, receiver), segments, 1.0 - chance)
            if not chance:
                far.append(receiver)
            elif len(packets) == segments:
                lost.append(receiver)
            else:
                arrived.append(receiver)
                if packets:
                    context.settle(frame, receiver, ports.Drop("random_loss", tuple(packets)))
        beyond = ports.Drop("out_of_reach" if frame.broadcast else "out_of_range")
        for receivers, fate in ((arrived, ports.Deliver(delay_ns)),
                                (lost, ports.Drop("random_loss")), (far, beyond)):
            if receivers:
                context.settle_many(frame, receivers, fate)
