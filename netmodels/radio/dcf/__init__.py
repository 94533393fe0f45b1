"""Stations that share the air by the 802.11 distributed coordination function."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from netmodels.radio.dcf import kernels
from netmodels.radio.dcf.records import kernels as records
from netmodels.radio.dcf.records.kernels import (
    DONE,
    DROPPED,
    EXPIRED,
    MISSED,
    NEVER,
    RECEIVED,
)
from netmodels.radio.errors import ErrorTable
from netmodels.radio.standards import ACK_BYTES, CTS_BYTES, RTS_BYTES, Standard

__all__ = ["DONE", "DROPPED", "EXPIRED", "MISSED", "NEVER", "RECEIVED", "Counts", "Outcome",
           "Reception", "Stations"]


@dataclass(frozen=True)
class Reception:
    """What a receiver makes of what it hears."""

    noise_dbm: float = -93.965  # thermal noise of 20 MHz at 290 K, and 7 dB of the receiver
    energy_dbm: float = -62.0  # whatever it is, it makes the medium busy
    preamble_dbm: float = -82.0  # the least that a preamble is found at,
    preamble_db: float = 4.0  # and how much it must exceed noise and interference
    detection_ns: int = 4_000  # for how long it is looked for
    unaware: bool = False  # that it misses interference which began with the frame (``arrive``)


# What became of the frame at ``position`` in the queue of ``station``: time in ns, what, station,
# position, receiver. RECEIVED: a unicast frame when all its packets have arrived; of a broadcast
# one row a packet. MISSED: a packet of a broadcast had errors. DONE: the end of a broadcast.
# DROPPED: a unicast frame, given up. EXPIRED: a frame that has waited too long to begin.
Outcome = tuple[int, int, int, int, int]


class Counts(NamedTuple):
    """[stations] each: transmissions of data, those without a reply (of RTS too), frames given up.
    """

    transmitted: np.ndarray
    failures: np.ndarray
    dropped: np.ndarray


def _milliwatts(dbm: float) -> float:
    return 10 ** (dbm / 10)


class Stations:
    """One channel and those who use it.

    The next outcome is foreseen by running the state machine ahead on a copy of the stations; if
    nobody interferes until then, the copy is what has become of them. Whoever sends or moves at
    ``now_ns`` must have taken all outcomes up to ``now_ns``.

    ``keys`` [stations] uint64, of their random numbers. ``limit`` frames fit into each queue. A
    packet is given up after ``tries`` failures; after ``reset_at`` in a row the contention window
    starts anew. A frame that has waited for ``lifetime_ns`` (None: any time) is not sent any more.
    """

    def __init__(self, standard: Standard, keys: np.ndarray, errors: ErrorTable,
                 reception: Reception = Reception(), limit: int = 500, tries: int = 7,
                 reset_at: int = 7, lifetime_ns: int | None = None) -> None:
        n, self._lifetime_ns = len(keys), lifetime_ns
        self._standard, self._present, self._next_ns, self._taken_ns = standard, 0, NEVER, -1
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
        self._rates = np.array([
            (rate.mbps * 1e6, rate.header_ns, rate.payload_ns,
             min(k for k, other in enumerate(standard.rates) if other.ofdm == rate.ofdm))
            for k, rate in enumerate(standard.rates)], records.RATE)
        self._table = np.ascontiguousarray(errors.log_log)
        self._setup = np.array([(
            standard.slot_ns, standard.sifs_ns, standard.difs_ns, standard.eifs_ns,
            reception.detection_ns, standard.cw_min, standard.cw_max, tries, reset_at,
            _milliwatts(reception.noise_dbm), _milliwatts(reception.energy_dbm),
            _milliwatts(reception.preamble_dbm), _milliwatts(reception.preamble_db),
            errors.clear, errors.first_db, errors.step_db,
            reception.unaware, 0)], records.SETUP)
        self._outcomes = np.zeros(4 * n + 8 + (n * limit if lifetime_ns else 0), records.OUTCOME)
        self._times = lru_cache(1 << 12)(self._times_of)
        self._locate()

    def _locate(self) -> None:
        """Where the kernels find the arrays."""
        both = [records.Dcf(stations, due, self._touched, self._frames, self._links,
                            self._rates, self._table, self._setup, self._outcomes)
                for stations, due in zip(self._stations, self._due, strict=True)]
        self._where = np.array([[(array.ctypes.data, *array.shape, 0)[:3] for array in arrays]
                                for arrays in both], dtype=np.int64)

    def link(self, now_ns: int, first: np.ndarray, hearer: np.ndarray, mw: np.ndarray) -> None:
        """From now on station i is heard by ``hearer[first[i]:first[i + 1]]`` with ``mw``."""
        kernels.settle(self._where, self._present, now_ns)
        self._links = np.empty(len(hearer), records.LINK)
        self._links["station"], self._links["mw"] = hearer, mw
        stations = self._stations[self._present]
        stations["first"], stations["last"] = first[:-1], first[1:]
        self._locate()
        kernels.relink(self._where, self._present, now_ns)
        self._next_ns, self._taken_ns = None, -1

    def enqueue(self, now_ns: int, station: int, dest: int, psdu_bytes: int, rate: int,
                packets: int = 1, last_bytes: int | None = None, rts: bool = False) -> int | None:
        """``station`` gets a frame for ``dest`` (-1: everybody) to send, of so many packets (the
        last one may be shorter). Returns its position in the queue, None if that is full."""
        position = kernels.enqueue(
            self._where, self._present, now_ns,
            NEVER if self._lifetime_ns is None else now_ns + self._lifetime_ns, station, dest,
            packets,
            *self._times(psdu_bytes, last_bytes or psdu_bytes, rate, dest < 0, rts))
        self._next_ns = None
        return None if position < 0 else position

    def _times_of(self, psdu_bytes: int, last_bytes: int, rate: int, broadcast: bool,
                  rts: bool) -> tuple[int, ...]:
        """Airtimes and rates in the order of the kernel's parameters. Control frames that begin an
        exchange go at the lowest rate of the modulation."""
        airtime_ns, reply = self._standard.airtime_ns, self._standard.reply_rate(rate)
        control = int(self._rates[rate]["header_rate"])
        replies = (0, 0) if broadcast else (airtime_ns(ACK_BYTES, reply), reply)
        if broadcast or not rts:
            control_frames = 0, 0, control
        else:
            control_frames = (airtime_ns(RTS_BYTES, control), airtime_ns(CTS_BYTES, control),
                              control)
        return (airtime_ns(psdu_bytes, rate), airtime_ns(last_bytes, rate), rate, *replies,
                *control_frames)

    @property
    def next_ns(self) -> int:
        """When the next outcome will be if nobody sends anything more; ``NEVER``: none will be."""
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
        """Up to now."""
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
