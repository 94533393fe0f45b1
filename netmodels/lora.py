"""LoRaWAN, class A: devices that send to one gateway, and hear it only after they have sent."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import NS_PER_S, Decibels, Level, Pace, Ratio
from netmodels.itemized import FrameTimes, Itemized
from netmodels.lora_modem import MOST_BYTES, SENSITIVITY_DBM, lora_airtime_ns
from netmodels.packet_fates import PacketFates
from netmodels.radio.body_loss import BodyLoss
from netmodels.radio.path_loss import LIGHT_MPS, PathLossParams
from netmodels.random_loss import drop

CARRIER_HZ = 868.1e6  # the first of EU868
HEADERS_BYTES = 18 + 20 + 8  # of Ethernet, IP and UDP, in whose place FPort stands (RFC 9011)
LORAWAN_BYTES = 13  # MHDR 1, FHDR 7, FPort 1, MIC 4
_RX1_NS, _RX2_NS = NS_PER_S, 2 * NS_PER_S  # from the end of an uplink to the receive windows


@dataclass(eq=False)
class _Packet:
    """One packet, in a queue or on the air; ``spoiled`` by others."""

    fates: PacketFates
    receiver: int
    number: int
    size_bytes: int  # of its payload
    channel: int = 0
    power_dbm: float = 0.0
    spoiled: bool = False
    waits: bool = True  # at the gateway


class Lora(Itemized):
    """LoRaWAN of class A with one gateway: devices send when they like (pure ALOHA), each packet
    once, on a channel drawn anew; the server is at the gateway.

    Uplinks that overlap on a channel are lost (``collision``) unless one is ``capture`` stronger at
    the gateway, which hears nothing while it sends itself (``gateway_sends``) and decodes any
    number at once. After airtime / ``duty_cycle`` a device may send again, at the earliest 2 s
    after its uplink's end. A packet for a device waits at the gateway for the next uplink from
    there, and goes 1 s behind it (RX1: same channel and spreading factor), one for each uplink,
    unless the gateway's own duty cycle forbids. So do those from device to device. One that is not
    asked for is dropped after ``lifetime`` (``expired``). Downlinks do not collide: their chirps
    are inverted.

    Of a packet 46 B, the headers of Ethernet, IP and UDP, are compressed away (RFC 9011), and
    LoRaWAN's 13 B come on top. What is longer than EU868 allows at the spreading factor is
    ``too_long``. Nothing is acknowledged, and broadcasts get to the gateway alone. Signals below
    the datasheet's sensitivity are not heard, nor is a host without a place. People on the line
    weaken them. Not modelled: walls, RX2, joining, adaptive data rates, other networks.

    Capabilities: Refuses, Itemizes.
    """

    class Params(ports.Params):
        gateway: str = Field(description="the host that is the gateway and the server")
        spreading_factor: int = Field(7, ge=7, le=12, description="of all (the fastest of 125 kHz)")
        bandwidth: Literal["125 kHz", "250 kHz", "500 kHz"] = Field("125 kHz", description=(
            "(EU868, DR0 to DR5)"))
        coding_rate: Literal["4/5", "4/6", "4/7", "4/8"] = Field("4/5", description="(LoRaWAN)")
        channels: int = Field(3, ge=1, le=64, description="(EU868's defaults: 868.1, 868.3, 868.5)")
        duty_cycle: Ratio = Field("1 %", gt=0, description=(
            "of each device and of the gateway (ETSI EN 300 220, 868.0 to 868.6 MHz)"))
        power_dbm: Level = Field("14 dBm", description="of all (25 mW, ETSI EN 300 220)")
        path_loss: PathLossParams = Field(PathLossParams(), description=(
            "in the open, at 868.1 MHz (log_distance, exponent 3)"))
        capture_db: Decibels = Field("6 dB", description="(Bor et al. 2016)")
        queue: int = Field(16, ge=1, le=10_000, description=(
            "packets that wait at a device, and at the gateway for each (our choice)"))
        lifetime_ns: Pace = Field("10 min", description="of a packet at the gateway (our choice)")

    reasons = ("collision", "expired", "gateway_full", "gateway_sends", "no_multicast",
               "out_of_range", "queue_full", "too_long")
    refuses = ("no_multicast", "queue_full", "too_long")

    def __init__(self, params: Params) -> None:
        self._params = params
        self._khz = int(params.bandwidth.removesuffix(" kHz"))
        self._least_dbm = SENSITIVITY_DBM[self._khz][params.spreading_factor - 7]
        self._path_loss = params.path_loss.chosen(CARRIER_HZ)
        self._bodies = BodyLoss(LIGHT_MPS / CARRIER_HZ)

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` if there is no such gateway."""
        name = self._params.gateway
        if name not in hosts:
            raise InputError(f".gateway: no host {name!r}{did_you_mean(name, hosts)}")
        self._context, self._gateway = context, hosts.index(name)
        self._channels = [context.stream("channel", host) for host in hosts]
        self._queues: list[deque[_Packet]] = [deque() for _ in hosts]  # at devices
        self._waiting: list[deque[_Packet]] = [deque() for _ in hosts]  # at the gateway, for each
        self._free_ns = [0] * len(hosts)  # when each may send again
        self._gateway_until_ns = 0  # it sends
        self._air: list[_Packet] = []  # uplinks
        self._times = FrameTimes.of(self._ledger)

    def send(self, frame: ports.Frame) -> None:
        context, source, gateway = self._context, frame.source, self._gateway
        sizes = tuple(max(size_bytes - HEADERS_BYTES, 0) for size_bytes in ports.packet_sizes(
            frame.size_bytes, frame.segments))
        if max(sizes) > MOST_BYTES[self._params.spreading_factor]:
            context.settle_many(frame, frame.receivers, ports.Drop("too_long"))
            return
        receivers = frame.receivers
        if frame.broadcast:
            heard = source != gateway and gateway in receivers
            others = [receiver for receiver in receivers if not heard or receiver != gateway]
            if others:
                context.settle_many(frame, others, ports.Drop("no_multicast"))
            if not heard:
                return
            receivers = (gateway,)
        (receiver,) = receivers
        queue = self._waiting[receiver] if source == gateway else self._queues[source]
        fit = min(frame.segments, self._params.queue - len(queue))
        if fit < frame.segments:
            context.settle(frame, receiver, drop("queue_full", range(fit, frame.segments),
                                                 frame.segments))
        if not fit:
            return
        self._times.begin(frame, context.now_ns)
        fates = PacketFates(frame, (receiver,), fit)
        idle = not queue
        for number in range(fit):
            packet = _Packet(fates, receiver, number, sizes[number])
            if source == gateway:
                self._wait(packet)
            else:
                queue.append(packet)
        if idle and source != gateway:
            self._book(source)

    def _book(self, device: int) -> None:
        """The first packet of the device's queue goes as soon as it may."""
        frame, now_ns = self._queues[device][0].fates.frame, self._context.now_ns
        self._times.until(frame, ports.TimePart.QUEUE, now_ns)
        self._context.at(max(now_ns, self._free_ns[device]), self._uplink, device)

    def _uplink(self, device: int) -> None:
        context, params, now_ns = self._context, self._params, self._context.now_ns
        if now_ns < self._free_ns[device]:  # a downlink came in between
            context.at(self._free_ns[device], self._uplink, device)
            return
        packet = self._queues[device][0]
        self._times.until(packet.fates.frame, ports.TimePart.CONTENTION, now_ns)
        packet.channel = int(self._channels[device].integers(params.channels))
        packet.power_dbm = self._received_dbm(device)
        for other in self._air:
            if other.channel == packet.channel:
                packet.spoiled |= packet.power_dbm < other.power_dbm + params.capture_db
                other.spoiled |= other.power_dbm < packet.power_dbm + params.capture_db
        self._air.append(packet)
        air_ns = self._airtime_ns(packet, crc=True)
        self._free_ns[device] = now_ns + max(self._spacing_ns(air_ns), air_ns + _RX2_NS)
        context.at(now_ns + air_ns, self._uplink_over, (device, now_ns))

    def _uplink_over(self, sent: tuple[int, int]) -> None:
        device, begin_ns = sent
        queue, now_ns = self._queues[device], self._context.now_ns
        packet = queue.popleft()
        self._air.remove(packet)
        self._times.until(packet.fates.frame, ports.TimePart.AIRTIME, now_ns)
        if queue:
            self._book(device)
        if packet.power_dbm < self._least_dbm:
            self._lose(packet, "out_of_range")
        elif self._gateway_until_ns > begin_ns:  # it has sent since
            self._lose(packet, "gateway_sends")
        elif packet.spoiled:
            self._lose(packet, "collision")
        else:
            self._context.at(now_ns + _RX1_NS, self._downlink, device)
            self._heard(packet)

    def _heard(self, packet: _Packet) -> None:
        """The gateway has the packet, for itself or for another device."""
        if packet.receiver == self._gateway:
            self._over(packet)
        elif len(self._waiting[packet.receiver]) < self._params.queue:
            self._wait(packet)
        else:
            self._ledger.lost_at(packet.fates.frame, self._gateway)
            self._lose(packet, "gateway_full")

    def _wait(self, packet: _Packet) -> None:
        """The packet waits at the gateway for an uplink of its receiver."""
        self._waiting[packet.receiver].append(packet)
        self._context.at(self._context.now_ns + self._params.lifetime_ns, self._expire, packet)

    def _expire(self, packet: _Packet) -> None:
        if packet.waits:
            self._waiting[packet.receiver].remove(packet)
            self._times.until(packet.fates.frame, ports.TimePart.QUEUE, self._context.now_ns)
            self._ledger.lost_at(packet.fates.frame, self._gateway)
            self._lose(packet, "expired")

    def _downlink(self, device: int) -> None:
        """The device's first receive window opens."""
        now_ns, waiting = self._context.now_ns, self._waiting[device]
        if not waiting or now_ns < self._free_ns[self._gateway]:
            return
        packet = waiting.popleft()
        packet.waits = False
        self._times.until(packet.fates.frame, ports.TimePart.QUEUE, now_ns)
        air_ns = self._airtime_ns(packet, crc=False)
        self._gateway_until_ns = now_ns + air_ns
        self._free_ns[self._gateway] = now_ns + self._spacing_ns(air_ns)
        self._free_ns[device] = max(self._free_ns[device], now_ns + air_ns)
        packet.power_dbm = self._received_dbm(device)
        self._context.at(now_ns + air_ns, self._downlink_over, packet)

    def _downlink_over(self, packet: _Packet) -> None:
        self._times.until(packet.fates.frame, ports.TimePart.AIRTIME, self._context.now_ns)
        if packet.power_dbm >= self._least_dbm:
            self._over(packet)
        else:
            self._lose(packet, "out_of_range")

    def _received_dbm(self, device: int) -> float:
        """The power of a device at the gateway, or the other way round."""
        places = self._context.positions(self._context.now_ns)
        distance_m = float(np.hypot(*(places[device] - places[self._gateway])))
        loss_db = float(self._path_loss.loss_db(np.array(distance_m)))
        if (people := self._context.obstacles.people) is not None:
            ends = [device, self._gateway]
            loss_db += float(self._bodies.loss_db(people, places[ends].reshape(1, 4),
                                                  self._context.antennas.height_m[ends][None])[0])
        return -math.inf if math.isnan(loss_db) else self._params.power_dbm - loss_db

    def _airtime_ns(self, packet: _Packet, crc: bool) -> int:
        params = self._params  # downlinks have no check sum of the payload
        return lora_airtime_ns(LORAWAN_BYTES + packet.size_bytes,
                               params.spreading_factor, self._khz, int(params.coding_rate[2]) - 4,
                               crc)

    def _spacing_ns(self, air_ns: int) -> int:
        """From the begin of one transmission to that of the next: airtime / duty cycle."""
        return round(air_ns / self._params.duty_cycle)

    def _lose(self, packet: _Packet, reason: str) -> None:
        packet.fates.over(packet.number, {packet.receiver: reason}, self._context, self._times)

    def _over(self, packet: _Packet) -> None:
        """The packet is at its receiver."""
        packet.fates.over(packet.number, {}, self._context, self._times)
