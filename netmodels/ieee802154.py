"""IEEE 802.15.4 at 2.4 GHz: unslotted CSMA-CA, with packets of IP in fragments of 6LoWPAN."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from pydantic import Field, model_validator

from desim import ports
from desim.units import Length
from netmodels.ieee802154_frames import (
    ACK_NS,
    ACK_WAIT_NS,
    CCA_NS,
    MOST_BYTES,
    TURNAROUND_NS,
    UNIT_NS,
    frame_ns,
    psdus,
    space_ns,
)
from netmodels.itemized import FrameTimes, Itemized
from netmodels.packet_fates import PacketFates
from netmodels.queues import admit
from netmodels.sensed_air import Sending, SensedAir
from netmodels.shared_disk import check_reaches


@dataclass(eq=False)
class _Packet:
    """A packet in its sender's queue; of its frames the first is being sent. ``missed``: receivers
    that have not got all frames so far, with the reason. ``over``: its fate is known."""

    fates: PacketFates
    number: int
    psdus: deque[int]
    missed: dict[int, str] = field(default_factory=dict)
    over: bool = False


@dataclass(eq=False)
class _Access:
    """The state of a sender's CSMA-CA: busy assessments and the backoff exponent of the present
    attempt, and attempts without an acknowledgement."""

    busy: int = 0
    exponent: int = 0
    failed: int = 0


class Ieee802154(Itemized, SensedAir):
    """IEEE 802.15.4 without beacons (Zigbee, Thread): 250 kb/s, up to 127 B a frame, and no mesh.

    A sender waits 0 to 2^BE - 1 units of 320 us, assesses the channel for 128 us, turns around
    within 192 us and sends. Each busy assessment increments BE, from ``min_be`` to ``max_be``;
    after ``backoffs`` more than one it gives up (``channel_busy``). A unicast frame is
    acknowledged, and repeated up to ``retries`` times (``retry_limit``); broadcasts are not
    (``collision``, ``out_of_reach``). Energy within ``interference`` makes the channel busy and
    destroys what overlaps; farther senders are hidden. An acknowledgement is not sensed before it
    begins, so that others may begin as well.

    Packets longer than a frame go as fragments of 6LoWPAN, and are lost with any of them. Of
    headers, 46 B of Ethernet, IP and UDP are 9 B (RFC 6282). Places are those at the begin of a
    frame. A host without a place hears nobody, and nobody hears it. Not modelled: channel errors,
    sleeping receivers, time limits of reassembly, IPv6's MTU of 1280 B.

    Capabilities: LimitsReach, Refuses, Itemizes, KnowsLinks, CountsAttempts.
    """

    class Params(ports.Params):
        range_m: Length = Field("30 m", description=(
            "(0 dBm to the -85 dBm that the standard asks for: 45 dB beyond the 40 dB of the first "
            "metre, exponent 3)"))
        interference_m: Length = Field("60 m", description=(
            "of a frame with others, and how far off senders are heard (two hops)"))
        min_be: int = Field(3, ge=0, le=8, description="(macMinBE)")
        max_be: int = Field(5, ge=3, le=8, description="(macMaxBE)")
        backoffs: int = Field(4, ge=0, le=5, description="(macMaxCSMABackoffs)")
        retries: int = Field(3, ge=0, le=7, description="(macMaxFrameRetries)")
        queue: int = Field(16, ge=1, le=10_000, description=(
            "packets that wait at a sender (our choice)"))

        @model_validator(mode="after")
        def _fits(self) -> Ieee802154.Params:
            check_reaches(self.range_m, self.interference_m)
            if self.min_be > self.max_be:
                raise ValueError(f"min_be ({self.min_be}) is more than max_be ({self.max_be})")
            return self

    reasons = ("channel_busy", "collision", "out_of_reach", "queue_full", "retry_limit", "too_long")
    refuses = ("queue_full", "too_long")

    def __init__(self, params: Params) -> None:
        super().__init__(params.range_m, params.interference_m, CCA_NS)
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().start(context, hosts)
        self._draws = [context.stream("backoff", host) for host in hosts]
        self._queues: list[deque[_Packet]] = [deque() for _ in hosts]
        self._access = [_Access() for _ in hosts]
        self._free_ns = [0] * len(hosts)  # the end of the space behind the last frame
        self._replies_ns = [0] * len(hosts)  # until when a host is about to acknowledge
        self._sent = self._unanswered = 0
        self._times = FrameTimes.of(self._ledger)

    def attempts(self) -> tuple[int, int]:
        """``ports.CountsAttempts``."""
        return self._sent, self._unanswered

    def send(self, frame: ports.Frame) -> None:
        queue, source = self._queues[frame.source], frame.source
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        if sizes[0] > MOST_BYTES:
            self._context.settle_many(frame, frame.receivers, ports.Drop("too_long"))
            return
        train = admit(self._context, frame, self._params.queue - len(queue))
        if train is None:
            return
        self._times.begin(frame, self._context.now_ns)
        fates, idle = PacketFates(frame, frame.receivers, train.packets), not queue
        queue.extend(_Packet(fates, number, deque(psdus(sizes[number])))
                     for number in range(train.packets))
        if idle:
            self._book(source)

    def _book(self, host: int) -> None:
        """The host's next frame goes as soon as it may."""
        self._context.at(max(self._context.now_ns, self._free_ns[host]), self._begin, host)

    def _begin(self, host: int) -> None:
        """The next frame of the host's first packet."""
        packet = self._queues[host][0]
        self._stamp(packet, ports.TimePart.QUEUE)
        self._access[host].failed = 0
        self._contend(host)

    def _contend(self, host: int) -> None:
        access = self._access[host]
        access.busy, access.exponent = 0, self._params.min_be
        self._back_off(host)

    def _back_off(self, host: int) -> None:
        units = int(self._draws[host].integers(1 << self._access[host].exponent))
        self._context.at(self._context.now_ns + units * UNIT_NS + CCA_NS, self._assessed, host)

    def _assessed(self, host: int) -> None:
        """The end of a channel assessment."""
        access, params = self._access[host], self._params
        now_ns = self._context.now_ns
        if now_ns >= self._replies_ns[host] and not self._has_heard(host):
            self._context.at(now_ns + TURNAROUND_NS, self._transmit, host)
            return
        access.busy += 1
        access.exponent = min(access.exponent + 1, params.max_be)
        if access.busy <= params.backoffs:
            self._back_off(host)
        else:
            self._give_up(host, "channel_busy")

    def _transmit(self, host: int) -> None:
        packet = self._queues[host][0]
        repeated = self._access[host].failed > 0
        self._stamp(packet, ports.TimePart.RETRANSMISSION if repeated else
                    ports.TimePart.CONTENTION)
        self._sent += 1
        own = self._begin_sending(host, frame_ns(packet.psdus[0]))
        self._context.at(own.end_ns, self._transmitted, own)

    def _transmitted(self, own: Sending) -> None:
        host, packet = own.source, self._queues[own.source][0]
        self._stamp(packet, ports.TimePart.AIRTIME)
        if packet.fates.frame.broadcast:
            for receiver in packet.fates.frame.receivers:
                if not own.got(receiver):
                    packet.missed.setdefault(receiver, "collision" if own.reached >> receiver & 1
                                             else "out_of_reach")
            self._done(host)
            return
        (receiver,) = packet.fates.frame.receivers
        now_ns = self._context.now_ns
        if not own.got(receiver):
            self._context.at(now_ns + ACK_WAIT_NS, self._missing, host)
            return
        if len(packet.psdus) == 1 and not packet.over:
            self._over(packet)
        self._replies_ns[receiver] = now_ns + TURNAROUND_NS
        self._context.at(now_ns + TURNAROUND_NS, self._acknowledge, (receiver, host))

    def _acknowledge(self, ends: tuple[int, int]) -> None:
        receiver, host = ends
        own = self._begin_sending(receiver, ACK_NS)
        self._context.at(own.end_ns, self._acknowledged, (own, host))

    def _acknowledged(self, reply: tuple[Sending, int]) -> None:
        own, host = reply
        if own.got(host):
            self._done(host)
        else:
            self._context.at(own.begin_ns - TURNAROUND_NS + ACK_WAIT_NS, self._missing, host)

    def _missing(self, host: int) -> None:
        """No acknowledgement came."""
        access = self._access[host]
        access.failed += 1
        self._unanswered += 1
        if access.failed <= self._params.retries:
            self._contend(host)
        else:
            self._give_up(host, "retry_limit")

    def _give_up(self, host: int, reason: str) -> None:
        """The packet is lost, unless its receiver has all of it without the sender's knowledge."""
        packet = self._queues[host][0]
        self._stamp(packet, ports.TimePart.CONTENTION)
        packet.missed = dict.fromkeys(packet.fates.frame.receivers, reason) | packet.missed
        packet.psdus = deque([packet.psdus[0]])
        self._done(host)

    def _done(self, host: int) -> None:
        """The frame is sent, or the packet given up."""
        queue = self._queues[host]
        packet = queue[0]
        self._free_ns[host] = self._context.now_ns + space_ns(packet.psdus.popleft())
        if not packet.psdus:
            queue.popleft()
        if queue:
            self._book(host)
        if not (packet.psdus or packet.over):
            self._over(packet)

    def _stamp(self, packet: _Packet, part: ports.TimePart) -> None:
        if packet.fates.open:
            self._times.until(packet.fates.frame, part, self._context.now_ns)

    def _over(self, packet: _Packet) -> None:
        """The fate of a packet is known."""
        packet.over = True
        packet.fates.over(packet.number, packet.missed, self._context, self._times)
