"""Hosts on one channel: ALOHA, and a cable with and without collisions."""

from __future__ import annotations

import math
from collections.abc import Iterator

from desim.ports.cases import NOWHERE, Check, Play, Setup
from desim.units import NS_PER_S
from netmodels.aloha import Aloha
from netmodels.bus import SLOT_BITS, Bus, BusStation, CollisionDetection
from netmodels.cases.load import SharedBus
from netmodels.cases.traffic import flows, numbered
from netmodels.validation.tolerance import within

LOADS = (0.25, 0.5, 1.0)  # frames that begin in the time of one
RATE = "24 kb/s"

_ALOHA_BPS = 24_000
_BYTES = 90  # 30 ms
_STATIONS = 20
_FRAMES = 100_000


class RandomAccess:
    """ALOHA with and without slots: throughput within 2 % (chance makes less than 1 %)."""

    source = "Abramson 1970: G exp(-2 G); Roberts 1975: G exp(-G)"

    def checks(self, play: Play) -> Iterator[Check]:
        frame_ns = _BYTES * 8 * NS_PER_S // _ALOHA_BPS
        for slot, vulnerable in (None, 2), (f"{frame_ns} ns", 1):
            for load in LOADS:
                found = play(_random_access(slot, frame_ns, load))
                yield within(0.02, f"aloha, {'slots, ' if slot else ''}G = {load}: throughput",
                             1e6 * found["throughput_mbps"] / _ALOHA_BPS,
                             load * math.exp(-vulnerable * load))


def _random_access(slot: str | None, frame_ns: int, load: float) -> Setup:
    senders = numbered("station", _STATIONS)
    model = Aloha(Aloha.Params(rate=RATE, slot=slot))
    return Setup(model, dict.fromkeys((*senders, "sink"), NOWHERE),
                 flows(senders, "sink", _BYTES, _BYTES, "poisson", _STATIONS * frame_ns / load),
                 round(_FRAMES * frame_ns / load))


# Senders, load: Mb/s on the cable, share lost; 1518 B at 10 Mb/s, periodic, queues of 100.
CSMA = {
    (1, 0.5): (5.000, 0), (1, 0.9): (9.000, 0), (1, 1.5): (9.921, .3386),
    (5, 0.5): (5.000, 0), (5, 0.9): (9.000, 0), (5, 1.5): (9.933, .3378),
    (30, 0.5): (5.001, 0), (30, 0.9): (9.002, 0), (30, 1.5): (9.972, .3354),
}

# Hosts to efficiency, packets of 512 and of 1024 bits at 3 Mb/s with slots of 16 us.
EFFICIENCY = {512: {2: .9143, 5: .8810, 10: .8709}, 1024: {2: .9552, 5: .9367, 10: .9310}}
_SLOT_BITS_1976 = 48

_RATE_BPS = 10_000_000
_SLOT_NS = SLOT_BITS * NS_PER_S // _RATE_BPS
_PROPAGATION_NS = 24_000  # there and back, and the jam of 3.2 us: a collision takes one slot
_PACKETS = 20_000


class CarrierSenseOfNs3:
    """A cable without collisions, as in ns-3: throughput within 1 %, loss within 0.01."""

    source = "ns-3.44, CsmaChannel, 10 Mb/s, 1 us"

    def checks(self, play: Play) -> Iterator[Check]:
        for (senders, load), (mbps, lost) in CSMA.items():
            found = play(SharedBus(SharedBus.Params(
                senders=senders, load=load, arrivals="periodic")).setup())
            what = f"csma, {senders} senders, load {load}"
            yield within(0.01, f"{what}: throughput", found["throughput_mbps"], mbps, "Mb/s")
            yield Check(f"{what}: loss", found["loss"], lost, 0.01)


class Slotted(CollisionDetection):
    """The bus of Metcalfe and Boggs: each of Q hosts begins in a slot with probability 1/Q, instead
    of exponential backoff. One host more only listens."""

    def _try(self, station: BusStation) -> None:
        hosts = len(self._stations) - 1
        if self._context.now_ns < self.free_ns or station.random() * hosts < 1:
            super()._try(station)
        else:
            self._context.at(self._context.now_ns + self._cable.slot_ns, self._try, station)

    def _collided(self, station: BusStation, stop_ns: int) -> None:
        self._context.at(stop_ns, self._try, station)


class CollisionsOfEthernet:
    """Collisions on a cable with slots, as by Metcalfe and Boggs: efficiency within 0.005 (four
    standard errors of 20000 packets)."""

    source = "Metcalfe and Boggs 1976: P / (P + W T), W = (1 - A) / A, A = (1 - 1/Q)^(Q - 1)"

    def checks(self, play: Play) -> Iterator[Check]:
        for bits, rows in EFFICIENCY.items():
            for hosts, efficiency in rows.items():
                packet_ns = bits * _SLOT_NS / _SLOT_BITS_1976
                found = play(_saturated(hosts, packet_ns))
                measured = found["delivered"] * packet_ns / found["measured_s"] / NS_PER_S
                yield Check(f"csma_cd, {hosts} hosts, {bits} bits: efficiency", measured,
                            efficiency, 0.005)


def _saturated(hosts: int, packet_ns: float) -> Setup:
    """``packet_ns`` is until everybody has heard a packet's end."""
    bus = Bus(Bus.Params(arbitration="csma_cd", rate=f"{_RATE_BPS} b/s", gap="0 B",
                         propagation=f"{_PROPAGATION_NS} ns", preamble="0 B"), Slotted)
    size_bytes = round((packet_ns - _PROPAGATION_NS) * _RATE_BPS / 8e9)
    senders = numbered("sender", hosts)
    return Setup(bus, dict.fromkeys((*senders, "sink"), NOWHERE),
                 flows(senders, "sink", size_bytes, size_bytes, "saturated"),
                 round(_PACKETS * packet_ns))
