"""The common part of ``ideal_mac`` and ``tdma``: unit-disk radios that share the air.

Bit k of a set stands for host k.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from desim import ports
from netmodels.partial_trains import settle_without

_ARRIVED = ports.Deliver(0)


class UnitDiskRadio:
    """The common part of radios on the unit disk. A frame gets as far as ``range_m``, to the hosts
    that are ``_reached``, and disturbs others (``_disturbed``) as far as ``interference_m``; both
    are bit masks by sender. A host without a place is near nobody but itself."""

    def __init__(self, range_m: float, interference_m: float) -> None:
        self.reach_m = range_m
        self._interference_m = interference_m

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._places: np.ndarray | None = None

    def _refresh(self) -> None:
        """Follow the hosts to their present places, before ``_reached`` and ``_disturbed`` are
        read."""
        places = self._context.positions(self._context.now_ns)
        if places is self._places:
            return
        self._places = places
        apart = places[:, None] - places[None]
        apart_m2 = np.einsum("ijk,ijk->ij", apart, apart)
        np.fill_diagonal(apart_m2, 0.0)
        self._near = apart_m2 <= self.reach_m ** 2
        disturbed = apart_m2 <= self._interference_m ** 2
        self._reached, self._disturbed = _masks(self._near), _masks(disturbed | self._near)

    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``ports.KnowsLinks``: within range, every frame arrives."""
        self._refresh()
        one, other = np.nonzero(self._near)
        apart = one != other
        return one[apart], other[apart], np.ones(int(apart.sum()))


def _masks(near: np.ndarray) -> list[int]:
    return [int.from_bytes(row.tobytes(), "little")
            for row in np.packbits(near, axis=1, bitorder="little")]


def mask(hosts: Iterable[int]) -> int:
    """The bit mask of these hosts."""
    return sum(1 << host for host in hosts)


def settle(context: ports.Context, frame: ports.Frame, got: int, corrupted: int) -> None:
    """Settle ``frame``: it has arrived at the hosts in ``got``, and was lost at ``corrupted``."""
    if not frame.broadcast:
        (receiver,) = frame.receivers
        context.settle(frame, receiver, _ARRIVED if got else ports.Drop(
            "collision" if corrupted else "out_of_range"))
        return
    for hosts, fate in (got, _ARRIVED), (corrupted, ports.Drop("collision")):
        receivers = [receiver for receiver in frame.receivers if hosts >> receiver & 1]
        if receivers:
            context.settle_many(frame, receivers, fate)
    context.settle_many(frame, None, ports.Drop("out_of_reach"))


def settle_train(context: ports.Context, frame: ports.Frame, sent: Sequence[tuple[int, int]]
                 ) -> None:
    """Settle a train. ``sent``: of each packet that was sent, the hosts that got it and those where
    it was corrupted."""
    got, corrupted = sent[0]
    if all(packet == (got, corrupted) for packet in sent):
        settle(context, frame, got, corrupted)
        return
    always = ever = got
    for own, broken in sent:
        always, ever = always & own, ever | own | broken
    beyond = "out_of_reach" if frame.broadcast else "out_of_range"
    arrived = [receiver for receiver in frame.receivers if always >> receiver & 1]
    for receiver in frame.receivers:
        if (ever & ~always) >> receiver & 1:
            settle_without(context, frame, receiver, {
                "collision": [k for k, (_, broken) in enumerate(sent) if broken >> receiver & 1],
                beyond: [k for k, (own, broken) in enumerate(sent)
                         if not (own | broken) >> receiver & 1]}, sent=len(sent))
    context.settle_many(frame, arrived, _ARRIVED)
    if frame.broadcast:
        context.settle_many(frame, None, ports.Drop(beyond))


def check_reaches(range_m: float, interference_m: float) -> None:
    """Raises ValueError for interference that ends within the range."""
    if interference_m < range_m:
        raise ValueError(f"interference ({interference_m:g} m) is less than range "
                         f"({range_m:g} m); who is near enough to get a frame is near "
                         "enough to be disturbed")
