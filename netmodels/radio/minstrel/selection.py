"""The rates that a sender uses: those that carry most, and the one that arrives most surely."""

from __future__ import annotations

from typing import NamedTuple

from netmodels.radio.minstrel.groups import RateTable
from netmodels.radio.minstrel.statistics import ONE, Statistics

FASTEST = 4  # how many are known (MAX_THR_RATES)
_SURE = ONE * 75 // 100


class Selection(NamedTuple):
    """Places of rates. ``fastest``: those of the highest throughput (``max_tp_rate``). ``surest``:
    the one of the highest probability, or of the highest throughput among those above 75 %
    (``max_prob_rate``). ``by_group``: the fastest two of each group."""

    fastest: list[int]
    surest: int
    by_group: list[list[int]]


def select(table: RateTable, known: Statistics) -> Selection:
    """The rates to use after an update (``minstrel_ht_update_stats``)."""
    chance, throughput = known.chance, known.throughput

    def best(first: int, places: list[int], count: int) -> list[int]:
        """``minstrel_ht_sort_best_tp_rates``."""
        usable = [place for place in reversed(places) if throughput[place]]
        return sorted([first] * count + usable,
                      key=lambda place: (-throughput[place], -chance[place]))[:count]

    members = [list(group.places.values()) for group in table.groups]
    by_group = [best(places[0], places, FASTEST)[:2] for places in members]
    everything = [place for places in reversed(members) for place in places]
    fastest = best(0, everything, FASTEST)
    return Selection(fastest, _surest(table, known, fastest[0]), by_group)


def _surest(table: RateTable, known: Statistics, fastest: int) -> int:
    """``minstrel_ht_set_best_prob_rate``, and where it has fewer streams than the ``fastest``
    ``minstrel_ht_prob_rate_reduce_streams``."""
    chance, throughput, durations_ns = known.chance, known.throughput, table.durations_ns
    surest, reduced, most = 0, None, 0
    streams = table.groups[table.group_of[fastest]].streams
    for group in table.groups:
        own = next(iter(group.places.values()))
        for place in group.places.values():
            if durations_ns[fastest] > durations_ns[place] and chance[place] < chance[fastest]:
                continue
            worth = throughput if chance[place] > _SURE else chance
            if worth[place] > worth[surest]:
                surest = place
            if worth[place] > worth[own]:
                own = place
        if table.aggregates and group.streams < streams and throughput[own] > most:
            reduced, most = own, throughput[own]
    return surest if reduced is None else reduced
