"""Unit-disk radio without contention: in range everything arrives, out of range nothing does."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import BitRate, Length
from netmodels.itemized import Itemized
from netmodels.queues import SenderQueues

_deliver = lru_cache(1 << 10)(ports.Deliver)  # an idle sender gives the same delays again


class Disk(Itemized):
    """Each sender's frames go out one after another at ``rate``, and nobody hinders anybody else.

    delay = wait behind the sender's own earlier frames + size * 8 / rate. Range is measured when
    the frame is given to the sender; propagation (0.7 us over 200 m) is left out. A host without
    a place is in reach of everybody. A broadcast's receivers out of range make one ``out_of_reach``
    row, a unicast frame's receiver is ``out_of_range``.

    Capabilities: Itemizes, LimitsReach, KnowsDepartures, KnowsLinks.
    """

    class Params(ports.Params):
        range_m: Length = Field("200 m", description="(the paper)")
        rate_bps: BitRate = Field("54 Mb/s", description="(802.11g nominal)")

    reasons = ("out_of_range", "out_of_reach")

    def __init__(self, params: Params) -> None:
        self.reach_m = params.range_m
        self._range_m2 = params.range_m ** 2
        self._rate_bps = params.rate_bps

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._outlets = SenderQueues(len(hosts), self._rate_bps, self._ledger)
        self._positions: np.ndarray | None = None  # until the next world tick the same object

    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``ports.KnowsLinks``: within range, every frame arrives."""
        places = self._context.positions(self._context.now_ns)
        apart = places[:, None] - places[None]
        near = ~(np.einsum("ijk,ijk->ij", apart, apart) > self._range_m2)
        np.fill_diagonal(near, False)
        one, other = np.nonzero(near)
        return one, other, np.ones(len(one))

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._outlets.departure_ns(host)

    def send(self, frame: ports.Frame) -> None:
        context, source = self._context, frame.source
        now_ns = context.now_ns
        arrive = _deliver(self._outlets.delay_ns(frame, now_ns))
        positions = context.positions(now_ns)
        if frame.broadcast:
            receivers = np.array(frame.receivers)
            apart = positions[receivers] - positions[source]
            far = np.einsum("ij,ij->i", apart, apart) > self._range_m2  # False for NaN
            context.settle_many(frame, receivers[~far].tolist(), arrive)
            context.settle_many(frame, receivers[far].tolist(), ports.Drop("out_of_reach"))
            return
        if positions is not self._positions:
            self._positions, self._places = positions, positions.tolist()
        x, y = self._places[source]
        for receiver in frame.receivers:
            other_x, other_y = self._places[receiver]
            dx, dy = other_x - x, other_y - y
            far = dx * dx + dy * dy > self._range_m2
            context.settle(frame, receiver, ports.Drop("out_of_range") if far else arrive)
