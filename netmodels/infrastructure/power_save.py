"""Power save: stations that sleep between beacons, and the frames that wait for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from desim import ports
from netmodels.infrastructure.joining import ControlFrames, JoiningConstants
from netmodels.infrastructure.outlets import AirHop, AirOutlet


class PowerSave:
    """A station that has neither sent nor received for a while says that it sleeps (dynamic power
    save of mac80211). Its access point then keeps unicast frames for it; a beacon announces them,
    and a station that has heard it wakes and takes all of them. What a station sends wakes it.
    Broadcasts wait for the next beacon with a DTIM while any station of theirs sleeps.

    The radio of a sleeping station senses the medium as before: only its frames wait."""

    def __init__(self, control: ControlFrames, constants: JoiningConstants,
                 outlets: Sequence[AirOutlet], access_point: Callable[[int], int | None]) -> None:
        """``access_point``: of a station that may sleep now, else None."""
        self._control, self._air, self._constants = control, control.air, constants
        self._outlets, self._access_point = outlets, access_point
        self._asleep: set[int] = set()
        self._active_ns: dict[int, int] = {}  # by station that is to fall asleep: its last frame
        self._beacons: dict[int, int] = {}  # by access point, how many there were
        self._held: dict[int, list[AirHop]] = {}  # by access point: broadcasts

    def active(self, station: int) -> None:
        """A station sends or receives a frame of its own."""
        now_ns = self._air.now_ns
        if station in self._asleep:
            self._asleep.discard(station)
            self._say(station, AirOutlet.release)
        if station not in self._active_ns:
            self._air.at(now_ns + self._constants.awake_ns, self._rest, station)
        self._active_ns[station] = now_ns

    def forget(self, station: int) -> None:
        """A station goes to another channel, or leaves its access point: it does not sleep."""
        self._asleep.discard(station)

    def heard(self, station: int, access_point: int) -> None:
        """A station has heard a beacon of its access point."""
        if station in self._asleep and self._outlets[access_point].keeps_for(station):
            self.active(station)

    def hold(self, access_point: int, hop: AirHop) -> bool:
        """Hold a broadcast if one of its stations sleeps. Returns whether it does."""
        sleeps = not self._asleep.isdisjoint(hop.receivers)
        if sleeps:
            self._held.setdefault(access_point, []).append(hop)
        return sleeps

    def beacon(self, access_point: int) -> None:
        """An access point has sent a beacon: behind a DTIM broadcasts follow."""
        number = self._beacons.get(access_point, 0)
        self._beacons[access_point] = number + 1
        if number % self._constants.dtim == 0:
            for hop in self._held.pop(access_point, ()):
                self._outlets[access_point].take(hop)

    def stop(self, access_point: int, reason: str) -> None:
        """An access point stops: the broadcasts that it holds are lost."""
        for hop in self._held.pop(access_point, ()):
            packets = range(len(hop.sizes))
            hop.settle(hop.receivers, packets, dict.fromkeys(packets, reason), None)

    def _rest(self, station: int) -> None:
        due_ns = self._active_ns[station] + self._constants.awake_ns
        if due_ns > self._air.now_ns:
            self._air.at(due_ns, self._rest, station)
            return
        del self._active_ns[station]
        if self._access_point(station) is not None:
            self._asleep.add(station)
            self._say(station, AirOutlet.keep)

    def _say(self, station: int, kept: Callable[[AirOutlet, int], None]) -> None:
        """Tell the access point that a station sleeps, or is awake."""
        access_point = self._access_point(station)
        if access_point is not None:
            self._control.send(
                station, (access_point,), self._constants.sleep_frame_bytes, False,
                partial(self._said, partial(kept, self._outlets[access_point], station),
                        station in self._asleep, station))

    def _said(self, kept: Callable[[], None], sleeps: bool, station: int, _: ports.Frame,
              __: Sequence[int], ___: ports.Deliver | ports.Drop, ____: dict[int, str]) -> None:
        if sleeps == (station in self._asleep):
            kept()
