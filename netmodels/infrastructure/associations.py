"""The associations of stations with access points, and their ways to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from functools import partial

from desim import ports
from netmodels.hops import Hops
from netmodels.infrastructure.access_points import STOPPED
from netmodels.infrastructure.background_scans import BackgroundScans
from netmodels.infrastructure.joining import ControlFrames, Handshake, steps
from netmodels.infrastructure.outlets import AirOutlet
from netmodels.infrastructure.power_save import PowerSave
from netmodels.infrastructure.settings import Settings
from netmodels.radio.access_categories import BEACON_MARK
from netmodels.radio.dcf.radio import DcfRadio


class _Doing(Enum):
    NOTHING, SCANNING, JOINING = range(3)


class _Station:
    """A station's own view. ``turn`` counts what it has begun to do, so that calls that were booked
    for something earlier are told apart."""

    def __init__(self, scans: BackgroundScans) -> None:
        self.access_point: int | None = None
        self.left: int | None = None
        self.since_ns = 0  # without an access point
        self.unserved_ns: int | None = None  # since its access point has stopped
        self.doing, self.turn = _Doing.NOTHING, 0
        self.scanned_ns: int | None = None  # the last scan began
        self.scans = scans
        self.found: dict[int, float] = {}  # access points, and their power in the last scan, dBm
        self.missed = 0  # beacons in a row
        self.handshake: Handshake | None = None
        self.up = True


class Associations:
    """Follows the signals that stations hear from beacon to beacon, and lets them scan, join, roam
    and give up. ``handovers`` has each time that a station has come to an access point.

    A station knows the mean power of each access point's signals at its place, without fading.
    ``outlets`` are those of all stations; ``access_points`` and ``hosts`` have one each."""

    def __init__(self, settings: Settings, names: Sequence[str], air: Hops, radio: DcfRadio,
                 outlets: Sequence[AirOutlet],
                 hosts: Sequence[int], access_points: dict[int, int], ack_ns: int) -> None:
        """``hosts``: those with a radio. ``access_points``: their channels. ``ack_ns`` as an outlet
        has it."""
        self._settings, self._constants = settings, settings.constants
        self._names, self._air, self._radio, self._outlets = names, air, radio, outlets
        self._hosts, self._channels = tuple(hosts), access_points
        self._roaming, self._ack_ns = settings.roaming, ack_ns
        self._stations = {host: _Station(BackgroundScans(settings.roaming)) for host in hosts}
        self._known: dict[int, int] = {}  # to the wires: where a station hangs
        self._stopped: set[int] = set()  # access points
        self.control = ControlFrames(air)
        self.power_save = PowerSave(self.control, settings.constants, outlets, self._rests_at
                                    ) if settings.power_save else None
        # Those that hang on no access point. ``separates`` asks for each pair of hosts: with 300
        # robots it takes a tenth of the time that it takes to ask the stations.
        self.loose = set(self._stations)
        self.handovers: list[ports.Handover] = []
        self._notes: list[Callable[[int, str | None], object]] = []

    def begin(self) -> None:
        """Begin, where stations are associated from the start on with whom they hear best."""
        if self._settings.associated:
            budget = self._radio.budget
            powers_dbm = budget.powers_dbm(budget.losses(
                self._air.positions(self._air.now_ns), self._air.obstacles))
            for host, station in self._stations.items():
                best = max(self._channels, key=lambda one: (powers_dbm[one, host], -one))
                if powers_dbm[best, host] >= self._found_dbm:
                    station.access_point = self._known[host] = best
                    self.loose.discard(host)
                    station.scanned_ns = 0
                    station.scans.begin(0, powers_dbm[best, host] < self._roaming.threshold_dbm)
                    budget.channels[host] = self._channels[best]
                    self._is_active(host)
        for access_point in self._channels:
            phase = self._air.stream("beacons", self._names[access_point]).random()
            self._air.at(self._air.now_ns + int(phase * self._constants.beacon_ns), self._beacon,
                         access_point)

    def follow(self, note: Callable[[int, str | None], object]) -> None:
        """See ``ports.KnowsHandovers``."""
        for host, station in self._stations.items():
            own = station.access_point
            note(host, None if own is None else self._names[own])
        self._notes.append(note)

    def access_point(self, host: int) -> int | None:
        """The one on which a station hangs, as that knows."""
        return self._stations[host].access_point

    def scanned_ns(self, host: int) -> int:
        """The time at which a station's last scan began; 0 if there was none."""
        return self._stations[host].scanned_ns or 0

    def known(self, host: int) -> int | None:
        """The one to which the wires carry frames for a station; None: there is none."""
        return self._known.get(host)

    def members(self, access_point: int) -> list[int]:
        """The stations to which an access point sends."""
        return sorted(host for host, known in self._known.items() if known == access_point)

    def switched(self, host: int, up: bool) -> None:
        """A station's host has started or stopped. It starts without an access point."""
        station = self._stations.get(host)
        if station is None or station.up == up:
            return
        station.up = up
        self._leave(host)
        self._begin(station, _Doing.NOTHING)
        station.scanned_ns = None

    def runs(self, access_point: int) -> bool:
        """Whether an access point has not stopped."""
        return access_point not in self._stopped

    def switch(self, access_point: int, up: bool) -> None:
        """An access point stops, or starts and knows no station."""
        if self.runs(access_point) == up:
            return
        if up:
            self._stopped.discard(access_point)
        else:
            self._stopped.add(access_point)
            for host in self.members(access_point):
                del self._known[host]
                self._stations[host].unserved_ns = self._air.now_ns
            self._outlets[access_point].flush(None, STOPPED)
            if self.power_save is not None:
                self.power_save.stop(access_point, STOPPED)
        self._radio.tune(access_point, self._channels[access_point] if up else 0)

    # From beacon to beacon.

    def _beacon(self, access_point: int) -> None:
        air = self._air
        air.at(air.now_ns + self._constants.beacon_ns, self._beacon, access_point)
        if not self.runs(access_point):
            for host in self._hosts:
                self._note(access_point, host, False)
            return
        powers_dbm = self._radio.powers_dbm()[access_point].tolist()
        size_bytes = self._constants.beacon_frame_bytes
        if size_bytes is not None:
            if self._hosts:
                self.control.send(access_point, self._hosts, size_bytes, True,
                                  partial(self._passed, access_point), BEACON_MARK)
        else:
            for host in self._hosts:
                self._note(access_point, host, powers_dbm[host] >= self._found_dbm)
        if self.power_save is not None:
            self.power_save.beacon(access_point)
        for host in self._hosts:
            self._watch(access_point, host, powers_dbm[host])

    def _passed(self, access_point: int, _: ports.Frame, receivers: Sequence[int],
                verdict: ports.Deliver | ports.Drop, __: dict[int, str]) -> None:
        for host in receivers:
            self._note(access_point, host, isinstance(verdict, ports.Deliver))

    def _note(self, access_point: int, host: int, heard: bool) -> None:
        """A station has heard a beacon, or missed it."""
        station = self._stations[host]
        if station.access_point != access_point or station.doing is _Doing.SCANNING:
            return
        if heard and self._known.get(host) != access_point:
            self._forsake(host)  # it began anew, and has said so (hostapd_flush_old_stations)
            return
        station.missed = 0 if heard else station.missed + 1
        if heard and self.power_save is not None:
            self.power_save.heard(host, access_point)
        if station.missed == self._constants.lost_beacons:
            self._air.at(self._air.now_ns + self._constants.probe_wait_ns, self._give_up,
                         (host, station.turn))

    def _give_up(self, which: tuple[int, int]) -> None:
        host, turn = which
        station = self._stations[host]
        if station.turn == turn and station.missed >= self._constants.lost_beacons:
            self._forsake(host)

    def _forsake(self, host: int) -> None:
        """A station gives its access point up, and looks for another one at once."""
        self._leave(host)
        self._stations[host].scanned_ns = None

    def _watch(self, access_point: int, host: int, power_dbm: float) -> None:
        """A station looks at a signal, and scans if it is time."""
        station, now_ns = self._stations[host], self._air.now_ns
        idle = station.doing is _Doing.NOTHING and station.up
        if station.access_point is None:
            since_ns = None if station.scanned_ns is None else now_ns - station.scanned_ns
            if idle and power_dbm >= self._found_dbm and (
                    since_ns is None or since_ns >= self._constants.again_ns):
                self._scan(host, station)
        elif station.access_point == access_point:
            station.scans.hear(now_ns, power_dbm)
            if idle and station.scans.begins(now_ns):
                self._scan(host, station)

    # Scans.

    def _scan(self, host: int, station: _Station) -> None:
        self._begin(station, _Doing.SCANNING)
        if self.power_save is not None:
            self.power_save.forget(host)
        station.scanned_ns = self._air.now_ns
        station.found = {}
        constants, channels = self._constants, sorted({*self._channels.values()})
        if self._roaming.scan == "all":
            channels = sorted({*channels, *constants.channels})
        if station.access_point is None:
            self._air.at(self._air.now_ns + sum(map(constants.dwell_ns, channels)),
                         self._asked_all, (host, station.turn))
        else:
            self._visit((host, station.turn, channels))

    def _visit(self, scan: tuple[int, int, list[int]]) -> None:
        """Leave the own channel for the first of these."""
        host, turn, _ = scan
        if self._stations[host].turn == turn:
            self._outlets[host].pause(lambda _: self._say(
                host, turn, AirOutlet.keep, partial(self._go, self._air.now_ns, scan)))

    def _say(self, host: int, turn: int, kept: Callable[[AirOutlet, int], None],
             then: Callable[[], object]) -> None:
        """Tell the own access point that the station sleeps, or is back, so that it keeps what
        comes for it, or not; go on after that."""
        station = self._stations[host]
        if station.turn == turn and station.access_point is not None:
            outlet = self._outlets[station.access_point]
            self.control.send(host, (station.access_point,), self._constants.sleep_frame_bytes,
                              False, partial(self._said, partial(kept, outlet, host), then))

    def _said(self, kept: Callable[[], None], then: Callable[[], object], _: ports.Frame,
              __: Sequence[int], ___: ports.Deliver | ports.Drop, ____: dict[int, str]) -> None:
        kept()
        self._air.at(self._air.now_ns + self._ack_ns, lambda _: then())

    def _go(self, left_ns: int, scan: tuple[int, int, list[int]]) -> None:
        host, turn, channels = scan
        station = self._stations[host]
        if station.turn == turn and station.access_point is not None:
            self._radio.tune(host, channels[0])
            self._air.at(self._air.now_ns + self._constants.dwell_ns(channels[0]), self._heard,
                         (left_ns, scan))

    def _heard(self, visit: tuple[int, tuple[int, int, list[int]]]) -> None:
        """A station has listened to a channel: it goes to the next one, or returns first."""
        left_ns, (host, turn, (channel, *channels)) = visit
        station, constants = self._stations[host], self._constants
        if station.turn != turn or station.access_point is None:
            return
        self._find(host, channel)
        scan = host, turn, channels
        if channels and constants.stays_away(self._air.now_ns - left_ns, channels[0]):
            self._go(left_ns, scan)
        else:
            self._radio.tune(host, self._channels[station.access_point])
            self._say(host, turn, AirOutlet.release, partial(self._home, scan))

    def _home(self, scan: tuple[int, int, list[int]]) -> None:
        host, turn, channels = scan
        station = self._stations[host]
        if station.turn != turn or station.access_point is None:
            return
        self._outlets[host].resume()
        if channels:
            self._air.at(self._air.now_ns + self._constants.home_ns, self._visit, scan)
        else:
            self._scanned((host, turn))

    def _find(self, host: int, channel: int | None = None) -> None:
        """Look for the access points on a channel (None: on all)."""
        for one, own in self._channels.items():
            if self.runs(one) and channel in (None, own) and (
                    power_dbm := self._power_dbm(one, host)) >= self._found_dbm:
                self._stations[host].found[one] = power_dbm

    def _asked_all(self, which: tuple[int, int]) -> None:
        host, turn = which
        if self._stations[host].turn == turn:
            self._find(host)
            self._scanned(which)

    def _scanned(self, which: tuple[int, int]) -> None:
        host, turn = which
        station = self._stations[host]
        if station.turn != turn:
            return
        self._begin(station, _Doing.NOTHING)
        self._is_active(host)
        own = station.access_point
        if station.found:
            best = max(station.found, key=lambda one: (station.found[one], -one))
            if best != own and (own is None or self._roaming.goes(
                    self._power_dbm(own, host), station.found[best], self._channels[own])):
                self._join(host, station, best)

    # Joining.

    def _join(self, host: int, station: _Station, access_point: int) -> None:
        """Leave the present access point, if there is one, and join another one."""
        turn = self._begin(station, _Doing.JOINING)

        def ask(_: None) -> None:
            if station.turn == turn:
                fast = station.access_point is not None and self._settings.fast_transition
                self._leave(host)
                self._radio.tune(host, self._channels[access_point])
                station.handshake = Handshake(
                    self.control, host, access_point, steps(self._settings.security, fast),
                    self._constants, partial(self._joined, host, access_point))

        self._outlets[host].pause(ask)

    def _joined(self, host: int, access_point: int, came: bool) -> None:
        station = self._stations[host]
        self._begin(station, _Doing.NOTHING)
        if not (came and self.runs(access_point)):
            return
        before = self._known.get(host)
        station.access_point = self._known[host] = access_point
        self.loose.discard(host)
        station.missed = 0
        if before is not None and before != access_point:
            self._outlets[before].flush(host, "roamed")
        self._outlets[access_point].release(host)
        now_ns = self._air.now_ns
        station.scans.begin(now_ns, self._is_weak(access_point, host))
        names, left = self._names, station.left
        self.handovers.append(ports.Handover(
            now_ns, host, None if left is None else names[left], names[access_point],
            now_ns - station.since_ns))
        self._notify(host, names[access_point])
        self._outlets[host].resume()
        self._is_active(host)

    def _leave(self, host: int) -> None:
        """The station hangs on no access point any more; what waits in it is lost."""
        station = self._stations[host]
        if station.access_point is not None:
            station.left, station.access_point = station.access_point, None
            self.loose.add(host)
            unserved_ns, station.unserved_ns = station.unserved_ns, None
            station.since_ns = self._air.now_ns if unserved_ns is None else unserved_ns
            self._notify(host, None)
            self._outlets[host].flush(None, "not_associated")
            if self.power_save is not None:
                self.power_save.forget(host)

    def _notify(self, host: int, access_point: str | None) -> None:
        for note in self._notes:
            note(host, access_point)

    def _is_active(self, host: int) -> None:
        if self.power_save is not None:
            self.power_save.active(host)

    def _rests_at(self, host: int) -> int | None:
        """The access point of a station that does nothing else."""
        station = self._stations[host]
        return station.access_point if station.doing is _Doing.NOTHING else None

    def _begin(self, station: _Station, doing: _Doing) -> int:
        """Do something else from now on; whatever was going on is over. Returns its turn."""
        if station.handshake is not None:
            station.handshake.cancel()
            station.handshake = None
        station.doing, station.turn, station.missed = doing, station.turn + 1, 0
        return station.turn

    # Signals.

    @property
    def _found_dbm(self) -> float:
        return self._radio.budget.found_dbm

    def _is_weak(self, access_point: int, host: int) -> bool:
        return self._power_dbm(access_point, host) < self._roaming.threshold_dbm

    def _power_dbm(self, access_point: int, host: int) -> float:
        return float(self._radio.powers_dbm()[access_point, host])
