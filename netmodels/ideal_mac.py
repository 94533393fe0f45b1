"""An ideal medium access, which knows who sends and who listens anywhere."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from pydantic import Field, model_validator

from desim import ports
from desim.units import BitRate, Length, airtime_ns
from netmodels.itemized import FrameTimes, Itemized
from netmodels.queues import QueuedTrain, admit
from netmodels.shared_disk import UnitDiskRadio, check_reaches, mask, settle


class _Sending(NamedTuple):
    """A train on the air, and the hosts (bit masks) that get it, that cannot hear anything else
    meanwhile, and that must not send."""

    train: QueuedTrain
    got: int
    deaf: int
    quiet: int


class IdealMac(Itemized, UnitDiskRadio):
    """Radios that share the air without collisions, backoff or acknowledgements, as if a scheduler
    knew everything: a frame begins as soon as it hinders no other one and no other one hinders it
    (the protocol model of Gupta and Kumar 2000), and of the waiting hosts the one that has been
    silent for longest goes first.

    A frame arrives within ``range`` after size * 8 / ``rate``, and hinders hosts within
    ``interference`` that listen to another one. A train is one long frame. Places are those at the
    beginning of a frame. A host without a place hears nobody, and nobody hears it.

    Capabilities: LimitsReach, Refuses, Itemizes, KnowsLinks.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("54 Mb/s", description="(802.11g nominal)")
        range_m: Length = Field("200 m", description="(the paper)")
        interference_m: Length = Field("400 m", description="of a frame with others, as far or "
                                                            "farther (two hops; Li et al. 2001: "
                                                            "2.2 ranges)")
        queue: int = Field(500, ge=1, le=10_000, description="packets that wait at a sender (as "
                                                              "the radio)")

        @model_validator(mode="after")
        def _reaches(self) -> IdealMac.Params:
            check_reaches(self.range_m, self.interference_m)
            return self

    reasons = ("out_of_range", "out_of_reach", "queue_full")
    refuses = ("queue_full",)

    def __init__(self, params: Params) -> None:
        super().__init__(params.range_m, params.interference_m)
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().start(context, hosts)
        self._queues: list[deque[QueuedTrain]] = [deque() for _ in hosts]
        self._since_ns = [0] * len(hosts)  # silent
        self._waiting: set[int] = set()
        self._air: dict[int, _Sending] = {}
        self._booked = False
        self._times = FrameTimes.of(self._ledger)

    def send(self, frame: ports.Frame) -> None:
        queue, source = self._queues[frame.source], frame.source
        waiting = sum(train.packets for train in queue)
        train = admit(self._context, frame, self._params.queue - waiting)
        if train is None:
            return
        queue.append(train)
        self._times.begin(frame, self._context.now_ns)
        if source not in self._air:
            self._waiting.add(source)
            self._book()

    def _book(self) -> None:
        """Book one call for all that is sent, or over, in this instant."""
        if not self._booked:
            self._booked = True
            self._context.at(self._context.now_ns, self._begin)

    def _begin(self, _: None) -> None:
        self._booked = False
        self._refresh()
        deaf = quiet = 0
        for sending in self._air.values():
            deaf |= sending.deaf
            quiet |= sending.quiet
        since_ns = self._since_ns
        for host in sorted(self._waiting, key=lambda host: (since_ns[host], host)):
            sending = self._reserve(self._queues[host][0])
            if not (quiet >> host & 1 or sending.got & deaf):
                deaf |= sending.deaf
                quiet |= sending.quiet
                self._transmit(host, sending)

    def _reserve(self, train: QueuedTrain) -> _Sending:
        frame = train.frame
        reached, disturbed = self._reached, self._disturbed
        got = reached[frame.source] & mask(frame.receivers)
        quiet = 0
        for receiver in frame.receivers:
            if got >> receiver & 1:
                quiet |= disturbed[receiver]
        return _Sending(train, got, disturbed[frame.source], quiet)

    def _transmit(self, host: int, sending: _Sending) -> None:
        self._queues[host].popleft()
        self._waiting.remove(host)
        self._air[host] = sending
        context = self._context
        self._times.until(sending.train.frame, ports.TimePart.CONTENTION, context.now_ns)
        context.at(context.now_ns + airtime_ns(sending.train.size_bytes, self._params.rate_bps),
                   self._end, host)

    def _end(self, host: int) -> None:
        (frame, _, _), got, _, _ = self._air.pop(host)
        self._since_ns[host] = now_ns = self._context.now_ns
        if self._queues[host]:
            self._waiting.add(host)
            self._times.until(self._queues[host][0].frame, ports.TimePart.QUEUE, now_ns)
        self._times.until(frame, ports.TimePart.AIRTIME, now_ns)
        self._times.end(frame)
        if self._waiting:
            self._book()
        settle(self._context, frame, got, 0)
