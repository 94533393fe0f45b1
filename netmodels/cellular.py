"""A cellular network: modems with an uplink and a downlink, and the core between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from desim import ports
from desim.ports.scope import matching
from desim.units import NS_PER_S, BitRate, ByteSize, Duration, Pace, airtime_ns
from netmodels.itemized import FrameTimes, Itemized
from netmodels.queues import fitting, refuse
from netmodels.stalls import StallLaw, Stalls

# The uplink's time on the radio by its quantiles. The round trips are those of 1024 B over 4G and
# fibre, 741 735 one after another in 24.4 h (Fernandez-Madrigal et al. 2025, doi
# 10.5281/zenodo.14967644, experiment 003). Their whole spread is put into the uplink, whose
# scheduling makes most of it; 2 * 37 ms of core and the downlink's 7.5 ms are taken off.
_SHARES = (0.0, 0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998,
           0.999, 0.9995, 1.0)
_UPLINK_MS = (5.5, 11.5, 15.5, 21.5, 29.5, 34.5, 37.5, 39.5, 41.5, 43.5, 46.5, 75.5, 96.5, 100.5,
              103.5, 118.5, 118.5)


class Gaps(StallLaw):
    """The law of handovers and lost connections, fitted to the same round trips: the 9.3 an hour
    that took more than 250 ms."""

    every_ns: Pace = Field("388 s", description="mean time from the end of one to the next")
    least_ns: Duration = Field("130 ms", description="of each")
    scale_ns: Pace = Field("296 ms", description="of the time on top")
    shape: float = Field(0.17, ge=0.0, lt=1.0, description="(0: exponential)")


class _Link:
    """One direction of a modem's radio, with the queue in front of it."""

    def __init__(self, rate_bps: int, queue_bytes: int) -> None:
        self._rate_bps, self._queue_bytes = rate_bps, queue_bytes
        self.free_ns = self._booked_ns = 0

    def take(self, sizes: Sequence[int], now_ns: int) -> tuple[int, int, int]:
        """Let in the first packets for which there is room. Returns how many, and when they begin
        and have been sent."""
        begin_ns = max(now_ns, self.free_ns)
        left_bytes = self._queue_bytes - (begin_ns - now_ns) * self._rate_bps // (8 * NS_PER_S)
        fit = fitting(sizes, left_bytes, begin_ns == now_ns)
        self.free_ns = begin_ns + airtime_ns(sum(sizes[:fit]), self._rate_bps)
        self._booked_ns += self.free_ns - begin_ns
        return fit, begin_ns, self.free_ns

    def busy_ns(self, now_ns: int) -> int:
        """The time for which it was sending so far."""
        return self._booked_ns - max(self.free_ns - now_ns, 0)


class _Carried(NamedTuple):
    """The first ``packets`` of a frame, which got into the uplink."""

    frame: ports.Frame
    packets: int


