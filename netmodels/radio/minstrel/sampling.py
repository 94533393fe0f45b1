"""The rates that a sender tries to learn of them: the sampler of Linux since 5.12."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from netmodels.radio.minstrel.groups import RateGroup, RateTable
from netmodels.radio.minstrel.selection import Selection
from netmodels.radio.minstrel.statistics import ONE, Statistics

WAITING = 5  # rates of each kind (MINSTREL_SAMPLE_RATES)
# Kinds: the next faster rate of a group, any faster one, and one between the fastest and the
# slowest in use; and their order (minstrel_sample_seq).
NEXT, JUMP, SLOW = range(3)
_ORDER = (NEXT, JUMP, NEXT, JUMP, NEXT, SLOW)
_KNOWN = ONE * 95 // 100  # a slow rate that gets through so often is not tried
_COLUMNS = 10

Columns = Sequence[Sequence[int]]


def random_columns(stream: np.random.Generator, table: RateTable) -> Columns:
    """[10, MCS] the orders in which the rates of a group are tried, alike for all senders
    (``init_sample_table``)."""
    count = max(10, *(1 + max(group.places) for group in table.groups))
    columns = []
    for _ in range(_COLUMNS):
        column = [-1] * count
        for number, shift in enumerate(stream.integers(256, size=count).tolist()):
            place = (number + shift) % count
            while column[place] >= 0:
                place = (place + 1) % count
            column[place] = number
        columns.append(column)
    return columns


class Sampler:
    """The rates that one sender is to try with one receiver."""

    def __init__(self, table: RateTable, columns: Columns) -> None:
        self._table, self._columns = table, columns
        self._waiting: list[list[int | None]] = [[None] * WAITING for _ in _KINDS]
        self._group = [0 for _ in _KINDS]
        self._steps = [0 for _ in table.groups]  # in ``columns``
        self._turn = 0

    def take(self) -> int | None:
        """The rate to try now (``minstrel_ht_get_sample_rate``)."""
        waiting = self._waiting[_ORDER[self._turn]]
        self._turn = (self._turn + 1) % len(_ORDER)
        for k, place in enumerate(waiting):
            if place is not None:
                waiting[k] = None
                return place
        return None

    def refill(self, chosen: Selection, known: Statistics) -> None:
        """Choose what to try until the next update (``minstrel_ht_refill_sample_rates``)."""
        durations_ns = self._table.durations_ns
        used_ns = [durations_ns[place] for place in (*chosen.fastest[:2], chosen.surest)]
        fast_ns, slow_ns = min(used_ns), max(used_ns)
        count = self._keep(NEXT, 0, fast_ns)
        waiting = self._waiting[NEXT]
        while count < WAITING:
            waiting[count] = self._next(used_ns[0])
            if waiting[count] is None:
                break
            count += 1
        count, slow = self._keep(JUMP, 0, fast_ns), self._keep(SLOW, fast_ns, slow_ns)
        waiting = self._waiting[JUMP]
        while count < WAITING:
            waiting[count], slow = self._jump(fast_ns, slow_ns, slow, known)
            if waiting[count] is None:
                break
            count += 1

    def _keep(self, kind: int, above_ns: int, below_ns: int) -> int:
        """Move those that are still of use to the front; returns where the next one goes. As in
        ``minstrel_ht_move_sample_rates`` one that is there already does not count."""
        waiting, count = self._waiting[kind], 0
        for k, place in enumerate(waiting):
            if place is None:
                continue
            if not above_ns < self._table.durations_ns[place] < below_ns:
                waiting[k] = None
            elif k != count:
                waiting[count], waiting[k] = place, None
                count += 1
        return count

    def _waits(self, kind: int, place: int) -> bool:
        waiting = self._waiting[kind]
        end = waiting.index(None) if None in waiting else WAITING
        return place in waiting[:end]

    def _others(self, kind: int) -> list[int]:
        """The groups behind the last one, and that one."""
        count, last = len(self._table.groups), self._group[kind]
        return [(last + k) % count for k in range(1, count + 1)]

    def _first_below(self, group: RateGroup, below_ns: int) -> int | None:
        """The MCS of a group's slowest rate that takes less."""
        durations_ns = self._table.durations_ns
        return next((number for number, place in group.places.items()
                     if durations_ns[place] < below_ns), None)

    def _next(self, fast_ns: int) -> int | None:
        """``minstrel_ht_next_inc_rate``."""
        for number in self._others(NEXT):
            group = self._table.groups[number]
            first = self._first_below(group, fast_ns)
            if first is not None and not self._waits(NEXT, group.places[first]):
                self._group[NEXT] = number
                return group.places[first]
        return None

    def _jump(self, fast_ns: int, slow_ns: int, slow: int, known: Statistics
              ) -> tuple[int | None, int]:
        """A faster rate, and how many slow ones wait: those that turn up are put there as long as
        there is room (``minstrel_ht_next_jump_rate``)."""
        for number in self._others(JUMP):
            first = self._first_below(self._table.groups[number],
                                      slow_ns if slow < WAITING else fast_ns)
            place = None if first is None else self._any(number, first)
            if place is None:
                continue
            duration_ns = self._table.durations_ns[place]
            faster = duration_ns < fast_ns
            if self._waits(JUMP if faster else SLOW, place):
                continue
            if faster:
                self._group[JUMP] = number
                return place, slow
            if slow < WAITING and duration_ns < slow_ns and known.chance[place] <= _KNOWN:
                self._waiting[SLOW][slow] = place
                slow += 1
        return None, slow

    def _any(self, number: int, first: int) -> int | None:
        """The next one by chance of a group from MCS ``first`` on
        (``minstrel_ht_next_group_sample_rate``)."""
        places, columns = self._table.groups[number].places, self._columns
        count = len(columns[0])
        for _ in range(count):
            step = self._steps[number]
            mcs = columns[step // count][step % count]
            self._steps[number] = (step + 1) % (count * len(columns))
            if mcs >= first and mcs in places:
                return places[mcs]
        return None


_KINDS = (NEXT, JUMP, SLOW)
