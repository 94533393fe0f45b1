"""Radios without contention: each has the air to itself."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from desim import ports
from netmodels.ethernet import FULL_BYTES
from netmodels.itemized import Itemized
from netmodels.partial_trains import settle_without
from netmodels.queues import QueuedTrain, admit
from netmodels.radio.budget import Budget
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.delivery import sensitivity_dbm
from netmodels.radio.path_loss import reach_m
from netmodels.radio.standards import (
    ACK_BYTES,
    CTS_BYTES,
    RTS_BYTES,
    Standard,
    psdu_bytes,
)

SHARE = 0.9  # of full packets that arrive at the end of the range (network.fidelity: disk)


class NearbyHosts:
    """The hosts within range of each other, as of a moment at most ``update_ns`` ago."""

    def __init__(self, budget: Budget, context: ports.Context, update_ns: int) -> None:
        self.budget, self._context, self._update_ns = budget, context, update_ns
        self._updated_ns, self._epoch, self._places = 0, -1, np.empty((0, 2))
        self._people: np.ndarray | None = None

    def of(self, host: int) -> list[int]:
        """The hosts near to this one, ascending."""
        self._update()
        near = self._near.get(host)
        if near is None:
            near = self._near[host] = self._links.finders(host)
        return near

    def _update(self) -> None:
        now_ns = self._context.now_ns
        places, obstacles = self._context.positions(now_ns), self._context.obstacles
        if obstacles.epoch == self._epoch and (
                (places is self._places and obstacles.people is self._people)
                or now_ns < self._updated_ns + self._update_ns):
            return
        self._updated_ns, self._places, self._epoch = now_ns, places, obstacles.epoch
        self._people = obstacles.people
        self._links = self.budget.links(places, obstacles)
        self._near: dict[int, list[int]] = {}


class Uncontended(Itemized):
    """Radios with the parameters, times and queues of ``DcfRadio``, each with the air to itself: no
    contention, no collisions, no losses. A frame arrives where ``DcfRadio`` would deliver 90 % at
    the received power, and nowhere else. ``open_air``: as if there were neither walls nor
    shadowing nor people.

    A packet takes as long as ``DcfRadio``'s in an idle medium (without ``aggregation`` and the
    header of QoS, of which it knows nothing), and the next one of the same sender
    waits for acknowledgement, DIFS and a backoff of the mean length. The range is that of the
    moment when a frame is given to the sender: of unicast frames where a full packet (1518 B with
    Ethernet's headers) arrives at 90 % within its ``retries``, of broadcasts the same at once.
    Rules of loss and jamming, asked at that moment too, act on each transmission: of unicast
    packets they are repeated, and take the sender's time.

    Capabilities: LimitsReach, Separates, Retransmits, Refuses, Itemizes, PredictsSignal,
    HearsAntennas, KnowsDepartures.
    """

    Params = DcfRadio.Params
    reasons = ("expired", "out_of_range", "out_of_reach", "queue_full", "retry_limit")
    refuses = ("expired", "queue_full")
    judges_transmissions = True

    def __init__(self, params: DcfRadio.Params, open_air: bool) -> None:
        standard = params.of_standard()
        self._params, self._open_air = params, open_air
        self._lifetime_ns = params.constants.lifetime_ns
        self._rates = params.rates()
        full_bytes, reception = psdu_bytes(FULL_BYTES, 1), params.receiver()
        self.sensitivity_dbm = tuple(  # of unicast and of broadcast
            max(params.reception.constants.heard_dbm,
                sensitivity_dbm(SHARE, standard, rate, full_bytes, reception, tries,
                                params.fading))
            for rate, tries in zip(self._rates, (params.retries, 1), strict=True))
        self.reach_m = self._reach_m(params.power_dbm)
        self._times = lru_cache(1 << 12)(lambda size_bytes, segments, broadcast: times_ns(
            standard, self._rates[broadcast], ports.packet_sizes(size_bytes, segments), broadcast,
            params.rts_bytes))

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._params = params = self._params.beside(context.obstacles)
        if self._open_air:
            params = params.model_copy(update={"walls": None, "shadowing": None, "people": False})
        budget = params.budget(context, hosts, *self.sensitivity_dbm)
        self.reach_m = self._reach_m(budget.strongest_dbm)
        self._near = [NearbyHosts(replace(budget, heard_dbm=level_dbm, found_dbm=level_dbm),
                                  context, params.update_ns)
                      for level_dbm in self.sensitivity_dbm]
        self._ends_ns: list[deque[int]] = [deque() for _ in hosts]  # of packets that wait there

    @property
    def range_m(self) -> tuple[float, ...]:
        """In the open, of unicast and of broadcast frames."""
        return tuple(reach_m(self._params.loss(), self._params.power_dbm - level_dbm)
                     for level_dbm in self.sensitivity_dbm)

    def _reach_m(self, power_dbm: float) -> float:
        params = self._params
        best_db = params.shadowing.best_db if params.shadowing and not self._open_air else 0.0
        return reach_m(params.loss(), power_dbm + best_db - min(self.sensitivity_dbm))

    def send(self, frame: ports.Frame) -> None:
        context, ends_ns = self._context, self._ends_ns[frame.source]
        now_ns = context.now_ns
        while ends_ns and ends_ns[0] <= now_ns:
            ends_ns.popleft()
        wait_ns = ends_ns[-1] - now_ns if ends_ns else 0
        if self._lifetime_ns is not None and wait_ns > self._lifetime_ns:
            context.settle_many(frame, frame.receivers, ports.Drop("expired"))
            return
        train = admit(context, frame, self._params.queue - len(ends_ns))
        if train is None:
            return
        packets = train.packets
        arrives_ns, free_ns, air_ns = self._times(train.size_bytes, packets, frame.broadcast)
        near = frame.among(self._near[frame.broadcast].of(frame.source))
        judge = context.judge_transmission
        lost, repeated = self._tried(judge, train, near) if judge else ({}, 0)
        again_ns = repeated * (free_ns // packets)
        ends_ns.extend(now_ns + wait_ns + (free_ns + again_ns) * number // packets
                       for number in range(1, packets + 1))
        arrive = ports.Deliver(wait_ns + arrives_ns + again_ns)
        spent, part = self._ledger.spent, ports.TimePart
        spent(frame, part.QUEUE, wait_ns)
        spent(frame, part.CONTENTION, arrives_ns - air_ns)
        spent(frame, part.RETRANSMISSION, again_ns)
        spent(frame, part.AIRTIME, air_ns)
        for receiver, missing in lost.items():
            settle_without(context, frame, receiver, missing, arrive, sent=packets)
        context.settle_many(frame, [receiver for receiver in near if receiver not in lost], arrive)
        if frame.broadcast:
            context.settle_many(frame, None, ports.Drop("out_of_reach"))
        elif not near:
            context.settle(frame, frame.receivers[0], ports.Drop("out_of_range"))

    def _tried(self, judge: Callable[[ports.Frame, int], ports.Drop | None], train: QueuedTrain,
               near: list[int]) -> tuple[dict[int, dict[str, list[int]]], int]:
        """The packets that rules take at the receivers ``near``, by reason; and how many
        transmissions are repeated."""
        frame = train.frame
        tries = 1 if frame.broadcast else self._params.retries
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        lost: dict[int, dict[str, list[int]]] = {}
        repeated = 0
        for receiver in near:
            for number, size_bytes in enumerate(sizes[:train.packets]):
                packet = frame._replace(receivers=(receiver,), size_bytes=size_bytes, segments=1)
                failed, reason = 0, "retry_limit"
                while failed < tries and (drop := judge(packet, receiver)):
                    failed += 1
                    reason = drop.reason if frame.broadcast else reason
                repeated += min(failed, tries - 1)
                if failed == tries:
                    lost.setdefault(receiver, {}).setdefault(reason, []).append(number)
        return lost, repeated

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        ends_ns = self._ends_ns[host]
        return ends_ns[-1] if ends_ns else 0

    def signal(self, from_m: np.ndarray, to_m: np.ndarray) -> ports.Signal:
        """``ports.PredictsSignal``: delivery is all or nothing."""
        power_dbm = self._near[0].budget.received_dbm(from_m, to_m, self._context.obstacles)
        return ports.Signal(power_dbm, 1.0 * (power_dbm >= self.sensitivity_dbm[0]))

    def link_signal(self, sender: int, receiver: int, ends_m: np.ndarray,
                    obstacles: ports.Obstacles) -> ports.Signal:
        """``ports.HearsAntennas``: delivery is all or nothing."""
        power_dbm = self._near[0].budget.link_dbm(sender, receiver, ends_m, obstacles)
        return ports.Signal(power_dbm, 1.0 * (power_dbm >= self.sensitivity_dbm[0]))

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        return not any(other in near.of(host) for near in self._near)


def times_ns(standard: Standard, rate: int, sizes_bytes: tuple[int, ...], broadcast: bool,
             rts_bytes: int | None) -> tuple[int, int, int]:
    """Times from the beginning of a frame of such packets to its arrival, and to the beginning of
    the next frame; and for how long its packets are on the air."""
    airtime_ns, lowest = standard.airtime_ns, standard.lowest(rate)
    before_ns = after_ns = 0
    if not broadcast:
        after_ns = standard.sifs_ns + airtime_ns(ACK_BYTES, standard.reply_rate(rate))
        if rts_bytes is not None and psdu_bytes(sizes_bytes[0], 1) > rts_bytes:
            before_ns = (airtime_ns(RTS_BYTES, lowest) + airtime_ns(CTS_BYTES, lowest)
                         + 2 * standard.sifs_ns)
    first_ns, last_ns = (airtime_ns(psdu_bytes(size_bytes, 1), rate)
                         for size_bytes in (sizes_bytes[0], sizes_bytes[-1]))
    backoff_ns = standard.cw_min * standard.slot_ns // 2
    between_ns = after_ns + standard.difs_ns + backoff_ns
    others = len(sizes_bytes) - 1
    arrives_ns = others * (before_ns + first_ns + between_ns) + before_ns + last_ns
    return arrives_ns, arrives_ns + between_ns, others * first_ns + last_ns
