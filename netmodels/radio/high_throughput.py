"""802.11n, ac and ax: rates by MCS, streams, width and guard interval, and their preambles.

IEEE 802.11-2016, clauses 19 (HT, mixed format) and 21 (VHT), and 802.11ax-2021, clause 27 (HE, one
user). One encoder counts its 6 tail bits, also where the standard has several: less than a symbol.
Errors are those of convolutional codes, also where stations use LDPC. Each stream has the signal to
noise ratio of the link.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from desim.errors import InputError
from netmodels.radio.standards import DELIMITER_BYTES, A, G, Rate, Standard, channels_5ghz

# Bits of a subcarrier and code rate by MCS (tables 19-27, 21-30, 27-54).
_CODINGS = tuple((bits, Fraction(code)) for bits, code in (
    (1, "1/2"), (2, "1/2"), (2, "3/4"), (4, "1/2"), (4, "3/4"), (6, "2/3"), (6, "3/4"), (6, "5/6"),
    (8, "3/4"), (8, "5/6"), (10, "3/4"), (10, "5/6")))
_FORBIDDEN = {(80, 3, 6), (160, 3, 9)}  # VHT: width, streams, MCS (tables 21-30 to 21-61)
_LEGACY_NS, _LEGACY_HEADER_NS = 20_000, 16_000


class Format(NamedTuple):
    """A format of frames. ``subcarriers`` of data by width in MHz; a symbol without its guard
    interval, and the intervals that there are, the usual one first; ``before_ns``: of the preamble
    between the legacy one and the training of streams, and behind that; the training of one stream
    by guard interval; the highest MCS."""

    subcarriers: dict[int, int]
    symbol_ns: int
    guards_ns: tuple[int, ...]
    before_ns: int
    training_ns: dict[int, int]
    last_mcs: int


FORMATS = {
    "11n": Format({20: 52, 40: 108}, 3200, (800, 400), 8000 + 4000, {800: 4000, 400: 4000}, 7),
    "11ac": Format({20: 52, 40: 108, 80: 234, 160: 468}, 3200, (800, 400), 8000 + 4000 + 4000,
                   {800: 4000, 400: 4000}, 9),
    "11ax": Format({20: 234, 40: 468, 80: 980, 160: 1960}, 12_800, (800, 1600, 3200),
                   4000 + 8000 + 4000, {800: 7200, 1600: 8000, 3200: 16_000}, 11),
}
MOST_STREAMS = 4



def rate(name: str, mcs: int, width_mhz: int, streams: int, guard_ns: int) -> Rate | None:
    """The rate of an MCS; None where the standard has none: bits of a symbol must be whole, but for
    HE, which cuts them."""
    form = FORMATS[name]
    bits_of, code = _CODINGS[mcs]
    bits = form.subcarriers[width_mhz] * bits_of * code * streams
    if name != "11ax" and bits.denominator > 1:
        return None
    if name == "11ac" and (width_mhz, streams, mcs) in _FORBIDDEN:
        return None
    symbol_ns = form.symbol_ns + guard_ns
    trainings = (1, 2, 4, 4)[streams - 1]
    return Rate(round(1000 * int(bits) / symbol_ns, 6), int(bits), symbol_ns, _LEGACY_HEADER_NS,
                _LEGACY_NS + form.before_ns + trainings * form.training_ns[guard_ns], mcs, streams)


@lru_cache
def high_throughput(name: str, width_mhz: int, streams: int, guard_ns: int | None,
                    channel: int) -> Standard:
    """The standard of stations with QoS, whose frames are best effort. Its rates are those of
    802.11a, with 802.11b's on channels up to 14, which lie in 2.4 GHz, and then its own. Raises
    ``InputError`` for what the standard does not have."""
    form = FORMATS[name]
    if width_mhz not in form.subcarriers:
        raise InputError(f".width: {name} has no channels of {width_mhz} MHz; allowed: "
                         + ", ".join(f"{mhz} MHz" for mhz in form.subcarriers))
    if guard_ns not in (None, *form.guards_ns):
        raise InputError(f".guard_interval: {name} has none of {guard_ns} ns; allowed: "
                         + ", ".join(f"{ns} ns" for ns in form.guards_ns))
    low = channel in G.allowed_channels and name != "11ac"
    if low and width_mhz > 40:
        raise InputError(f".width: channel {channel} is in 2.4 GHz, which has no channels of "
                         f"{width_mhz} MHz; allowed: 20 MHz, 40 MHz, or a channel of 5 GHz")
    base = G.with_short_slots() if low else A  # nobody has 802.11b alone
    rates = _rates(name, width_mhz, streams, guard_ns or form.guards_ns[0])
    return replace(base, rates=base.rates + rates, aifsn=3, qos_bytes=2,
                   alone_bytes=0 if name == "11n" else DELIMITER_BYTES,
                   block_ack_bytes=56 if name == "11ax" else 32,
                   width_mhz=width_mhz,
                   allowed_channels=base.allowed_channels if low else channels_5ghz(width_mhz))


def _rates(name: str, width_mhz: int, streams: int, guard_ns: int) -> tuple[Rate, ...]:
    return tuple(found for mcs in range(FORMATS[name].last_mcs + 1)
                 if (found := rate(name, mcs, width_mhz, streams, guard_ns)))


def with_fewer_streams(standard: Standard, name: str, width_mhz: int, streams: int,
                       guard_ns: int | None) -> Standard:
    """``high_throughput`` with what a station may choose besides, behind its rates: those of fewer
    streams, and of the usual guard interval where the given one is shorter."""
    usual_ns = FORMATS[name].guards_ns[0]
    own = streams, guard_ns or usual_ns
    others = [(count, ns) for ns in sorted({own[1], max(usual_ns, own[1])})
              for count in range(1, streams + 1) if (count, ns) != own]
    return replace(standard, rates=standard.rates + tuple(
        one for choice in others for one in _rates(name, width_mhz, *choice)))


def mcs_index(name: str, standard: Standard, mcs: int | None) -> int:
    """The index of the rate with this MCS among the standard's, of the highest one for None. Raises
    ``InputError`` where there is none."""
    found: dict[int, int] = {}
    for k, one in enumerate(standard.rates):
        if one.mcs is not None:
            found.setdefault(one.mcs, k)
    if mcs is None:
        return max(found.values())
    if mcs not in found:
        raise InputError(f".mcs: {name} has no {mcs} with this width and these streams; allowed: "
                         + ", ".join(str(one) for one in found))
    return found[mcs]
