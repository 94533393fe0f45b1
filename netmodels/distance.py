"""Delivery by distance, as a table of measurements has it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from pydantic import Field, field_validator

from desim import ports
from desim.units import BitRate, Duration, Length, Ratio
from netmodels.itemized import Itemized
from netmodels.queues import SenderQueues
from netmodels.random_loss import REASONS, RandomLoss


class Distance(Itemized):
    """Packets get lost by chance, the more the farther they go: delivery probability by distance.

    ``delivery`` is a table that somebody has measured: distance and chance of one packet, linear in
    between, that of the first distance up to there, and nothing beyond the last. Packets are lost
    independently of each other. Each ordered pair of hosts draws from its own stream. Distance is
    measured when the frame is given to the sender; a host without a place is at no distance.

    Each sender's frames go out one after another at ``rate``, and nobody hinders anybody else:
    delay = wait behind the sender's own earlier frames + size * 8 / rate + latency.

    Capabilities: Itemizes, LimitsReach, KnowsDepartures.
    """

    class Params(ports.Params):
        delivery: list[tuple[Length, Ratio]] = Field(min_length=1, max_length=10_000, description=(
            "distances, ascending, each with the chance of one packet: [[10 m, 99 %], [40 m, 0]]"))
        rate_bps: BitRate = Field("54 Mb/s", description="(802.11g nominal)")
        latency_ns: Duration = Field("0 ns", description="one way, after the last bit was sent "
                                                         "(none)")

        @field_validator("delivery", mode="after")
        @classmethod
        def _ascends(cls, rows: list[tuple[float, float]]) -> list[tuple[float, float]]:
            for (near_m, _), (far_m, _) in pairwise(rows):
                if near_m >= far_m:
                    raise ValueError(f"distances must ascend, got {far_m:g} m after {near_m:g} m")
            return rows

    reasons = REASONS

    def __init__(self, params: Params) -> None:
        self._distances_m, self._chances = np.array(params.delivery, float).T
        self._params = params
        self.reach_m = float(self._distances_m[-1])

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._outlets = SenderQueues(len(hosts), self._params.rate_bps, self._ledger)
        self._losses = RandomLoss(context, "distance", hosts)

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._outlets.departure_ns(host)

    def send(self, frame: ports.Frame) -> None:
        now_ns = self._context.now_ns
        places = self._context.positions(now_ns)
        apart = places[list(frame.receivers)] - places[frame.source]
        distances_m = np.fmax(np.sqrt(np.einsum("ij,ij->i", apart, apart)), 0.0)  # NaN: 0
        chances = np.interp(distances_m, self._distances_m, self._chances, right=0.0)
        delay_ns = self._outlets.delay_ns(frame, now_ns) + self._params.latency_ns
        self._ledger.spent(frame, ports.TimePart.PROPAGATION, self._params.latency_ns)
        self._losses.settle(frame, chances.tolist(), delay_ns)
