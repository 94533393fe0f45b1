"""Stations that share the air by the 802.11 distributed coordination function."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from netmodels.radio.dcf.kernels import machine as kernels
from netmodels.radio.dcf.kernels import records
from netmodels.radio.dcf.kernels.records import (
    ACKED,
    DONE,
    DROPPED,
    EXPIRED,
    FAILED,
    HEARD,
    MISSED,
    NEVER,
    RECEIVED,
)
from netmodels.radio.errors import ErrorTable
from netmodels.radio.standards import ACK_BYTES, CTS_BYTES, RTS_BYTES, Standard

__all__ = ["ACKED", "DONE", "DROPPED", "EXPIRED", "FAILED", "HEARD", "MISSED", "NEVER", "RECEIVED",
           "Counts", "Outcome", "Reception", "Stations"]


@dataclass(frozen=True)
class Reception:
    """Thresholds and rules of a receiver."""

    noise_dbm: float = -93.965  # thermal noise of 20 MHz at 290 K, and 7 dB of the receiver
    energy_dbm: float = -62.0  # whatever it is, it makes the medium busy
    preamble_dbm: float = -82.0  # the least that a preamble is found at,
    preamble_db: float = 4.0  # and how much it must exceed noise and interference
    detection_ns: int = 4_000  # for how long it is looked for
    unaware: bool = False  # that it misses interference which came just before (``arrive``)
    gives_up: bool = False  # that it does not follow a frame whose header has errors
    eifs_at_end: bool = False  # that EIFS begins with the end of the frame, idle or not (``rest``)


# What became of the frame at ``position`` in the queue of ``station``: time in ns, what, station,
# position, receiver, packet. RECEIVED: a unicast frame's last packet has arrived; of a broadcast
# one row a packet. MISSED: a packet of a broadcast had errors. DONE: the end of a broadcast.
# DROPPED: a unicast frame's packet was given up. EXPIRED: a frame has waited too long to begin.
# ACKED and FAILED, only where rates adapt: an attempt at a packet was acknowledged or not. HEARD,
# only where transmissions are judged, instead of RECEIVED: a unicast frame's packet was made out.
Outcome = tuple[int, int, int, int, int, int]


class Counts(NamedTuple):
    """[stations] each: transmissions of data, those without a reply (of RTS too), packets given up.
    """

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
            standard.airtime_ns(RTS_BYTES, lowest), standard.airtime_ns(CTS_BYTES, lowest))


class Stations:
    """One channel and those who use it.

    The next outcome is foreseen by running the state machine ahead on a copy of the stations; if
    nobody interferes until then, the copy is what has become of them. Whoever sends or moves at
    ``now_ns`` must have taken all outcomes up to ``now_ns``.

    ``keys`` [stations] uint64, of their random numbers. ``limit`` frames fit into each queue. A
    packet is given up after ``tries`` failures; after ``reset_at`` in a row the contention window
    starts anew. A frame that has waited for ``lifetime_ns`` (None: any time) is not sent any more.
    Rates adapt if there is a ``first_rate``: unicast frames go at the one that was chosen for their
    receiver when they go on the air (``choose``), not at their own. Where transmissions are
    ``judged``, whoever takes the outcomes says at once what was lost (``judge``, ``miss``). What
    comes while the medium is idle waits for DIFS all the same if ``difs_first``, and goes without a
    backoff then, whatever comes in between.
    """

    def __init__(self, standard: Standard, keys: np.ndarray, errors: ErrorTable,
                 reception: Reception = Reception(), limit: int = 500, tries: int = 7,
                 reset_at: int = 7, lifetime_ns: int | None = None,
                 first_rate: int | None = None, judged: bool = False,
                 difs_first: bool = False) -> None:
        n, self._lifetime_ns = len(keys), lifetime_ns
        self._present, self._next_ns, self._taken_ns = 0, NEVER, -1
        first = np.zeros(n, records.STATION)
        for field in "air", "contention", "answer":
            first[field] = NEVER
        first["index"], first["key"], first["lock"] = np.arange(n), keys, -1
        first["window"] = standard.cw_min
        self._stations = np.stack([first, first])
        self._due = np.full((2, -(-n // records.BLOCK) * (1 + records.BLOCK)), NEVER)
        self._touched = np.zeros((1 + n, 2), np.int64)
        self._frames = np.zeros((n, limit), records.FRAME)
        self._links = np.zeros(0, records.LINK)
        self._choices = (np.zeros((0, 0), np.int8) if first_rate is None
                         else np.full((n, n), first_rate, np.int8))
        self._rates = np.array([_rate(standard, k) for k in range(len(standard.rates))],
                               records.RATE)
        self._table = np.ascontiguousarray(errors.log_log)
        self._setup = np.array([(
            standard.slot_ns, standard.sifs_ns, standard.difs_ns, standard.eifs_ns,
            reception.detection_ns, standard.cw_min, standard.cw_max, tries, reset_at,
            _milliwatts(reception.noise_dbm), _milliwatts(reception.energy_dbm),
            _milliwatts(reception.preamble_dbm), _milliwatts(reception.preamble_db),
            errors.clear, errors.first_db, errors.step_db,
            reception.unaware, reception.eifs_at_end, reception.gives_up,
            standard.difs_ns * difs_first, judged, 0)],
            records.SETUP)
        self._outcomes = np.zeros(4 * n + 8 + (n * limit if lifetime_ns else 0), records.OUTCOME)
        self._locate()

    def _locate(self) -> None:
        """Store the arrays' addresses, where the kernels find them."""
        both = [records.Dcf(stations, due, self._touched, self._frames, self._links,
                            self._rates, self._table, self._setup, self._outcomes,
                            self._choices)
                for stations, due in zip(self._stations, self._due, strict=True)]
        self._where = np.array([[(array.ctypes.data, *array.shape, 0)[:3] for array in arrays]
                                for arrays in both], dtype=np.int64)

    def link(self, now_ns: int, first: np.ndarray, hearer: np.ndarray, mw: np.ndarray,
             delay_ns: np.ndarray | int = 0) -> None:
        """From now on station i is heard by ``hearer[first[i]:first[i + 1]]`` with ``mw``. The
        propagation time ``delay_ns`` delays nothing; it decides which of two frames in one slot
        comes first (``arrive``)."""
        kernels.settle(self._where, self._present, now_ns)
        if len(hearer) != len(self._links):
            self._links = np.empty(len(hearer), records.LINK)
            self._locate()
        self._links["station"], self._links["mw"], self._links["delay"] = hearer, mw, delay_ns
        stations = self._stations[self._present]
        stations["first"], stations["last"] = first[:-1], first[1:]
        kernels.relink(self._where, self._present, now_ns)
        self._next_ns, self._taken_ns = None, -1

    def enqueue(self, now_ns: int, station: int, dest: int, psdu_bytes: int, rate: int,
                packets: int = 1, last_bytes: int | None = None, rts: bool = False) -> int | None:
        """``station`` gets a frame for ``dest`` (-1: everybody) to send, of so many packets (the
        last one may be shorter). Returns its position in the queue, None if that is full."""
        position = kernels.enqueue(
            self._where, self._present, now_ns,
            NEVER if self._lifetime_ns is None else now_ns + self._lifetime_ns, station, dest,
            packets, psdu_bytes, last_bytes or psdu_bytes, rate, rts and dest >= 0)
        self._next_ns = None
        return None if position < 0 else position

    def choose(self, station: int, dest: int, rate: int) -> None:
        """Let ``station`` send to ``dest`` at this rate from the next attempt on."""
        self._choices[station, dest] = rate
        self._next_ns = None

    def judge(self, now_ns: int, station: int, lost: bool) -> bool:
        """Whether the packet of ``station`` that was HEARD now is ``lost`` after all. Returns
        whether its receiver has got it now, and had not before."""
        self._next_ns = None
        return kernels.judge(self._where, self._present, now_ns, station, lost)

    def miss(self, now_ns: int, receiver: int) -> None:
        """The broadcast packet that was RECEIVED now is lost at ``receiver`` after all."""
        self._next_ns = None
        kernels.miss(self._where, self._present, now_ns, receiver)

    @property
    def next_ns(self) -> int:
        """When the next outcome will be if nothing more is sent; ``NEVER``: none will be."""
        if self._next_ns is None:
            self._next_ns = kernels.foresee(self._where, self._present)
        return self._next_ns

    def advance(self, until_ns: int) -> list[Outcome]:
        """The outcomes of the next instant with any, none if that is after ``until_ns``."""
        if until_ns == self._taken_ns or self.next_ns > until_ns:
            return []
        self._taken_ns = self._next_ns  # no transmission is over in the instant that it begins
        self._present = 1 - self._present
        self._next_ns = None
        return self._outcomes[:self._setup["outcomes"][0]].tolist()

    def counts(self, now_ns: int) -> Counts:
        """The counters up to now."""
        kernels.advance(self._where, self._present, now_ns)
        self._next_ns = None
        stations = self._stations[self._present]
        return Counts(*(stations[name].copy() for name in Counts._fields))

    def busy_ns(self, now_ns: int) -> np.ndarray:
        """[stations] for how long each was sending or found the medium busy, up to now. Takes no
        outcomes."""
        kernels.advance(self._where, self._present, min(now_ns, self.next_ns - 1))
        self._next_ns = None
        stations = self._stations[self._present]
        return stations["occupied"] + np.where(stations["busy"], now_ns, 0)
