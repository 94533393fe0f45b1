"""A sender's knowledge of each rate to a receiver: the share that arrives, and its throughput.

Numbers are Linux's integers: probabilities are in 1 / 4096.
"""

from __future__ import annotations

from netmodels.radio.minstrel.groups import RateTable

SCALE = 12
ONE = 1 << SCALE
# The filter of probabilities, a low pass with a period of 16 updates (MINSTREL_AVG_COEFF1 to 3).
_SECOND, _THIRD = 0x1499, -0x92E
_FIRST = ONE - _SECOND - _THIRD
_KEPT, _OF = 96, 128  # of the mean length of aggregates (EWMA_LEVEL, EWMA_DIV)
_LEAST, _MOST = ONE * 10 // 100, ONE * 90 // 100  # of a rate that carries anything; that counts


class Statistics:
    """Of the rates of ``table``, by place: attempts and acknowledgements since the last update, the
    probability that a packet is acknowledged, and the packets a second that follow from it, times
    100. ``length``: packets of a mean aggregate."""

    def __init__(self, table: RateTable) -> None:
        places = len(table.rates)
        self._table = table
        self.attempts, self.acknowledged = [0] * places, [0] * places
        self.chance, self._before = [0] * places, [0] * places
        self.throughput, self._tried = [0] * places, [False] * places
        self._length = ONE
        self._frames = self._packets = 0

    @property
    def length(self) -> int:
        return self._length >> SCALE

    def attempt(self, place: int, packets: int, acknowledged: int) -> None:
        """Count an attempt at a frame."""
        self.attempts[place] += packets
        self.acknowledged[place] += acknowledged

    def frame(self, packets: int) -> None:
        """Count a frame, however often it was sent."""
        self._frames += 1
        self._packets += packets

    def update(self) -> None:
        """Take in what was counted (``minstrel_ht_update_stats``). A rate that was never tried gets
        what is known of the faster ones of its group."""
        if self._frames:
            change = (self._packets << SCALE) // self._frames - self._length
            self._length += int((_OF - _KEPT) * change / _OF)
            self._frames = self._packets = 0
        for group in self._table.groups:
            best = 0
            for place in reversed(group.places.values()):
                self._filter(place)
                best = max(best, self.chance[place])
                if not self._tried[place]:
                    self.chance[place] = best
        self.throughput = [self._throughput(place) for place in range(len(self.chance))]

    def _filter(self, place: int) -> None:
        """``minstrel_ht_calc_rate_stats`` and ``minstrel_filter_avg_add``."""
        attempts = self.attempts[place]
        if not attempts:
            return
        self._tried[place] = True
        last = self.chance[place]
        value = max(self.acknowledged[place] * ONE // attempts, 1)
        if last:
            value = _FIRST * value + _SECOND * last + _THIRD * self._before[place] >> SCALE
            value = 1 if value < 0 else min(value, ONE)
        self._before[place], self.chance[place] = last or value, value
        self.attempts[place] = self.acknowledged[place] = 0

    def _throughput(self, place: int) -> int:
        """``minstrel_ht_get_tp_avg``: chances above 90 % count as that, as collisions vary."""
        table, chance = self._table, self.chance[place]
        if chance < _LEAST:
            return 0
        duration_ns = 1000 * table.overhead_us // self.length + table.durations_ns[place]
        return 100 * (min(chance, _MOST) * 1_000_000 // duration_ns) >> SCALE
