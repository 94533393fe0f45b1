"""The air: the stations of radios that share a channel, and the fates of their frames."""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from desim import ports
from desim.errors import InputError, ModelError
from netmodels.radio.budget import PairLosses, RadioLinks
from netmodels.radio.dcf.stations import EXPIRED, HEARD, NEVER, RECEIVED, TRIED, Stations
from netmodels.radio.errors import error_table
from netmodels.radio.fates import QueuedFrame
from netmodels.radio.times import AirTimes

if TYPE_CHECKING:
    from netmodels.radio.dcf.radio import DcfRadio

_EXPIRED = ports.Drop("expired")
# The parameters that may differ between radios that share the air.
_OWN = ("access_category", "mcs", "rate_bps", "broadcast_rate_bps", "rts_bytes", "channel",
        "channels", "preset", "fidelity")


class Air:
    """The stations of all radios that have a channel in common: host k of the n-th radio is station
    n * hosts + k. They contend with each other and are heard by each other, and a frame is for the
    hosts of its own radio alone.

    The stations are made when they are needed for the first time; by then all radios have joined.
    """

    stations: Stations  # once it is open

    def __init__(self) -> None:
        self.radios: list[DcfRadio] = []
        self.opened = False
        self._settled_ns = -1
        self._wake_booked = False
        self._wake_call: ports.Handle | None = None
        self._wake_ns = NEVER

    def channels(self) -> set[int]:
        """The numbers of the channels in use."""
        return {int(channel) for radio in self.radios for channel in radio.budget.channels}

    def open(self) -> None:
        """Make the stations: all radios are known."""
        if self.opened:
            return
        self.opened = True
        radio = self.radios[0]
        params, standard, budget = radio.params, radio.standard, radio.budget
        context, hosts = radio.context, radio.hosts
        everybody = hosts * len(self.radios)
        if len(self.radios) > 1:
            budget = replace(budget, channels=np.concatenate([
                one.budget.channels for one in self.radios]),
                antennas=ports.Antennas(*map(np.concatenate, zip(*(
                    one.budget.antennas for one in self.radios), strict=True))),
                shadows=params.shadows(context, everybody))
        self._hosts, self._context, self._budget = len(hosts), context, budget
        self._update_ns = params.update_ns
        self._fades = None if params.fading is None else params.fading.of(
            everybody, context.stream, standard.carrier_hz(params.channel),
            params.receiver().preamble_dbm)
        keys = np.array([one.context.stream("backoff", host).integers(2 ** 64, dtype=np.uint64)
                         for one in self.radios for host in hosts], np.uint64)
        errors = error_table(tuple(rate.scheme for rate in standard.rates))
        self._judges = [one.context.judge_transmission for one in self.radios]
        judged = any(judge is not None for judge in self._judges)
        ledgers = [one.ledger for one in self.radios if one.ledger is not None]
        self._learner = None if params.rate_control is None else params.rate_control.of(
            standard, radio.rate, params.retries, context.stream, self._ratio)
        self._noise_mw = 10 ** (params.receiver().noise_dbm / 10)
        self.stations = Stations(standard, keys, errors, params.receiver(),
                                 params.queue, params.retries,
                                 params.constants.window_failures or params.retries,
                                 params.constants.lifetime_ns,
                                 first_rate=None if self._learner is None else self._learner.first,
                                 judged=judged, difs_first=params.constants.difs_first,
                                 timed=bool(ledgers), aggregation=params.aggregated(), access=[
                                     one.access_of(host)
                                     for one in self.radios for host in one.hosts])
        self._times = AirTimes(ledgers, self._hosts, self.stations) if ledgers else None
        self._unaware = params.reception.constants.unaware
        self._ranks = [one.params.access(standard).rank for one in self.radios]
        self._contenders: dict[tuple[int, int], int] = {}  # beside stations: by station and rank
        self._radio_of = self.stations.radios
        self._waiting: dict[tuple[int, int], QueuedFrame] = {}  # by station and place in its queue
        self._arrived: dict[tuple[int, int], QueuedFrame] = {}  # the last one that left each place
        self._updated_ns, self._epoch, self._places = 0, -1, np.empty((0, 2))
        self._people: np.ndarray | None = None
        self._losses: PairLosses
        self._powers_of: PairLosses | None = None  # those whose powers are known
        self._powers_dbm: np.ndarray
        self._mean: RadioLinks  # the links without fading, and with it
        self._links: RadioLinks
        self._alone = len(self.radios) == 1
        self._plain = self._alone and not judged  # all stations that hear a frame may have it
        self._seen: list[np.ndarray] = []

    def send(self, number: int, frame: ports.Frame, size_bytes: int, last_bytes: int, rate: int,
             rts: bool, rank: int | None = None) -> int:
        """Queue a frame of the radio of that ``number``, of packets of so many bytes on the air.
        Returns the number of its packets for which the queue had a place. ``rank``: of the access
        category (None: the radio's)."""
        now_ns = self._context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)
        first = number * self._hosts
        station = first + frame.source
        if rank is not None and rank != self._ranks[number]:
            station = self._contender(number, station, rank)
        position = self.stations.enqueue(
            now_ns, station, -1 if frame.broadcast else first + frame.receivers[0],
            size_bytes, rate, frame.segments, last_bytes, rts)
        if not self._wake_booked:
            self._book_wake()
        if position is None:
            return 0
        fit = self.stations.fit
        self._waiting[station, position] = QueuedFrame(frame, fit)
        if self._times is not None:
            self._times.taken(station, position, now_ns)
        return fit

    def _contender(self, number: int, station: int, rank: int) -> int:
        """The one that sends packets of a category by a station's radio."""
        key = station, rank
        if key not in self._contenders:
            radio, host = self.radios[number], station % self._hosts
            access = radio.access_of(radio.hosts[host], rank)
            self._contenders[key] = self.stations.contend(
                station, access, int(radio.context.stream(
                    "backoff", radio.hosts[host], access.name).integers(2 ** 64, dtype=np.uint64)))
        return self._contenders[key]

    def catch_up(self) -> None:
        """Take all outcomes up to now."""
        now_ns = self._context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)

    def tune(self, number: int, host: int, channel: int) -> None:
        """Let a host of the radio of that ``number`` be on ``channel`` from now on. Not from the
        settlement of a frame."""
        self.catch_up()
        self._budget.channels[number * self._hosts + host] = channel
        self._update_links(self._context.now_ns)
        self._mean = self._budget.on_channels(self._signals)
        self._link(self._context.now_ns)
        if not self._wake_booked:
            self._book_wake()

    def powers_dbm(self, number: int) -> np.ndarray:
        """``Budget.powers_dbm`` of the hosts of the radio of that ``number``, without fading."""
        self.catch_up()
        if self._powers_of is not self._losses:
            self._powers_of, self._powers_dbm = self._losses, self._budget.powers_dbm(self._losses)
        own = slice(number * self._hosts, (number + 1) * self._hosts)
        return self._powers_dbm[own, own]

    def _book_wake(self) -> None:
        """Foresee the next outcome once for all that is sent in this instant, also by senders whose
        frames are settled now."""
        self._wake_booked = True
        self._context.at(self._context.now_ns, self._foresee)

    def _foresee(self, _: None) -> None:
        """Book a call for the next outcome, or for the next step of fading if that is earlier."""
        self._wake_booked = False
        next_ns = self.stations.next_ns
        if self._fades is not None and next_ns < NEVER:
            next_ns = min(next_ns, self._fades.until_ns)
        if next_ns == self._wake_ns:
            return
        if self._wake_call is not None:
            self._wake_call.cancel()
        self._wake_ns = next_ns
        self._wake_call = None if next_ns >= NEVER else self._context.at(next_ns, self._wake_up)

    def _wake_up(self, _: None) -> None:
        self._wake_call, self._wake_ns = None, NEVER
        self._settle(self._context.now_ns)
        if not self._wake_booked:
            self._book_wake()

    def _settle(self, now_ns: int) -> None:
        """Take all outcomes, update the links, and only then settle frames: a settled frame may let
        its sender send again at once, and a new frame may take the place of one in question."""
        self._settled_ns = now_ns
        stations = self.stations
        if not stations.step(now_ns):
            self._update_links(now_ns)
            return
        plain = self._plain
        if plain and (ended := stations.ended_broadcast()):
            station, position, *_ = ended
            if self._times is not None:
                self._times.over(station, position, self._waiting[station, position].frame)
            self._update_links(now_ns)
            self._settle_packet(*ended)
            return
        decided, learner, queued = [], self._learner, self._waiting
        for _, what, station, position, hearer, packet in stations.outcomes():
            if learner is not None and what == TRIED:
                own = self._radio_of[station]
                stations.choose(own, hearer, *learner.sent(own, hearer, position, packet, now_ns))
                continue
            key = station, position
            # A sender whose acknowledgement was lost repeats a packet that has arrived.
            waiting = queued.get(key) or self._arrived[key]
            if not plain:
                if not self._concerns(waiting, station, position, what, hearer, packet):
                    continue
                what, hearer = RECEIVED if what == HEARD else what, hearer % self._hosts
            if waiting.note(what, hearer, packet):
                self._arrived[key] = queued.pop(key)
                if self._times is not None:
                    self._times.over(station, position, waiting.frame)
                decided.append((what, station, waiting))
        self._update_links(now_ns)
        for what, station, waiting in decided:
            self._settle_frame(what, station, waiting)

    def _ratio(self, station: int, hearer: int) -> float:
        """The ratio of signal to noise of a station at another, as the links are; 0 where nothing
        is heard."""
        links = self._links
        begin, end = links.first[station:station + 2]
        k = begin + np.searchsorted(links.hearer[begin:end], hearer)
        return float(links.mw[k]) / self._noise_mw if k < end and links.hearer[k] == hearer else 0.0

    def _update_links(self, now_ns: int) -> None:
        """Make the links anew if fading has changed; or places, people or walls may have, and it is
        time."""
        places = self._context.positions(now_ns) if self._alone else self._where(now_ns)
        obstacles, fades = self._context.obstacles, self._fades
        if obstacles.epoch != self._epoch or (
                (places is not self._places or obstacles.people is not self._people)
                and now_ns >= self._updated_ns + self._update_ns):
            self._updated_ns, self._places, self._epoch = now_ns, places, obstacles.epoch
            self._people = obstacles.people
            self._losses = self._budget.losses(places, obstacles)
            self._signals = self._budget.signals(self._losses)
            self._mean = self._budget.on_channels(self._signals)
        elif fades is None or now_ns < fades.until_ns:
            return
        self._link(now_ns)

    def _link(self, now_ns: int) -> None:
        """Let the stations have the links of now, with fading."""
        fades = self._fades
        self._links = links = self._mean if fades is None else fades.links(self._mean, now_ns)
        self.stations.link(now_ns, links.first, links.hearer, links.mw,
                           links.delays_ns(self._places) if self._unaware else 0)

    def _where(self, now_ns: int) -> np.ndarray:
        """[stations, 2] m of several radios, the same object until somebody moves."""
        places = [radio.context.positions(now_ns) for radio in self.radios]
        if any(now is not then for now, then in zip_longest(places, self._seen)):
            self._seen, self._together = places, np.concatenate(places)
        return self._together

    def _settle_frame(self, what: int, station: int, waiting: QueuedFrame) -> None:
        """Settle a frame that has left its queue."""
        frame, own = waiting.frame, self._radio_of[station]
        number = own // self._hosts
        context = self.radios[number].context
        if not frame.broadcast:
            waiting.settle(context)
        elif what == EXPIRED:
            context.settle_many(frame, frame.receivers, _EXPIRED)
        else:
            first = number * self._hosts
            finders = [finder - first for finder in self._links.finders(own)
                       if first <= finder < first + self._hosts]
            waiting.settle_broadcast(context, finders)

    def _settle_packet(self, station: int, position: int, received: int, *hosts: int) -> None:
        """Settle a broadcast of one packet; the first so many of ``hosts`` have received it."""
        self._waiting.pop((station, position)).settle_packet(
            self._context, list(hosts[:received]), list(hosts[received:]),
            self._links.finders(self._radio_of[station]))

    def _concerns(self, waiting: QueuedFrame, station: int, position: int, what: int, hearer: int,
                  packet: int) -> bool:
        """Whether an outcome is one of this frame's own radio, and passes its rules."""
        number = self._radio_of[station] // self._hosts
        if hearer >= 0 and hearer // self._hosts != number:
            return False  # a broadcast of another radio
        if what == HEARD or (what == RECEIVED and waiting.frame.broadcast
                             and self._judges[number] is not None):
            return self._passes(waiting, station, position, what, hearer % self._hosts, packet)
        return True

    def _passes(self, waiting: QueuedFrame, station: int, position: int, what: int, receiver: int,
                packet: int) -> bool:
        """Whether rules let a packet pass that ``receiver`` has decoded, and it has to be noted:
        each one of a broadcast, and the last one of a train when it comes for the first time."""
        frame, now_ns = waiting.frame, self._context.now_ns
        number = self._radio_of[station] // self._hosts
        if what == RECEIVED and not frame.among((receiver,)):
            return True
        judge = self._judges[number]
        drop = None if judge is None else judge(waiting.packet(packet, receiver), receiver)
        if what == HEARD:
            first = self.stations.judge(now_ns, station, position, packet, drop is not None)
            return first and packet == waiting.packets - 1
        if drop is not None:
            waiting.lose(drop.reason, receiver, packet)
            self.stations.miss(now_ns, number * self._hosts + receiver)
        return drop is None


class Airs:
    """The airs of a run."""

    def __init__(self) -> None:
        self.all: list[Air] = []

    def join(self, radio: DcfRadio) -> None:
        """Let a radio share the air with those that have a channel in common with it, in the same
        band. Raises ``InputError`` where their channels overlap without being the same, or where
        the radios differ in what this model knows only once for all who share the air."""
        joined = Air()
        joined.radios.append(radio)
        own = joined.channels()
        for air in list(self.all):
            other = air.radios[0]
            if other.standard.band_hz != radio.standard.band_hz:
                continue
            numbers = air.channels()
            if own & numbers:
                if air.opened:
                    raise ModelError("a radio starts when others on its channel have begun to send")
                _check(radio, other)
                joined.radios[:0] = air.radios
                self.all.remove(air)
            for one in sorted(own):
                for number in sorted(numbers):
                    if allowed := radio.standard.overlap(one, other.standard, number):
                        raise InputError(f".channel: {one} overlaps channel {number} of another "
                                         "medium, which this model knows nothing of; allowed: "
                                         + allowed)
        self.all.append(joined)
        for member in joined.radios:
            member.air = joined


def _check(radio: DcfRadio, other: DcfRadio) -> None:
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
