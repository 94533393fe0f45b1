"""The air that several radios share."""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from desim import ports
from desim.errors import InputError, ModelError
from netmodels.radio.dcf.stations import ACKED, EXPIRED, FAILED, HEARD, NEVER, RECEIVED, Stations
from netmodels.radio.errors import error_table
from netmodels.radio.fates import QueuedFrame
from netmodels.radio.shadowing import Shadows

if TYPE_CHECKING:
    from netmodels.radio import Radio

_EXPIRED = ports.Drop("expired")
# What may differ between radios that share the air.
_OWN = ("rate_bps", "broadcast_rate_bps", "rts_bytes", "channel", "channels", "preset", "fidelity")


class Member(NamedTuple):
    """A radio with its medium's context and hosts."""

    radio: Radio
    context: ports.Context
    hosts: tuple[str, ...]


class Air:
    """The stations of all radios that have a channel in common: host k of the n-th radio is station
    n * hosts + k. They contend with each other and are heard by each other, and a frame is for the
    hosts of its own radio alone.

    It comes into being when it is needed for the first time; by then all have joined.
    """

    def __init__(self) -> None:
        self.members: list[Member] = []
        self.stations: Stations | None = None
        self._settled_ns = -1
        self._look_booked = False
        self._wake: Any = None
        self._wake_ns = NEVER

    def channels(self) -> set[int]:
        """The numbers of those in use."""
        return {int(channel) for member in self.members
                for channel in member.radio.budget.channels}

    def open(self) -> None:
        """All radios are known: their stations, and who hears whom."""
        if self.stations is not None:
            return
        radio, context, hosts = self.members[0]
        params, standard, budget = radio.params, radio.standard, radio.budget
        everybody = hosts * len(self.members)
        if len(self.members) > 1:
            budget = replace(budget, channels=np.concatenate([
                member.radio.budget.channels for member in self.members]),
                shadows=params.shadowing and Shadows(params.shadowing, everybody, context.stream))
        self._hosts, self._context, self._budget = len(hosts), context, budget
        self._update_ns = params.update_ns
        self._fades = params.fading and params.fading.of(
            everybody, context.stream, standard.carrier_hz(params.channel),
            params.reception.found_dbm)
        keys = np.array([member.context.stream("backoff", host).integers(2 ** 64, dtype=np.uint64)
                         for member in self.members for host in hosts], np.uint64)
        errors = error_table(tuple(rate.mbps for rate in standard.rates))
        self._judged = [member.context.judge_transmission is not None for member in self.members]
        self.stations = Stations(standard, keys, errors, params.reception.for_stations(),
                                 params.queue, params.retries,
                                 params.window_failures or params.retries, params.lifetime_ns,
                                 first_rate=params.rate_control and radio.rate,
                                 judged=any(self._judged), difs_first=params.difs_first)
        self._unaware = params.reception.unaware
        self._attempts = {}
        if params.rate_control:
            arf = params.rate_control.of(standard.alike(radio.rate), radio.rate)
            self._attempts = {ACKED: arf.acknowledged, FAILED: arf.failed}
        self._waiting: dict[tuple[int, int], QueuedFrame] = {}  # by station and place in its queue
        self._looked_ns, self._places, self._epoch = 0, None, None
        self._alone = len(self.members) == 1
        self._plain = self._alone and not any(self._judged)  # whoever hears a frame may have it
        self._seen: list[np.ndarray] = []

    def send(self, number: int, frame: ports.Frame, size_bytes: int, last_bytes: int, rate: int,
             rts: bool) -> bool:
        """The member of that ``number`` has a frame of packets of so many bytes on the air. Returns
        whether there is room for it."""
        now_ns = self._context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)
        first = number * self._hosts
        station = first + frame.source
        position = self.stations.enqueue(
            now_ns, station, -1 if frame.broadcast else first + frame.receivers[0],
            size_bytes, rate, frame.segments, last_bytes, rts)
        if not self._look_booked:
            self._book_look()
        if position is None:
            return False
        self._waiting[station, position] = QueuedFrame(frame)
        return True

    def catch_up(self) -> None:
        """Take what has been decided by now."""
        now_ns = self._context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)

    def _book_look(self) -> None:
        """Once for all that is sent in this instant, also by those who are told something now."""
        self._look_booked = True
        self._context.at(self._context.now_ns, self._look_ahead)

    def _look_ahead(self, _: Any) -> None:
        """Be there when the next frame's fate is decided."""
        self._look_booked = False
        next_ns = int(self.stations.next_ns)
        if self._fades is not None and next_ns < NEVER:
            next_ns = min(next_ns, self._fades.until_ns)
        if next_ns == self._wake_ns:
            return
        if self._wake is not None:
            self._wake.cancel()
        self._wake_ns = next_ns
        self._wake = None if next_ns >= NEVER else self._context.at(next_ns, self._wake_up)

    def _wake_up(self, _: Any) -> None:
        self._wake, self._wake_ns = None, NEVER
        self._settle(self._context.now_ns)
        if not self._look_booked:
            self._book_look()

    def _settle(self, now_ns: int) -> None:
        """Take what has been decided, see who is where, then tell. (Whoever is told may send again
        at once, and a new frame may have the place of one in question.)"""
        self._settled_ns = now_ns
        decided, attempts, queued, plain = [], self._attempts, self._waiting, self._plain
        for _, what, station, position, hearer, packet in self.stations.advance(now_ns):
            if what in attempts:
                self.stations.choose(station, hearer, attempts[what](station, hearer))
                continue
            waiting = queued[station, position]
            if not plain:
                if not self._concerns(waiting, station, what, hearer, packet):
                    continue
                what, hearer = RECEIVED if what == HEARD else what, hearer % self._hosts
            if waiting.note(what, hearer, packet):
                del queued[station, position]
                decided.append((what, station, waiting))
        self._look_around(now_ns)
        for what, station, waiting in decided:
            self._tell(what, station, waiting)

    def _look_around(self, now_ns: int) -> None:
        """Links from where the hosts are, if that may have changed and it is time."""
        places = self._context.positions(now_ns) if self._alone else self._where(now_ns)
        obstacles, fades = self._context.obstacles, self._fades
        if obstacles.epoch != self._epoch or (
                places is not self._places and now_ns >= self._looked_ns + self._update_ns):
            self._looked_ns, self._places, self._epoch = now_ns, places, obstacles.epoch
            self._mean = self._budget.links(places, obstacles)
        elif fades is None or now_ns < fades.until_ns:
            return
        self._links = links = self._mean if fades is None else fades.links(self._mean, now_ns)
        self.stations.link(now_ns, links.first, links.hearer, links.mw,
                           links.delays_ns(self._places) if self._unaware else 0)

    def _where(self, now_ns: int) -> np.ndarray:
        """[stations, 2] m of several radios, the same object until somebody moves."""
        places = [member.context.positions(now_ns) for member in self.members]
        if any(now is not then for now, then in zip_longest(places, self._seen)):
            self._seen, self._together = places, np.concatenate(places)
        return self._together

    def _tell(self, what: int, station: int, waiting: QueuedFrame) -> None:
        frame, number = waiting.frame, station // self._hosts
        context = self.members[number].context
        if what == EXPIRED:
            context.settle_many(frame, frame.receivers, _EXPIRED)
        elif frame.broadcast:
            first = number * self._hosts
            waiting.tell_all(context, [finder - first for finder in self._links.finders(station)
                                       if first <= finder < first + self._hosts])
        else:
            waiting.tell(context)

    def _concerns(self, waiting: QueuedFrame, station: int, what: int, hearer: int, packet: int
                  ) -> bool:
        """Whether an outcome belongs to this frame's own radio, and no rule takes it away."""
        number = station // self._hosts
        if hearer >= 0 and hearer // self._hosts != number:
            return False  # a broadcast of another radio's, or what is left of it
        return not (what == HEARD or what == RECEIVED and self._judged[number]) or self._passes(
            waiting, station, what, hearer % self._hosts, packet)

    def _passes(self, waiting: QueuedFrame, station: int, what: int, receiver: int, packet: int
                ) -> bool:
        """Whether a packet decoded at ``receiver`` is not lost by rules and has to be noted: any
        one of a broadcast, and the last one of a train when it comes for the first time."""
        frame, now_ns, number = waiting.frame, self._context.now_ns, station // self._hosts
        if what == RECEIVED and not frame.among((receiver,)):
            return True
        drop = None
        if self._judged[number]:
            drop = self.members[number].context.judge_transmission(
                waiting.packet(packet, receiver), receiver)
        if what == HEARD:
            first = self.stations.judge(now_ns, station, drop is not None)
            return first and packet == frame.segments - 1
        if drop is not None:
            waiting.lose(drop.reason, receiver, packet)
            self.stations.miss(now_ns, number * self._hosts + receiver)
        return drop is None


