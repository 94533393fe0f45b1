"""Stations that share the air by the 802.11 distributed coordination function."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from desim.ports.kernels import compiled_function
from netmodels.kernels import Addresses
from netmodels.radio.dcf.contenders import contenders, no_events, with_another
from netmodels.radio.dcf.kernels import machine as kernels
from netmodels.radio.dcf.kernels import records, times
from netmodels.radio.dcf.kernels.aggregates import REQUESTS
from netmodels.radio.dcf.kernels.records import (
    DONE,
    DROPPED,
    EXPIRED,
    GIVEN_UP,
    HEARD,
    LAPSED,
    MISSED,
    NEVER,
    RECEIVED,
    TRIED,
)
from netmodels.radio.errors import ErrorTable
from netmodels.radio.standards import (
    ACK_BYTES,
    BLOCK_REQUEST_BYTES,
    CF_END_BYTES,
    CTS_BYTES,
    DELIMITER_BYTES,
    MAC_BYTES,
    RTS_BYTES,
    Access,
    Standard,
)

__all__ = ["DONE", "DROPPED", "EXPIRED", "GIVEN_UP", "HEARD", "LAPSED", "MISSED", "NEVER",
           "RECEIVED", "TRIED", "Aggregation", "Counts", "Outcome", "Reception", "Stations"]


@dataclass(frozen=True)
class Reception:
    """The thresholds and rules of a receiver."""

    noise_dbm: float = -93.965  # thermal noise of 20 MHz at 290 K, and 7 dB of the receiver
    energy_dbm: float = -62.0  # whatever it is, it makes the medium busy
    preamble_dbm: float = -82.0  # the least that a preamble is found at,
    preamble_db: float = 4.0  # and how much it must exceed noise and interference
    detection_ns: int = 4_000  # of a preamble (ns-3's PreambleDetectionModel; 4 us of 802.11a)
    unaware: bool = False  # it misses interference that came just before a frame (``arrive``)
    gives_up: bool = False  # it does not follow a frame whose header has errors (``read_header``)
    eifs_at_end: bool = False  # EIFS begins with the end of the frame (``start_slots``)
    idle_dbm: float = -inf  # less does not make it busy for who has sent, until a new signal comes


@dataclass(frozen=True)
class Aggregation:
    """The limits of an aggregate of packets. ``endless``: a packet is given up when it has failed
    as often as a request for a block acknowledgement may. ``requests``: a station that misses a
    block acknowledgement sends a request for it before it sends anything again. ``apart``: a
    receiver hands each packet on when that is over, not with the aggregate."""

    packets: int = 64  # of a block acknowledgement (802.11-2016, 9.3.1.9.3)
    size_bytes: int = 65_535  # HT (19.3.24)
    time_ns: int = 5_484_000  # the legacy header cannot say more (table 21-29)
    amsdu_bytes: int = 0  # several packets as one MSDU up to this (0: each by itself)
    rts_bytes: int | None = None  # above this size an RTS goes first (None: never)
    endless: bool = False
    requests: bool = False
    apart: bool = False


# The fate of the frame at ``position`` in the queue of ``station``: time in ns, what, station,
# position, receiver, packet. RECEIVED: a unicast frame's last packet has arrived; of a broadcast
# one row a packet. MISSED: a packet of a broadcast had errors. DONE: the end of a broadcast.
# DROPPED: a unicast frame's packet was given up. EXPIRED: a frame has waited too long to begin.
# TRIED, only where rates adapt: an attempt is over; in the place of position and packet, how many
# packets it had and how many of them were acknowledged. HEARD
# replaces RECEIVED where transmissions are judged: the receiver decoded a packet of a unicast
# frame, and the caller judges it. GIVEN_UP and LAPSED, only where packets are aggregated, in the
# place of DROPPED and EXPIRED: a packet was given up, or was too old; RECEIVED says when the frame
# is over.
Outcome = tuple[int, int, int, int, int, int]


class Counts(NamedTuple):
    """[stations] each, of all their contenders: transmissions of data, those without a reply (of
    RTS too), packets given up."""

    transmitted: np.ndarray
    failures: np.ndarray
    dropped: np.ndarray


def _milliwatts(dbm: float) -> float:
    return 10 ** (dbm / 10)


def _rate(standard: Standard, rate: int) -> tuple[float, ...]:
    """A record of the kernels' table of rates."""
    how, lowest, reply = standard.rates[rate], standard.lowest(rate), standard.reply_rate(rate)
    return (how.mbps * 1e6, how.header_ns, how.payload_ns, lowest, how.bits, how.symbol_ns,
            standard.extension_ns, reply, standard.airtime_ns(ACK_BYTES, reply),
            standard.airtime_ns(RTS_BYTES, lowest), standard.airtime_ns(CTS_BYTES, lowest),
            standard.airtime_ns(standard.block_ack_bytes, reply),
            standard.airtime_ns(BLOCK_REQUEST_BYTES, reply),
            standard.airtime_ns(CF_END_BYTES, lowest))


