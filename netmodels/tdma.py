"""TDMA: each host has slots of its own."""

from __future__ import annotations

import re
from collections import deque
from typing import NamedTuple

from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import BitRate, Length, Period, airtime_ns
from netmodels.itemized import FrameTimes, Itemized
from netmodels.queues import admit
from netmodels.shared_disk import UnitDiskRadio, check_reaches, mask, settle_train


class _SlottedTrain(NamedTuple):
    """The first ``packets`` of a frame in a queue; of each that was sent, who got it and where it
    was corrupted."""

    frame: ports.Frame
    packets: int
    sent: list[tuple[int, int]]


class Tdma(Itemized, UnitDiskRadio):
    """Time division: a cycle of slots, each long enough for one packet, and each host sends in its
    own one. Hosts with the same slot send at the same time: far apart that is reuse, and nearer it
    is a ``collision`` at the hosts that hear both.

    A packet arrives within ``range`` at the end of its slot, unless somebody else sends within
    ``interference`` of the receiver, or the receiver does. A train takes as many of its sender's
    slots as it has packets, each with a fate of its own. Clocks are in step; nothing is
    acknowledged. Places are those at the end of a slot. A host without a place hears nobody,
    and nobody hears it.

    Capabilities: LimitsReach, Refuses, Itemizes, KnowsLinks.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("54 Mb/s", description="(802.11g nominal)")
        slot_ns: Period = Field("250 us", description="(225 us of a full packet at 54 Mb/s, and "
                                                      "10 % between them)")
        cycle: int = Field(30, ge=1, le=10_000, description="slots until it is one's turn again "
                                                             "(the paper's fleet)")
        slots: dict[str, int] = Field({}, description="by host, 0 is the cycle's first (the number "
                                                      "at the end of its name, modulo the cycle)")
        range_m: Length = Field("200 m", description="(the paper)")
        interference_m: Length = Field("400 m", description="of a frame with others, as far or "
                                                            "farther (two hops)")
        queue: int = Field(500, ge=1, le=10_000, description="packets that wait at a sender (as "
                                                              "the radio)")

        @model_validator(mode="after")
        def _reaches(self) -> Tdma.Params:
            check_reaches(self.range_m, self.interference_m)
            return self

    reasons = ("collision", "out_of_range", "out_of_reach", "queue_full", "too_long")
    refuses = ("queue_full", "too_long")

    def __init__(self, params: Params) -> None:
        super().__init__(params.range_m, params.interference_m)
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` for slots that do not exist, or of hosts that do not."""
        params = self._params
        for host, slot in params.slots.items():
            if host not in hosts:
                raise InputError(f".slots: no host {host!r}{did_you_mean(host, hosts)}")
            if not 0 <= slot < params.cycle:
                raise InputError(f".slots.{host}: {slot} is no slot; allowed: 0 to "
                                 f"{params.cycle - 1}")
        super().start(context, hosts)
        self._slot = [params.slots.get(host, _number(host) % params.cycle) for host in hosts]
        self._queues: list[deque[_SlottedTrain]] = [deque() for _ in hosts]
        self._senders: dict[int, list[int]] = {}  # by number of the slot since time 0
        self._times = FrameTimes.of(self._ledger)

    def send(self, frame: ports.Frame) -> None:
        params, queue = self._params, self._queues[frame.source]
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        if airtime_ns(sizes[0], params.rate_bps) > params.slot_ns:
            self._context.settle_many(frame, frame.receivers, ports.Drop("too_long"))
            return
        waiting = sum(train.packets - len(train.sent) for train in queue)
        train = admit(self._context, frame, params.queue - waiting)
        if train is not None:
            queue.append(_SlottedTrain(frame, train.packets, []))
            self._times.begin(frame, self._context.now_ns)
            if len(queue) == 1:
                self._book(frame.source, -(-self._context.now_ns // params.slot_ns))

    def _book(self, host: int, earliest: int) -> None:
        """The host's next slot from number ``earliest`` on is used."""
        number = earliest + (self._slot[host] - earliest) % self._params.cycle
        senders = self._senders.setdefault(number, [])
        if not senders:
            self._context.at((number + 1) * self._params.slot_ns, self._end, number)
        senders.append(host)

    def _end(self, number: int) -> None:
        """The end of a slot: note who got each packet, book the next slots, and only then settle,
        since a settled frame may let its sender send again."""
        self._refresh()
        reached, disturbed = self._reached, self._disturbed
        senders, over = sorted(self._senders.pop(number)), []
        for host in senders:
            queue = self._queues[host]
            waiting, corrupted = queue[0], 0
            for other in senders:
                if other != host:
                    corrupted |= disturbed[other]
            near = reached[host] & mask(waiting.frame.receivers)
            self._stamp(waiting, number)
            waiting.sent.append((near & ~corrupted, near & corrupted))
            if len(waiting.sent) == waiting.packets:
                queue.popleft()
                over.append(waiting)
                if queue:
                    self._times.until(queue[0].frame, ports.TimePart.QUEUE, self._context.now_ns)
            if queue:
                self._book(host, number + 1)
        for waiting in over:
            settle_train(self._context, waiting.frame, waiting.sent)

    def _stamp(self, waiting: _SlottedTrain, number: int) -> None:
        """The next packet has been sent in slot ``number``."""
        params, frame, packet = self._params, waiting.frame, len(waiting.sent)
        times = self._times
        begin_ns = number * params.slot_ns
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        times.until(frame, ports.TimePart.CONTENTION, begin_ns)
        times.until(frame, ports.TimePart.AIRTIME,
                    begin_ns + airtime_ns(sizes[packet], params.rate_bps))
        times.until(frame, ports.TimePart.CONTENTION, begin_ns + params.slot_ns)
        if packet + 1 == waiting.packets:
            times.end(frame)


def _number(host: str) -> int:
    found = re.search(r"\d+$", host)
    return int(found.group()) if found else 0
