"""Minstrel-HT as ns-3 3.44 has it (``MinstrelHtWifiManager``): an older form of Linux's."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.units import NS_PER_S
from netmodels.radio.learner import Choice
from netmodels.radio.minstrel.groups import PACKET_BYTES, RateTable, rate_table
from netmodels.radio.minstrel.sampling import Columns, random_columns
from netmodels.radio.standards import Standard

_UPDATE_NS = NS_PER_S // 20
_KEPT = 75  # % of what was known
_SEGMENT_NS, _TRIES = 6_000_000, 7
_SKIPPED, _SLOW = 20, 2  # updates without a try of a slow rate, and such tries in an update


class TimesOfNs3(NamedTuple):
    """[places] ns of the first packet of an aggregate of 1200 B with its preamble, and of the
    others; an acknowledgement with SIFS; a slot."""

    first_ns: tuple[float, ...]
    other_ns: tuple[float, ...]
    reply_ns: int
    slot_ns: int


def times_of_ns3(standard: Standard, table: RateTable) -> TimesOfNs3:
    """The times of a standard, of each packet with a preamble (``CalculateMpduTxDuration``)."""
    rates = [standard.rates[rate] for rate in table.rates]
    first_ns, other_ns = (tuple(
        rate.payload_ns + (bits + 8 * PACKET_BYTES) / rate.bits * rate.symbol_ns for rate in rates)
        for bits in (16, 0))
    return TimesOfNs3(first_ns, other_ns, standard.sifs_ns + standard.airtime_ns(
        standard.block_ack_bytes, 0), standard.slot_ns)


class MinstrelHtOfNs3:
    """Rates as ``MinstrelHtWifiManager`` chooses them, for stations of 802.11n and later. A sender
    begins with the slowest one."""

    def __init__(self, standard: Standard, tries: int, stream: np.random.Generator) -> None:
        del tries  # its own
        self._table, self._stream = rate_table(standard), stream
        self._times = times_of_ns3(standard, self._table)
        self._pairs: dict[tuple[int, int], PairOfNs3] = {}
        self.first = self._table.rates[0]

    def sent(self, sender: int, receiver: int, packets: int, acknowledged: int, now_ns: int
             ) -> Choice:
        """``Learner.sent``."""
        return self._pair(sender, receiver).sent(packets, acknowledged, now_ns)

    def _pair(self, sender: int, receiver: int) -> PairOfNs3:
        pair = self._pairs.get((sender, receiver))
        if pair is None:
            columns = random_columns(self._stream, self._table)
            pair = self._pairs[sender, receiver] = PairOfNs3(self._table, columns, self._times)
        return pair


class PairOfNs3:
    """The state of one sender for one receiver. Unlike Linux's: an exponential mean in the place of
    the filter; throughput by the time of a first packet alone; three rates; of 16 exchanges and two
    for each packet of an aggregate one tries a rate, by chance. A whole aggregate that is lost
    counts as one packet, then at the rate that follows as lost, and so once more with the answer to
    the request for its acknowledgement, which counts as answered at once."""

    def __init__(self, table: RateTable, columns: Columns, times: TimesOfNs3) -> None:
        self._table, self._columns, self._times = table, columns, times
        places = len(table.rates)
        self._attempts, self._acknowledged, self._skipped = [0] * places, [0] * places, [0] * places
        self._chance, self._throughput = [0.0] * places, [0.0] * places
        self._arrived = [False] * places  # ever
        self._length, self._frames, self._packets = 1, 0, 0
        self._begun = self._trying = False
        self._wait, self._to_try, self._tries, self._slow = 0, 16, 4, 0
        self._group, self._steps = 0, [0] * len(table.groups)
        self._failed = self._place = 0
        self._next_ns = 0
        self._next_sample()
        self._update(0)

    def sent(self, packets: int, acknowledged: int, now_ns: int) -> Choice:
        """As ``Learner.sent``."""
        if packets > 1 and not acknowledged:
            self._miss()
            self._count(packets, 0, now_ns)
        self._count(packets, acknowledged, now_ns)
        return Choice(self._table.rates[self._place])

    def _miss(self) -> None:
        """``DoReportDataFailed``, of a whole aggregate, too."""
        if self._failed < sum(self._turns()):
            self._attempts[self._place] += 1
            self._fall_back()

    def _count(self, packets: int, acknowledged: int, now_ns: int) -> None:
        """``DoReportAmpduTxStatus``; of a single packet ``DoReportDataOk``, ``DoReportDataFailed``.
        """
        alone, fails = packets == 1, acknowledged == 0 and self._failed < sum(self._turns())
        self._attempts[self._place] += packets
        self._acknowledged[self._place] += acknowledged
        if not alone:
            self._frames += 1
            self._packets += packets
        if not (alone and fails):
            self._begun = True
            if self._wait == 0 and self._tries == 0 and self._to_try > 0:
                self._wait, self._tries = 16 + 2 * self._length, 1
                self._to_try -= 1
        if fails:
            self._fall_back()
            return
        self._trying, self._failed = False, 0
        if now_ns >= self._next_ns:
            self._update(now_ns)
        self._place = self._find()

    def _turns(self) -> tuple[int, int, int]:
        """Tries of the rates in turn (``CountRetries``)."""
        first = 1 if self._trying else self._repeats[self._fastest]
        return first, self._repeats[self._second], self._repeats[self._surest]

    def _fall_back(self) -> None:
        """``UpdateRate``."""
        self._failed += 1
        first, second, _ = self._turns()
        if self._failed >= first:
            self._place = self._second if self._failed < first + second else self._surest
        elif not self._trying:
            self._place = self._fastest

    def _find(self) -> int:
        """The rate of the next exchange (``FindRate``)."""
        if not self._begun:
            return self._fastest
        if self._wait == 0 and self._tries:
            place = self._next_sample()
            if place is not None and self._worth_trying(place):
                self._trying = True
                self._tries -= 1
                return place
        self._wait -= self._wait > 0
        return self._fastest

    def _worth_trying(self, place: int) -> bool:
        if place in (self._fastest, self._second, self._surest) or self._chance[place] > 95:
            return False
        table, first_ns = self._table, self._times.first_ns
        streams, most = (table.groups[table.group_of[one]].streams
                         for one in (place, self._fastest))
        if first_ns[place] < first_ns[self._second] or (
                streams < most and first_ns[place] < first_ns[self._surest]):
            return True
        self._slow += 1
        return self._skipped[place] >= _SKIPPED and self._slow <= _SLOW

    def _next_sample(self) -> int | None:
        """The rate that chance has next, and go on to the next group (``GetNextSample``)."""
        columns, group, step = self._columns, self._group, self._steps[self._group]
        count = len(columns[0])
        number = columns[step // count % len(columns)][step % count]
        self._group = (group + 1) % len(self._table.groups)
        self._steps[self._group] += 1
        return self._table.groups[group].places.get(number)

    def _update(self, now_ns: int) -> None:
        """``UpdateStats``."""
        self._next_ns = now_ns + _UPDATE_NS
        self._slow, self._to_try = 0, 8 * len(self._table.groups)
        if self._frames:
            length = self._packets // self._frames
            self._length = (length * (100 - _KEPT) + self._length * _KEPT) // 100
            self._frames = self._packets = 0
        self._fastest = self._second = self._surest = 0
        for place in range(len(self._chance)):
            self._know(place)
            if self._throughput[place]:
                self._rank(place)
        self._repeats = {place: self._tries_of(place)
                         for place in (self._fastest, self._second, self._surest)}

    def _know(self, place: int) -> None:
        attempts = self._attempts[place]
        if not attempts:
            self._skipped[place] += 1
            return
        self._skipped[place] = 0
        chance = float(100 * self._acknowledged[place] // attempts)
        if self._arrived[place]:
            chance = (chance * (100 - _KEPT) + self._chance[place] * _KEPT) / 100
        self._chance[place] = chance
        self._throughput[place] = 0.0 if chance < 10 else (
            min(chance, 90.0) / self._times.first_ns[place])
        self._arrived[place] |= self._acknowledged[place] > 0
        self._attempts[place] = self._acknowledged[place] = 0

    def _rank(self, place: int) -> None:
        """``SetBestStationThRates``, ``SetBestProbabilityRate``."""
        worth = [(self._throughput[one], self._chance[one])
                 for one in (place, self._fastest, self._second)]
        if worth[0] > worth[1]:
            self._fastest, self._second = place, self._fastest
        elif worth[0] > worth[2]:
            self._second = place
        by = self._throughput if self._chance[place] > 75 else self._chance
        if by[place] > by[self._surest]:
            self._surest = place

    def _tries_of(self, place: int) -> int:
        """``CalculateRetransmits``."""
        if self._chance[place] < 1:
            return 1
        times = self._times
        each_ns = times.first_ns[place] + times.other_ns[place] * (
            self._length - 1) + times.reply_ns
        window, spent_ns, tries = 15, 0.0, 0
        while tries < _TRIES:
            spent_ns += window // 2 * times.slot_ns + each_ns
            window = min(2 * (window + 1), 1023)
            if tries >= 2 and spent_ns >= _SEGMENT_NS:
                break
            tries += 1
        return tries