def _limits(standard: Standard, aggregation: Aggregation | None, judged: bool, tries: int
            ) -> tuple[int, ...]:
    """The fields of the kernels' setup from ``most_packets`` to ``apart``."""
    if aggregation is None:
        return 1, 0, 0, 0, 0, 0, 0, 0, 0, 0
    rts_bytes = NEVER if aggregation.rts_bytes is None else aggregation.rts_bytes
    return (aggregation.packets, aggregation.size_bytes, aggregation.time_ns,
            DELIMITER_BYTES - standard.alone_bytes, rts_bytes, aggregation.amsdu_bytes,
            MAC_BYTES + standard.qos_bytes + standard.alone_bytes,
            REQUESTS if aggregation.endless else tries, aggregation.requests,
            aggregation.apart and not judged)


class Stations:
    """The stations on one channel.

    To find the next outcome, the state machine runs ahead on a copy of the stations. If nothing is
    sent and nobody moves before it, the copy replaces the original. Before anything is sent or
    moves at ``now_ns``, all outcomes up to ``now_ns`` must have been taken.

    ``keys`` [stations] uint64, of their random numbers. ``limit`` packets fit into each queue; of
    the frame that was given last, ``fit`` packets have a place. A packet is given up after
    ``tries`` failures; after ``reset_at`` in a row the contention window starts anew. After
    ``lifetime_ns`` (None: any time) what is left of a frame is not sent any more, unless it is a
    broadcast that has begun.
    Rates adapt if there is a ``first_rate``: unicast frames go at the one that was chosen for their
    receiver when they go on the air (``choose``), not at their own. Where transmissions are
    ``judged``, the caller of ``advance`` says at once which of them are lost (``judge``, ``miss``).
    With ``difs_first`` a packet that comes while the medium is idle waits for DIFS all the same,
    and needs no backoff then, even if the medium becomes busy in between. ``timed``: it keeps the
    parts of frames' time (``times``). Without ``aggregation`` each packet goes alone.
    ``access`` [stations] to the medium (None: the standard's).
    """

    def __init__(self, standard: Standard, keys: np.ndarray, errors: ErrorTable,
                 reception: Reception = Reception(), limit: int = 500, tries: int = 7,
                 reset_at: int = 7, lifetime_ns: int | None = None,
                 first_rate: int | None = None, judged: bool = False,
                 difs_first: bool = False, timed: bool = False,
                 aggregation: Aggregation | None = None,
                 access: Sequence[Access] | None = None) -> None:
        n, self._lifetime_ns = len(keys), lifetime_ns
        self._ended = np.empty(3 + n, np.int64)
        self.radios = [*range(n)]  # of each contender: the station whose radio it uses
        self._enqueue = compiled_function(kernels.enqueue)
        self._foresee = compiled_function(kernels.foresee)
        self._end = compiled_function(kernels.ended_broadcast)
        self._present = 0  # which of the two states is the present one
        self._next_ns: int | None = NEVER  # None: not foreseen yet
        self.fit = 0
        self._taken_ns = -1
        access = [standard.access] * n if access is None else access
        first = contenders(0, keys, access)
        setup = np.array([(
            standard.slot_ns, standard.sifs_ns, standard.eifs_ns - standard.difs_ns,
            reception.detection_ns, tries, reset_at,
            *map(_milliwatts, (reception.noise_dbm, reception.energy_dbm, reception.idle_dbm,
                               reception.preamble_dbm, reception.preamble_db)),
            errors.clear, errors.first_db, errors.step_db,
            reception.unaware, reception.eifs_at_end, reception.gives_up,
            difs_first, judged, *_limits(standard, aggregation, judged, tries),
            standard.qos_bytes > 0, 0)],
            records.SETUP)
        present = records.Dcf(
            first, no_events(n),
            np.zeros((1 + n, 2), np.int64), np.zeros((n, limit), records.FRAME),
            np.zeros(0, records.LINK),
            np.array([_rate(standard, k) for k in range(len(standard.rates))], records.RATE),
            np.ascontiguousarray(errors.log_log), setup,
            np.zeros(4 * n + 8 + (n * limit if lifetime_ns or aggregation else 0),
                     records.OUTCOME),
            np.zeros((0, 0), np.int16) if first_rate is None
            else np.full((n, n), first_rate, np.int16),
            np.zeros((n * timed, times.COLUMNS), np.int64),
            np.zeros((n * (aggregation is not None), limit), np.uint16))
        self._arrays = Addresses(
            present, present._replace(stations=first.copy(), due=present.due.copy(),
                                      times=present.times.copy(),
                                      packets=present.packets.copy()))

    def contend(self, radio: int, access: Access, key: int) -> int:
        """Let another contender use the radio of a station, with an ``access`` and random numbers
        of its own. Returns the number by which it sends."""
        self._arrays = Addresses(*with_another(self._arrays.states, radio, access, key))
        self.radios.append(radio)
        self._ended = np.empty(3 + len(self.radios), np.int64)
        self._next_ns = None
        return len(self.radios) - 1

    def link(self, now_ns: int, first: np.ndarray, hearer: np.ndarray, mw: np.ndarray,
             delay_ns: np.ndarray | int = 0) -> None:
        """From now on station i is heard by ``hearer[first[i]:first[i + 1]]`` with ``mw``. The
        propagation time ``delay_ns`` delays nothing; it decides which of two frames in one slot
        comes first (``arrive``)."""
        kernels.settle(self._arrays.rows, self._present, now_ns)
        present = self._arrays.states[self._present]
        if len(hearer) != len(present.links):
            links = np.empty(len(hearer), records.LINK)
            self._arrays = Addresses(*(state._replace(links=links)
                                       for state in self._arrays.states))
            present = self._arrays.states[self._present]
        links, stations = present.links, present.stations
        links["station"], links["power_mw"], links["delay_ns"] = hearer, mw, delay_ns
        radio = stations["radio"]
        stations["first_link"], stations["last_link"] = first[radio], first[radio + 1]
        kernels.relink(self._arrays.rows, self._present, now_ns)
        self._next_ns, self._taken_ns = None, -1

    def enqueue(self, now_ns: int, station: int, dest: int, psdu_bytes: int, rate: int,
                packets: int = 1, last_bytes: int | None = None, rts: bool = False) -> int | None:
        """Give ``station`` a frame to send, for ``dest`` (-1: all), of so many packets, the last of
        ``last_bytes`` (None: as the others). Returns its position in the queue, None if that is
        full. Packets for which that has no place (``fit``) are not sent."""
        position, self.fit = self._enqueue(
            self._arrays.rows, self._present, now_ns,
            NEVER if self._lifetime_ns is None else now_ns + self._lifetime_ns, station, dest,
            packets, psdu_bytes, last_bytes or psdu_bytes, rate, rts and dest >= 0)
        self._next_ns = None
        return position if self.fit else None

    def choose(self, station: int, dest: int, rate: int, alone: bool = False, rts: bool = False
               ) -> None:
        """Let ``station`` send to ``dest`` at this rate from the next attempt on, ``alone`` without
        an aggregate, with ``rts`` behind an RTS in any case."""
        self._arrays.states[0].choices[station, dest] = (
            rate | records.ALONE * alone | records.WITH_RTS * rts)
        self._next_ns = None

    def judge(self, now_ns: int, station: int, position: int, packet: int, lost: bool) -> bool:
        """Say whether a packet of ``station`` that was HEARD now is ``lost`` after all. Returns
        whether its receiver has got it now and had not before; of an aggregate False, RECEIVED
        follows."""
        self._next_ns = None
        return kernels.judge(self._arrays.rows, self._present, now_ns, station, position, packet,
                             lost)

    def miss(self, now_ns: int, receiver: int) -> None:
        """The broadcast packet that was RECEIVED now is lost at ``receiver`` after all."""
        self._next_ns = None
        kernels.miss(self._arrays.rows, self._present, now_ns, receiver)

    @property
    def next_ns(self) -> int:
        """The time of the next outcome if nothing more is sent; ``NEVER``: there is none."""
        if self._next_ns is None:
            self._next_ns = self._foresee(self._arrays.rows, self._present)
        return self._next_ns

    def advance(self, until_ns: int) -> list[Outcome]:
        """The outcomes of the next instant with any, none if that is after ``until_ns``."""
        return self.outcomes() if self.step(until_ns) else []

    def step(self, until_ns: int) -> bool:
        """Go on to the next instant with outcomes. Returns whether there is one up to
        ``until_ns``."""
        next_ns = self._next_ns
        if next_ns is None:
            next_ns = self.next_ns
        if until_ns == self._taken_ns or next_ns > until_ns:
            return False
        self._taken_ns = next_ns  # no transmission is over in the instant that it begins
        self._present = 1 - self._present
        self._next_ns = None
        return True

    def outcomes(self) -> list[Outcome]:
        """The outcomes of the instant that ``step`` went on to."""
        present = self._arrays.states[self._present]
        return present.outcomes[:present.setup["outcomes"][0]].tolist()

    def ended_broadcast(self) -> list[int]:
        """The same in short, if they are those of one broadcast of one packet, else nothing: its
        station and position, the number of stations that have received it, these, and those where
        it had errors, both ascending."""
        count = self._end(self._arrays.rows, self._present, self._ended)
        return self._ended[:count].tolist()

    def times(self, station: int) -> tuple[int, int, int, int, int]:
        """Of the frame of ``station`` that has arrived or was given up last: when it became the
        first of its queue and when that was; and for how long (ns) it was contended for, sent and
        repeated."""
        first_ns, over_ns, *sums = self._arrays.states[self._present].times[
            station, times.KEPT:].tolist()
        return first_ns, over_ns, *sums

    def counts(self, now_ns: int) -> Counts:
        """The counters up to now."""
        kernels.advance(self._arrays.rows, self._present, now_ns)
        self._next_ns = None
        stations = self._arrays.states[self._present].stations
        return Counts(*(np.bincount(stations["radio"], stations[name]).astype(np.int64)
                        for name in Counts._fields))

    def busy_ns(self, now_ns: int) -> np.ndarray:
        """[stations] for how long each was sending or found the medium busy so far. It takes no
        outcomes."""
        return self.airtimes_ns(now_ns)[1]

    def airtimes_ns(self, now_ns: int) -> tuple[np.ndarray, np.ndarray]:
        """[stations] for how long each was sending so far; and ``busy_ns``."""
        kernels.advance(self._arrays.rows, self._present, min(now_ns, self.next_ns - 1))
        self._next_ns = None
        stations = self._arrays.states[self._present].stations
        to_come_ns = np.maximum(stations["ends_ns"] - now_ns, 0)
        return (stations["sent_ns"] - np.where(stations["on_air"], to_come_ns, 0),
                stations["occupied_ns"] + np.where(stations["busy"], now_ns, 0))