class Airs:
    """All that there are in a run."""

    def __init__(self) -> None:
        self.all: list[Air] = []

    def join(self, member: Member) -> None:
        """Whoever has a channel in common with others, in the same band, shares the air with them.
        Raises ``InputError`` where their channels overlap without being the same, or where the
        radios differ in what this model knows only once for all who share the air."""
        radio = member.radio
        joined = Air()
        joined.members.append(member)
        own = joined.channels()
        for air in list(self.all):
            other = air.members[0].radio
            if other.standard.band_hz != radio.standard.band_hz:
                continue
            numbers = air.channels()
            if own & numbers:
                if air.stations is not None:
                    raise ModelError("a radio starts when others on its channel have begun to send")
                _check(radio, other)
                joined.members[:0] = air.members
                self.all.remove(air)
            for one in sorted(own):
                near = [number for number in sorted(numbers)
                        if 0 < abs(one - number) < radio.standard.channels_apart]
                if near:
                    raise InputError(f".channel: {one} overlaps channel {near[0]} of another "
                                     "medium, which this model knows nothing of; allowed: the "
                                     f"same, or {radio.standard.channels_apart} and more apart")
        self.all.append(joined)
        for one in joined.members:
            one.radio.air = joined


def _check(radio: Radio, other: Radio) -> None:
    """Raises ``InputError`` where two radios that share the air differ."""
    for name in type(radio.params).model_fields:
        if name in _OWN and not (name == "rate_bps" and radio.params.rate_control):
            continue
        own, theirs = getattr(radio.params, name), getattr(other.params, name)
        if own != theirs:
            raise InputError(
                f".{ports.yaml_key(name)}: another radio shares its channel, and has another value "
                f"({theirs}, here {own}); allowed to differ: "
                f"{', '.join(ports.yaml_key(one) for one in _OWN)}")
    if radio.standard != other.standard:
        raise InputError(".standard: another radio shares its channel, and has other constants")