class Cellular(Itemized):
    """Each host has a modem but those that are ``wired``: servers beyond the operator's core.

    A frame waits behind its sender's others for the uplink, then for its grant, crosses the core,
    and waits for the receiver's downlink, at the base station, which keeps ``queue`` for each
    modem. From robot to robot it takes both links. Frames of a modem stay in order, as the radio
    link control keeps them. In a gap of its modem a frame waits for the end of that. Nothing is
    lost but for want of room. Broadcasts and multicasts get nowhere: modems have addresses of
    their own, and no common network.

    The rates are the peak of category 4 (3GPP TS 36.306, tables 4.1-1 and 4.1-2); the defaults of
    all times are fitted, see above.

    Capabilities: Refuses, CountsBusyTime, Itemizes, KnowsDepartures.
    """

    class Params(ports.Params):
        up_bps: BitRate = Field("51 Mb/s", description="(TS 36.306, category 4)")
        down_bps: BitRate = Field("150 Mb/s", description="(TS 36.306, category 4)")
        core_ns: Duration = Field("37 ms", description=(
            "one way, between the cell and another one or a wired host (measured)"))
        radio_ns: Duration = Field("7.5 ms", description=(
            "of the downlink (after 3GPP TR 36.881, numbers from memory: 3 + 0.5 + 1 + 3 ms)"))
        queue_bytes: ByteSize = Field("1 MB", description=(
            "that wait for each link (our choice: 53 ms down, 157 ms up)"))
        wired: list[str] = Field([], description="hosts without a modem: names or patterns")
        gaps: Gaps | None = Field(Gaps(), description="null: none")

    reasons = ("no_multicast", "queue_full")
    refuses = ("no_multicast", "queue_full")

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` for a wired host that does not exist."""
        self._context, params = context, self._params
        self._times = FrameTimes.of(self._ledger)
        self._wired = {host for number, pattern in enumerate(params.wired)
                       for host in matching(pattern, hosts, f".wired.{number}")}
        self._up = [_Link(params.up_bps, params.queue_bytes) for _ in hosts]
        self._down = [_Link(params.down_bps, params.queue_bytes) for _ in hosts]
        self._grants = [context.stream("grant", host) for host in hosts]
        self._gaps = [None if params.gaps is None else Stalls(
            context.stream("gap", host), params.gaps) for host in hosts]
        self._in_core_ns = [0] * len(hosts)  # when the last frame of each modem gets there

    def send(self, frame: ports.Frame) -> None:
        if frame.broadcast:
            self._context.settle_many(frame, frame.receivers, ports.Drop("no_multicast"))
            return
        now_ns, fit = self._context.now_ns, frame.segments
        if frame.source in self._wired:
            self._times.begin(frame, now_ns)
            self._cross(_Carried(frame, fit), now_ns)
            return
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        fit, begin_ns, end_ns = self._up[frame.source].take(sizes, now_ns)
        refuse(self._context, frame, fit)
        if fit:
            self._times.begin(frame, now_ns)
            self._times.until(frame, ports.TimePart.QUEUE, begin_ns)
            self._times.until(frame, ports.TimePart.AIRTIME, end_ns)
            self._context.at(end_ns, self._granted, _Carried(frame, fit))

    def _granted(self, carried: _Carried) -> None:
        """The frame is through the uplink's queue: it waits for the end of a gap and its grant."""
        source = carried.frame.source
        share = self._grants[source].random()
        radio_ns = round(1e6 * float(np.interp(share, _SHARES, _UPLINK_MS)))
        at_ns = max(self._gap_over_ns(source) + radio_ns, self._in_core_ns[source])
        self._in_core_ns[source] = at_ns
        self._times.until(carried.frame, ports.TimePart.CONTENTION, at_ns)
        self._cross(carried, at_ns)

    def _gap_over_ns(self, host: int) -> int:
        now_ns, gaps = self._context.now_ns, self._gaps[host]
        return now_ns if gaps is None else gaps.over_ns(now_ns)

    def _cross(self, carried: _Carried, at_ns: int) -> None:
        """The frame is in the core at ``at_ns``."""
        out_ns = at_ns + self._params.core_ns
        self._times.until(carried.frame, ports.TimePart.PROPAGATION, out_ns)
        self._context.at(out_ns, self._crossed, carried)

    def _crossed(self, carried: _Carried) -> None:
        """The frame is at its receiver if that is wired, or at the base station."""
        frame, packets = carried
        (receiver,) = frame.receivers
        if receiver in self._wired:
            self._times.end(frame)
            self._context.settle(frame, receiver, ports.Deliver(0))
            return
        now_ns, times = self._context.now_ns, self._times
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)[:packets]
        fit, begin_ns, end_ns = self._down[receiver].take(sizes, self._gap_over_ns(receiver))
        if not fit:
            times.end(frame)
            self._ledger.lost_at(frame, receiver)
            self._context.settle(frame, receiver, ports.Drop("queue_full"))
            return
        if fit < packets:
            self._context.settle(frame, receiver, ports.Drop("queue_full", tuple(
                range(fit, packets))))
        times.until(frame, ports.TimePart.QUEUE, begin_ns)
        times.until(frame, ports.TimePart.AIRTIME, end_ns)
        times.until(frame, ports.TimePart.PROPAGATION, end_ns + self._params.radio_ns)
        times.end(frame)
        self._context.settle(frame, receiver, ports.Deliver(
            end_ns + self._params.radio_ns - now_ns))

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._up[host].free_ns

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long the uplink of each of ``hosts`` was sending."""
        now_ns = self._context.now_ns
        return [self._up[host].busy_ns(now_ns) for host in hosts]
