"""The rates that Minstrel-HT chooses from, in groups, and how long each takes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import count
from typing import NamedTuple

from netmodels.radio.standards import Rate, Standard

PACKET_BYTES, PACKETS = 1200, 16  # of an average aggregate (AVG_PKT_SIZE, AVG_AMPDU_SIZE)
_BITS = 8 * PACKET_BYTES * PACKETS
_SHORT_GUARD_NS = 3600  # a symbol


class RateGroup(NamedTuple):
    """Rates of one modulation, number of streams and guard interval. ``places`` in the table by
    MCS, or by place among the rates of DSSS or OFDM."""

    streams: int
    places: dict[int, int]


class RateTable(NamedTuple):
    """[places] of all groups: the standard's rate, its duration in ns and its group; and the
    overhead of a frame in us, without and with an RTS. ``aggregates``: the rates have an MCS."""

    rates: tuple[int, ...]
    durations_ns: tuple[int, ...]
    group_of: tuple[int, ...]
    groups: tuple[RateGroup, ...]
    overhead_us: int
    overhead_rts_us: int
    aggregates: bool


@lru_cache
def rate_table(standard: Standard) -> RateTable:
    """The groups of a standard: of 802.11n and later by guard interval, the longest first, then by
    streams (``minstrel_mcs_groups``), and else DSSS and OFDM. Stations of 802.11n do not fall back
    to 802.11b (as hardware without ``SUPPORTS_HT_CCK_RATES``)."""
    rates = standard.rates
    aggregates = rates[-1].mcs is not None
    keys = sorted({key for rate in rates if (key := _key(rate))[0] == aggregates})
    chosen: list[int] = []
    durations_ns: list[int] = []
    groups = []
    for key in keys:
        members = [k for k, rate in enumerate(rates) if _key(rate) == key]
        numbers = [k if mcs is None else mcs
                   for k, mcs in enumerate(rates[member].mcs for member in members)]
        groups.append(RateGroup(key[2], dict(zip(numbers, count(len(chosen))))))
        durations_ns += _rounded([_duration_ns(rates[member]) for member in members])
        chosen += members
    group_of = tuple(number for number, group in enumerate(groups) for _ in group.places)
    overhead_us, reply_us = _overheads_us(standard, aggregates)
    return RateTable(tuple(chosen), tuple(durations_ns), group_of, tuple(groups), overhead_us,
                     overhead_us + 2 * reply_us, aggregates)


def _key(rate: Rate) -> tuple[bool, int, int]:
    """Alike for the rates of a group, and ascending in the order of the groups."""
    aggregates = rate.mcs is not None
    return aggregates, -rate.symbol_ns if aggregates else rate.symbol_ns, rate.streams


def _duration_ns(rate: Rate) -> int:
    """One of 16 packets of 1200 B in an aggregate (``MCS_DURATION``); without an MCS one frame with
    what it takes besides (``CCK_DURATION``, ``OFDM_DURATION``)."""
    if rate.mcs is not None:
        symbols = -(-_BITS // rate.bits)
        if rate.symbol_ns == _SHORT_GUARD_NS:
            return (symbols * 18_000 + 4_000) // 5 // PACKETS
        return symbols * rate.symbol_ns // PACKETS
    tenths = round(10 * rate.mbps)
    if rate.ofdm:
        return 1000 * (16 + 16 + 4 + 4 * ((16 + 80 * (PACKET_BYTES + 4) + 6) // (4 * tenths)))
    return 1000 * (10 + 144 + 48 + 8 * (PACKET_BYTES + 4) * 10 // tenths)


def _rounded(durations_ns: Sequence[int]) -> list[int]:
    """Durations as a group keeps them, in 16 bits (``GROUP_SHIFT``)."""
    shift = max(0, durations_ns[0].bit_length() - 16)
    return [ns >> shift << shift for ns in durations_ns]


def _overheads_us(standard: Standard, aggregates: bool) -> tuple[int, int]:
    """Of a frame, and of an acknowledgement (``minstrel_ht_update_caps``): at 6 Mb/s, without an
    MCS at the lowest rate."""
    if aggregates:
        return _frame_us(60, True, 0) + _frame_us(60, True, 10), _frame_us(60, True, 10)
    lowest = standard.rates[0]
    reply_us = _frame_us(round(10 * lowest.mbps), lowest.ofdm, 10)
    return reply_us, reply_us


def _frame_us(tenths: int, ofdm: bool, size_bytes: int) -> int:
    """SIFS and a frame without its check sequence (``ieee80211_frame_duration``, with a short
    preamble)."""
    bits = 8 * (size_bytes + 4)
    if ofdm:
        return 16 + 16 + 4 + 4 * -(-(16 + bits + 6) * 10 // (4 * tenths))
    return 10 + 72 + 24 - -bits * 10 // tenths
