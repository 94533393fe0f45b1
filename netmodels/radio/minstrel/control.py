"""Minstrel-HT: the rate of each attempt, for each pair of a sender and a receiver by itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.units import NS_PER_S
from netmodels.radio.learner import Choice
from netmodels.radio.minstrel.groups import RateTable, rate_table
from netmodels.radio.minstrel.sampling import Columns, Sampler, random_columns
from netmodels.radio.minstrel.selection import Selection, select
from netmodels.radio.minstrel.statistics import ONE, Statistics
from netmodels.radio.standards import Standard

UPDATE_NS, SAMPLE_NS = NS_PER_S // 20, NS_PER_S // 50  # (update_interval, MINSTREL_SAMPLE_INTERVAL)
_SEGMENT_US, _SLOT_US, _CW_MIN, _CW_MAX = 6000, 9, 15, 1023  # (minstrel_ht_alloc)
_DEAD_AFTER = 30  # packets since the last update


class MinstrelHt:
    """Rates as ``rc80211_minstrel_ht.c`` of Linux 6.1 chooses them, for hardware that takes four
    for a frame (multi-rate retry) and sends it at most ``tries`` times.

    A frame, or an aggregate, is sent at the rate of the highest expected throughput, then at the
    second and third, then at the most certain one, each as often as fits into 6 ms, until it is
    answered. What is lost of an aggregate begins anew. Every 50 ms at the earliest the expectations
    are updated; every 20 ms at the earliest a frame begins with one attempt at a rate that is to be
    tried, without an aggregate as ath9k sends it. The rates behind the first one have an RTS. A
    sender begins with the slowest rate."""

    def __init__(self, standard: Standard, tries: int, stream: np.random.Generator) -> None:
        self._table, self._tries = rate_table(standard), tries
        self._columns = random_columns(stream, self._table)
        self._pairs: dict[tuple[int, int], MinstrelPair] = {}
        self.first = self._table.rates[0]

    def sent(self, sender: int, receiver: int, packets: int, acknowledged: int, now_ns: int
             ) -> Choice:
        """``Learner.sent``."""
        pair = self._pairs.get((sender, receiver))
        if pair is None:
            pair = MinstrelPair(self._table, self._columns, self._tries)
            self._pairs[sender, receiver] = pair
        return pair.sent(packets, acknowledged, now_ns)


class Attempt(NamedTuple):
    """The place of a rate in the table, and how an attempt at it goes."""

    place: int
    choice: Choice


class MinstrelPair:
    """The state of one sender for one receiver (``minstrel_ht_sta``), and where it is in the rates
    of the present frame. ``known``: of each rate. ``stages``: the places of the rates in turn, and
    how often each is tried."""

    def __init__(self, table: RateTable, columns: Columns, tries: int) -> None:
        self._table, self._tries = table, tries
        self.known, self._sampler = Statistics(table), Sampler(table, columns)
        self._updated_ns = self._sample_ns = 0
        self._update(0)
        self._take_turns()
        self._begin_with(self._usual)

    def sent(self, packets: int, acknowledged: int, now_ns: int) -> Choice:
        """The next attempt, as ``Learner.sent``."""
        self.known.attempt(self._attempts[self._at].place, packets, acknowledged)
        self._at += 1
        if acknowledged or self._at == len(self._attempts):
            self.status(packets, now_ns)
            self._begin(now_ns)
        return self._attempts[self._at].choice

    def status(self, packets: int, now_ns: int) -> None:
        """The fate of a frame is known (``minstrel_ht_tx_status``)."""
        self.known.frame(packets)
        changed = self._leave_the_dead()
        if now_ns > self._updated_ns + UPDATE_NS:
            self._update(now_ns)
            changed = True
        if changed:
            self._take_turns()

    def _leave_the_dead(self) -> bool:
        """Whether one of the fastest two rates gets so little through that a group of no more
        streams takes its place (``minstrel_downgrade_rate``)."""
        known, groups, left = self.known, self._table.groups, False
        for k in range(2):
            place = self._chosen.fastest[k]
            if (known.attempts[place] > _DEAD_AFTER
                    and known.acknowledged[place] < known.attempts[place] // 4):
                left = True
                own = self._table.group_of[place]
                for lower in range(own - 1, -1, -1):
                    if groups[lower].streams <= groups[own].streams:
                        self._chosen.fastest[k] = self._chosen.by_group[lower][k]
                        break
        return left

    def _update(self, now_ns: int) -> None:
        self.known.update()
        self._chosen: Selection = select(self._table, self.known)
        self._sampler.refill(self._chosen, self.known)
        self._updated_ns = self._sample_ns = now_ns

    def _begin(self, now_ns: int) -> None:
        """Choose the rates of the next frame (``minstrel_ht_get_rate``)."""
        attempts = self._usual
        if now_ns >= self._sample_ns:
            self._sample_ns = now_ns + SAMPLE_NS
            tried = self._sampler.take()
            if tried is not None:
                attempts = [Attempt(tried, Choice(self._table.rates[tried], alone=True)),
                            *self._usual[self.stages[0][1]:]]
        self._begin_with(attempts)

    def _begin_with(self, attempts: list[Attempt]) -> None:
        self._attempts, self._at = attempts, 0

    def _take_turns(self) -> None:
        """Choose the stages (``minstrel_ht_update_rates``)."""
        table, (first, *others) = self._table, self._chosen.fastest[:3]
        with_rts_us = table.overhead_rts_us
        self.stages = [(first, self._repeats(first, table.overhead_us)), *(
            (place, self._repeats(place, with_rts_us)) for place in (*others, self._chosen.surest))]
        self._usual = [Attempt(place, Choice(table.rates[place], rts=stage > 0))
                       for stage, (place, times) in enumerate(self.stages)
                       for _ in range(times)][:self._tries]

    def _repeats(self, place: int, overhead_us: int) -> int:
        """The tries of a rate: twice, and more where that fits into 6 ms with its contention
        (``minstrel_calc_retransmit``)."""
        known = self.known
        if known.chance[place] < ONE * 20 // 100:
            return 2
        each_us = overhead_us + self._table.durations_ns[place] * known.length // 1000
        window, spent_us, tries = _CW_MIN, 0, 0
        while tries < self._tries:
            spent_us += (_SLOT_US * window >> 1) + each_us
            window = min(window << 1 | 1, _CW_MAX)
            if tries >= 2 and spent_us >= _SEGMENT_US:
                break
            tries += 1
        return tries
