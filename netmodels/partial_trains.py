"""Settles a train without its lost packets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from desim import ports

_ARRIVED = ports.Deliver(0)


def settle_without(context: ports.Context, frame: ports.Frame, receiver: int,
                   lost: Mapping[str, Sequence[int]], arrives: ports.Deliver = _ARRIVED,
                   sent: int | None = None) -> None:
    """Settle ``frame`` at one receiver without the packets that are ``lost`` (by reason, their
    numbers, none of them twice): the others arrive, if there are any. ``sent``: the number of
    packets (None: all), where some have been named before."""
    left = frame.segments if sent is None else sent
    for reason, packets in lost.items():
        left -= len(packets)
        if packets:
            context.settle(frame, receiver, ports.Drop(reason, tuple(packets)))
    if left:
        context.settle(frame, receiver, arrives)
