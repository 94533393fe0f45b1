"""The model of Wi-Fi with access points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from desim import ports
from desim.errors import InputError, below
from desim.ports.scope import matching
from netmodels.hops import Hops
from netmodels.infrastructure.access_points import (
    STOPPED,
    AccessPoint,
    WithAccessPoints,
    check_channels,
    names_of,
)
from netmodels.infrastructure.associations import Associations
from netmodels.infrastructure.floods import ENDED, Floods
from netmodels.infrastructure.fq_codel import Backlog, memory_bytes
from netmodels.infrastructure.memberships import Memberships
from netmodels.infrastructure.outlets import AirOutlet
from netmodels.infrastructure.packet_queue import PacketQueue, PlainQueue
from netmodels.infrastructure.settings import Settings
from netmodels.infrastructure.station_queues import StationQueues
from netmodels.infrastructure.trips import Trip, TripTimes
from netmodels.infrastructure.ways import Ways
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import ACK_BYTES
from netmodels.switch import Switch

_NOT_ASSOCIATED = ports.Drop("not_associated")
_NOBODY = ports.Drop("receiver_not_associated")
_RADIO_PACKETS = 500  # of fq_codel: more than an outlet lets its radio take in


class Infrastructure:
    """Wi-Fi with access points: every frame of a station goes over the one on which it hangs. So a
    frame from one to another takes the air twice, on two channels if they hang on two access
    points, between which wires carry it (``switch``). ``wired`` hosts hang on these wires.

    Access points are stations of the same radio (``netmodels.radio.dcf``), each on its channel; who
    is on another one hears nothing of it. A train goes on from an access point when all of it has
    come. Each station, access points too, has queues in front of its radio: an ``fq_codel`` for
    each receiver, of which the radio takes in 5 to 12 ms of airtime (Linux: airtime queue limits),
    or one that is first in first out.

    A broadcast goes up as a unicast frame, and down from each access point that has stations at the
    lowest basic rate, not acknowledged and not repeated.

    A station scans, joins an access point by the frames of 802.11, follows its signal from beacon
    to beacon, and changes to a stronger one (``roaming``). What it sends without an access point is
    dropped (``not_associated``), what comes for it as well (``receiver_not_associated``). The
    wires learn of a change when it is over: until then the access point before sends to nobody, and
    what still waits there is dropped (``roamed``). Management frames have the rate of data. Rules
    judge a frame once, from host to host.

    Capabilities: Separates, FollowsHosts, KnowsHandovers, SwitchesAccessPoints, Refuses,
    CountsControl, CountsAttempts, CountsBusyTime, NamesChannels, CountsAirtime, Itemizes.
    """

    Params = Settings
    reasons: tuple[str, ...] = tuple(sorted({
        *DcfRadio.reasons, "not_associated", "receiver_not_associated", "roamed",
        "codel", "downlink_codel", "downlink_queue_full", "wires_queue_full", STOPPED,
        ENDED}))
    refuses = ("codel", "not_associated", "queue_full")

    def __init__(self, settings: Settings, params: DcfRadio.Params,
                 access_points: Sequence[AccessPoint]) -> None:
        self._settings, self._params, self._access_points = settings, params, access_points
        self._radio, self._switch = _radio(
            params, access_points, _RADIO_PACKETS if settings.queue == "fq_codel"
            else -(-params.queue * 4 // 3)), Switch(settings.wires)
        self._times: TripTimes | None = None

    def itemize(self, ledger: ports.Ledger) -> None:
        self._times = times = TripTimes(ledger)
        self._radio.itemize(times.air)
        self._switch.itemize(times.wires)

    def check(self, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` for what does not fit together, or to the hosts."""
        _check(self._params)
        check_channels(self._access_points, self._radio.standard)
        names = (*hosts, *names_of(self._access_points, hosts))
        self._radio.params.check_radio(names)
        self._wired_hosts(hosts)
        with below(".infrastructure.wires"):
            self._settings.wires.check_hosts(names)

    def _wired_hosts(self, hosts: tuple[str, ...]) -> frozenset[int]:
        """Raises ``InputError`` for patterns that name no host."""
        found: set[int] = set()
        access_points = names_of(self._access_points, hosts)
        for number, pattern in enumerate(self._settings.wired):
            path = f".infrastructure.wired.{number}"
            if pattern in access_points:
                raise InputError(f"{path}: access points ({', '.join(access_points)}) are wired "
                                 f"anyway; allowed: hosts, which are {', '.join(hosts)}")
            found.update(matching(pattern, hosts, path))
        return frozenset(found)

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        settings, times = self._settings, self._times
        self.check(hosts)
        count, names = len(hosts), (*hosts, *names_of(self._access_points, hosts))
        self._context, self._names = context, names
        self._dscp = context.dscp if self._radio.categories else None
        site = WithAccessPoints(context, self._access_points)
        air_ledger = wire_ledger = None
        if times is not None:
            air_ledger, wire_ledger = times.air, times.wires
        self._air = Hops(self._radio, site, names, "", air_ledger, marks=True)
        wires = Hops(self._switch, site, names, ".infrastructure.wires", wire_ledger)
        self._wired = self._wired_hosts(hosts)
        for host in sorted(self._wired):
            self._air.switched(host, False)
        standard = self._radio.standard
        ack_ns = standard.sifs_ns + standard.airtime_ns(ACK_BYTES, 0) + standard.slot_ns
        rate_bps = round(1e6 * standard.rates[self._radio.rate].mbps)
        outlets = [AirOutlet(station, self._queues(), self._air, rate_bps, ack_ns,
                             self._radio.params.queue) for station in range(len(names))]
        self._channels = {count + k: one.channel for k, one in enumerate(self._access_points)}
        self.associations = Associations(
            settings, names, self._air, self._radio, outlets,
            [host for host in range(count) if host not in self._wired], self._channels,
            ack_ns)
        self.associations.begin()
        snoops = settings.multicast == "snooping" and not settings.querier
        self._memberships = Memberships(settings.membership_ns if snoops else None)
        self._ways = Ways(context, self._air, wires, outlets, times,
                          self.associations.power_save)
        self._floods = Floods(context, self._ways, self.associations, tuple(self._channels),
                              self._wired, settings.multicast, self._memberships)

    def _queues(self) -> Callable[[], PacketQueue]:
        """A maker of the queues of one radio."""
        if self._settings.queue == "fifo":
            return lambda: PlainQueue(self._params.queue)
        constants = self._settings.fq_codel
        return partial(StationQueues, constants, Backlog(
            constants.limit, constants.memory_bytes or memory_bytes(self._params.standard)))

    def send(self, frame: ports.Frame) -> None:
        source, access_point = frame.source, None
        there = self._floods.spread if frame.broadcast else self._pass_on
        if source not in self._wired:
            access_point = self.associations.access_point(source)
            if access_point is None:
                self._context.settle_many(frame, frame.receivers, _NOT_ASSOCIATED)
                return
        dscp = 0 if self._dscp is None else self._dscp(frame)
        trip = Trip(frame, self._context.flow(frame), self._context.now_ns, dscp)
        if access_point is None:
            there(trip, source)
        else:
            self._ways.up(trip, access_point, there)

    def _pass_on(self, trip: Trip, station: int) -> None:
        """A unicast frame is at ``station``, an access point or a wired host."""
        (dest,) = trip.frame.receivers
        if not self.associations.runs(station):
            self._ways.stop(trip, station, STOPPED, (dest,))
            return
        at = dest if dest in self._wired else self.associations.known(dest)
        if at is None:
            self._context.settle(trip.frame, dest, _NOBODY)
        elif station == dest or not trip.left:
            self._ways.end(trip, (dest,))
        elif at == station:
            self._ways.down(trip, station, dest)
        else:
            self._ways.along(trip, station, (at,), self._pass_on)

    @property
    def access_points(self) -> list[ports.PlacedAccessPoint]:
        """``ports.KnowsHandovers``."""
        own = self._access_points
        return [ports.PlacedAccessPoint(name, *one.at_m, one.channel)
                for name, one in zip(names_of(own, ()), own, strict=True)]

    @property
    def handovers(self) -> list[ports.Handover]:
        """``ports.KnowsHandovers``."""
        return self.associations.handovers

    def follow(self, note: Callable[[int, str | None], object]) -> None:
        """``ports.KnowsHandovers``."""
        self.associations.follow(note)

    def switch_access_point(self, name: str, up: bool) -> None:
        """``ports.SwitchesAccessPoints``: while it is down, frames for it are lost
        (``access_point_down``), and stations miss its beacons."""
        self.associations.switch(self._names.index(name), up)

    def switched(self, host: int, up: bool) -> None:
        """A host has started or stopped."""
        if up:
            self._memberships.report(host, self._context.now_ns)
        if host not in self._wired:
            self._air.switched(host, up)
            self.associations.switched(host, up)

    def separates(self, host: int, other: int) -> bool:
        """Whether one of the two hangs on no access point now."""
        loose = self.associations.loose
        return host in loose or other in loose

    def control(self) -> tuple[int, int]:
        """Beacons and management frames so far, and their bytes on the air."""
        control = self.associations.control
        return control.frames, control.bytes

    def attempts(self) -> tuple[int, int]:
        """``ports.CountsAttempts``: of stations and access points."""
        return self._radio.attempts()

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long each access point was sending or heard others."""
        return self._radio.busy_ns(list(self._channels))

    def channels(self, hosts: Sequence[int]) -> list[str]:
        """The access points with their channels."""
        return [f"{self._names[one]} (channel {channel})"
                for one, channel in self._channels.items()]

    def airtime_ns(self, hosts: Sequence[int]) -> list[tuple[int, int]]:
        """``ports.CountsAirtime``; wired hosts have none."""
        return [(0, 0) if host in self._wired else own
                for host, own in zip(hosts, self._radio.airtime_ns(hosts), strict=True)]


def _radio(params: DcfRadio.Params, access_points: Sequence[AccessPoint], places: int) -> DcfRadio:
    """The radio of all stations, with so many places for packets. Broadcasts go at the lowest basic
    rate if no other is given."""
    standard = params.of_channel(access_points[0].channel, params.basic_rates_bps)
    basic_bps = [round(1e6 * mbps) for mbps in standard.basic_mbps]
    names = names_of(access_points, ())
    own = params.model_copy(update={
        "queue": places, "channel": access_points[0].channel,
        "channels": {name: one.channel for name, one in zip(names, access_points, strict=True)},
        "broadcast_rate_bps": params.broadcast_rate_bps or min(basic_bps)})
    return DcfRadio(own, own.of_standard().with_short_slots(), names)


def _check(params: DcfRadio.Params) -> None:
    if params.channels:
        raise InputError(".channels: stations take the channels of their access points; allowed: "
                         "access_points without it")
