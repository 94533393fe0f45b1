"""Timing, rates, channels and frame formats of 802.11a, b and g.

Numbers of IEEE 802.11-2016: clause 17 (OFDM, 5 GHz), 16 (DSSS and CCK, long preamble), 18 (ERP),
and 10.3 for the interframe spaces. ``high_throughput`` has the later ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from desim.errors import InputError, did_you_mean
from desim.ports import packet_sizes
from netmodels.ethernet import ETHERNET_BYTES

MSDU_BYTES = 2304  # the most that one packet carries (9.2.4.7.1), LLC included
LLC_BYTES = 8  # logical link control and SNAP, in the place of Ethernet's header
MAC_BYTES = 24 + 4  # header and check sequence of 802.11
ACK_BYTES = CTS_BYTES = 14
RTS_BYTES = CF_END_BYTES = 20
BLOCK_REQUEST_BYTES = 24  # (9.3.1.8)
DELIMITER_BYTES = 4  # before each packet of an aggregate (9.7.1)
MOST_BYTES = MSDU_BYTES - LLC_BYTES + ETHERNET_BYTES  # of a packet of the host, as that counts it


class Rate(NamedTuple):
    """One rate: ``bits`` a symbol of ``symbol_ns`` (DSSS: 8 bits, whose time is rounded up to whole
    us at the end). Header and payload begin ``header_ns`` and ``payload_ns`` after the frame.
    ``mcs``: the index of modulation and coding since 802.11n, of so many ``streams``."""

    mbps: float
    bits: int
    symbol_ns: int
    header_ns: int
    payload_ns: int
    mcs: int | None = None
    streams: int = 1

    @property
    def ofdm(self) -> bool:
        return self.symbol_ns > 0

    @property
    def modulation(self) -> tuple[bool, bool]:
        """Equal for rates of one modulation: DSSS, OFDM, or OFDM with an MCS."""
        return self.ofdm, self.mcs is not None

    @property
    def scheme(self) -> float:
        """The key of ``errors.bit_error``: the rate in Mb/s that 802.11a has with the same
        modulation and code, or would have."""
        return self.mbps if self.mcs is None else MCS_MBPS[self.mcs]


# The rate of 802.11a with the modulation and code of each MCS; from 60 on (64-QAM with 5/6) it has
# none, and these would be it: 48 subcarriers, 4 us.
MCS_MBPS = (6, 12, 18, 24, 36, 48, 54, 60, 72, 80, 90, 100)


def _ofdm(*rates: int) -> tuple[Rate, ...]:
    return tuple(Rate(mbps, 4 * mbps, 4000, 16_000, 20_000) for mbps in rates)


_DSSS = tuple(Rate(mbps, 0, 0, 144_000, 192_000) for mbps in (1, 2, 5.5, 11))
_OFDM = _ofdm(6, 9, 12, 18, 24, 36, 48, 54)


class Access(NamedTuple):
    """A station's access to the medium: slots that it is idle behind SIFS before the station counts
    its backoff (AIFSN; DIFS has 2), the least and the largest contention window, the TXOP limit (0:
    one exchange), and the category's rank, the higher the more urgent, and name."""

    aifsn: int
    cw_min: int
    cw_max: int
    txop_ns: int = 0
    rank: int = 1
    name: str = "best_effort"


@dataclass(frozen=True)
class Standard:
    """One PHY standard. Contention windows are in slots; ``rates`` ascend. ``basic_mbps``: the
    basic rates, which every station understands. Channel 0 would lie at ``band_hz``."""

    slot_ns: int
    sifs_ns: int
    cw_min: int
    rates: tuple[Rate, ...]
    basic_mbps: tuple[float, ...]
    band_hz: float
    allowed_channels: tuple[int, ...]
    extension_ns: int = 0  # silence behind OFDM frames (ERP: for the decoder)
    cw_max: int = 1023
    width_mhz: int = 20  # of a channel
    slow: bool = False  # DSSS alone, or stations with it on the channel
    # Since 802.11n: slots of the wait before a backoff (AIFSN; DIFS has 2), bytes that QoS adds to
    # a packet and a delimiter to one that goes alone.
    aifsn: int = 2
    qos_bytes: int = 0
    alone_bytes: int = 0
    block_ack_bytes: int = 32  # for 64 packets (9.3.1.9)

    @property
    def access(self) -> Access:
        """The access of stations without a category, and of best effort."""
        return Access(self.aifsn, self.cw_min, self.cw_max)

    @property
    def difs_ns(self) -> int:
        """DIFS, with QoS AIFS (10.3.2.3.5)."""
        return self.sifs_ns + self.aifsn * self.slot_ns

    @property
    def eifs_ns(self) -> int:
        """The wait after a frame with errors: long enough for an acknowledgement at the lowest
        rate."""
        return self.sifs_ns + self.airtime_ns(ACK_BYTES, 0) + self.difs_ns

    def no_channel(self, channel: int) -> str | None:
        """The complaint about a channel that there is not, else None."""
        allowed = self.allowed_channels
        if channel in allowed:
            return None
        last = allowed[-1]
        listed = f"1 to {last}" if len(allowed) == last else ", ".join(map(str, allowed))
        said = (f"there is no channel {channel} of {self.width_mhz} MHz in {self.band}; allowed: "
                f"{listed}")
        if self.band == "2.4 GHz" or channel not in CHANNELS_5GHZ:
            return said
        most_mhz = max(mhz for mhz in (20, 40, 80) if channel in channels_5ghz(mhz))
        return f"{said}; channel {channel} has at most {most_mhz} MHz"

    @property
    def band(self) -> str:
        """The band in words."""
        return "5 GHz" if self.allowed_channels[0] == CHANNELS_5GHZ[0] else "2.4 GHz"

    def carrier_hz(self, channel: int) -> float:
        """Centre of a channel (17.3.8.4.2, 16.3.6.3); the last of 2.4 GHz stands apart."""
        return _CHANNEL_14_HZ if channel == 14 else self.band_hz + 5e6 * channel

    def spectrum(self, channel: int) -> tuple[float, float]:
        """From where to where a channel reaches, as channel numbers of 5 MHz each: in 5 GHz the
        whole group of 20 MHz channels (table E-4), in 2.4 GHz at least 25 MHz, as wide as DSSS
        and numbers of which the model does not know on which side the second 20 MHz lie."""
        if self.band == "2.4 GHz":
            half = max(5, self.width_mhz // 5) / 2
            return channel - half, channel + half
        first, last = next(group for group in groups_5ghz(self.width_mhz)
                           if group[0] <= channel <= group[1])
        return first - 2, last + 2

    def overlap(self, channel: int, other: Standard, others: int) -> str | None:
        """The channels allowed instead, where two different ones overlap; else None."""
        (low, high), (from_, to) = self.spectrum(channel), other.spectrum(others)
        if channel == others or high <= from_ or to <= low:
            return None
        if self.band == "2.4 GHz":
            return f"the same, or {(high - low + to - from_) / 2:g} and more apart"
        return f"the same, or one outside of {from_ + 2:g} to {to - 2:g}"

    def rate(self, mbps: float) -> int:
        """The index of a rate. Raises ValueError if there is none of that many Mb/s."""
        return [rate.mbps for rate in self.rates].index(mbps)

    def with_short_slots(self) -> Standard:
        """With slots of 9 us, as an access point announces them where no station has 802.11b alone
        (802.11-2016, 9.4.1.4; hostapd: ``num_sta_no_short_slot_time``)."""
        return self if self.slow else replace(self, slot_ns=_SHORT_SLOT_NS)

    def alike(self, rate: int) -> list[int]:
        """The rates of the same modulation, the slowest first."""
        modulation = self.rates[rate].modulation
        return [k for k, other in enumerate(self.rates) if other.modulation == modulation]

    def lowest(self, rate: int) -> int:
        """The lowest rate of the same modulation, of OFDM for an MCS: of headers, and of what
        everybody is to hear."""
        return next(k for k, other in enumerate(self.rates) if other.ofdm == self.rates[rate].ofdm)

    def airtime_ns(self, psdu_bytes: int, rate: int) -> int:
        """Airtime of a frame of ``psdu_bytes`` at ``rates[rate]``; OFDM adds 16 service and 6 tail
        bits."""
        how = self.rates[rate]
        if how.ofdm:
            symbols = -(-(16 + 8 * psdu_bytes + 6) // how.bits)
            return how.payload_ns + symbols * how.symbol_ns + self.extension_ns
        return how.payload_ns + 1000 * -(-80 * psdu_bytes // round(10 * how.mbps))

    def legacy_rate(self, name: str, key: str, bps: int) -> int:
        """The index of a rate without an MCS. Raises ``InputError`` for one that this standard of
        that ``name`` does not have."""
        for k, rate in enumerate(self.rates):
            if round(rate.mbps * 1e6) == bps and rate.mcs is None:
                return k
        raise InputError(f".{key}: {bps / 1e6:g} Mb/s is no rate of {name}; allowed: " + ", ".join(
            f"{rate.mbps:g} Mb/s" for rate in self.rates if rate.mcs is None))

    def with_basic(self, name: str, basic_rates_bps: Sequence[int] | None) -> Standard:
        """With these basic rates instead of its own. Raises ``InputError`` for rates that it does
        not have."""
        if basic_rates_bps is None:
            return self
        return replace(self, basic_mbps=tuple(
            self.rates[self.legacy_rate(name, f"basic_rates.{k}", bps)].mbps
            for k, bps in enumerate(basic_rates_bps)))

    def reply_rate(self, rate: int) -> int:
        """The rate of acknowledgements and CTS: the highest basic rate of the same modulation that
        is not above the frame's (10.7.6.5.2), the lowest one where there is none. An MCS counts
        as the rate of its modulation and code (10.7.6.5.3)."""
        lowest, most = self.lowest(rate), self.rates[rate].scheme
        basic = [k for k in self.alike(lowest)
                 if self.rates[k].mbps <= most and self.rates[k].mbps in self.basic_mbps]
        return max(basic, default=lowest)


def psdu_bytes(size_bytes: int, segments: int) -> int:
    """A packet on the air, from a frame of ``segments`` packets with Ethernet's headers: 1000 B of
    UDP are 1064 B."""
    return -(-size_bytes // segments) - ETHERNET_BYTES + LLC_BYTES + MAC_BYTES


@lru_cache(1 << 10)
def train_bytes(size_bytes: int, segments: int, more_bytes: int = 0) -> tuple[int, int]:
    """The first packet of a train on the air, and the last one, with ``more_bytes`` each. Raises
    ``InputError`` for a packet that 802.11 has no frame for."""
    sizes = packet_sizes(size_bytes, segments)
    if sizes[0] > MOST_BYTES:
        raise InputError(f"a packet of {sizes[0]} B is too long for 802.11; at most {MOST_BYTES} B "
                         "with Ethernet's headers")
    return psdu_bytes(sizes[0], 1) + more_bytes, psdu_bytes(sizes[-1], 1) + more_bytes


FIVE_GHZ = 36  # the first channel of the band, of any width
CHANNELS_2GHZ = tuple(range(1, 15))
_CHANNEL_14_HZ = 2.484e9
CHANNELS_5GHZ = (*range(36, 65, 4), *range(100, 145, 4), *range(149, 166, 4))


def groups_5ghz(width_mhz: int) -> list[tuple[int, int]]:
    """The first and the last one of the 20 MHz channels of each channel of this width: of 40 MHz
    and more are whole groups of them (IEEE 802.11-2020, table E-4, classes 115 to 130)."""
    step = width_mhz // 5
    return [(channel, channel + step - 4) for first, last in ((36, 64), (100, 144), (149, 165))
            for channel in range(first, last + 1, step) if channel + step - 4 <= last]


def channels_5ghz(width_mhz: int) -> tuple[int, ...]:
    """The channels of 20 MHz that a channel of this width may have as its primary one."""
    return tuple(channel for first, last in groups_5ghz(width_mhz)
                 for channel in range(first, last + 1, 4))


_SHORT_SLOT_NS = 9_000
A = Standard(slot_ns=_SHORT_SLOT_NS, sifs_ns=16_000, cw_min=15, rates=_OFDM, basic_mbps=(6, 12, 24),
             band_hz=5e9, allowed_channels=CHANNELS_5GHZ)
B = Standard(slot_ns=20_000, sifs_ns=10_000, cw_min=31, rates=_DSSS, basic_mbps=(1, 2, 5.5, 11),
             band_hz=2.407e9, allowed_channels=CHANNELS_2GHZ, slow=True)
# Without an access point, and where stations of 802.11b may be: their slots (with one:
# ``with_short_slots``).
G = Standard(slot_ns=20_000, sifs_ns=10_000, cw_min=15, rates=_DSSS + _OFDM,
             basic_mbps=(1, 2, 5.5, 11, 6, 12, 24),
             band_hz=2.407e9, allowed_channels=CHANNELS_2GHZ, extension_ns=6_000)

StandardName = Literal["11a", "11b", "11g"]
RadioName = Literal["11a", "11b", "11g", "11n", "11ac", "11ax"]
STANDARDS = {"11a": A, "11b": B, "11g": G}


def chosen_rates(standard: Standard, name: str, rate_bps: int, broadcast_rate_bps: int | None
                 ) -> tuple[int, int]:
    """The rates of unicast and of broadcast frames, as indices of ``standard.rates``; the latter by
    default the lowest of the same modulation. Raises ``InputError`` for rates that the standard
    does not have."""
    unicast = standard.legacy_rate(name, "rate", rate_bps)
    if broadcast_rate_bps is not None:
        return unicast, standard.legacy_rate(name, "broadcast_rate", broadcast_rate_bps)
    return unicast, standard.lowest(unicast)


def channels_of(hosts: tuple[str, ...], channel: int, by_host: dict[str, int], standard: Standard
                ) -> np.ndarray:
    """[hosts] their channels' numbers: ``by_host``, or ``channel``. Raises ``InputError`` for an
    unknown host, for channels that the standard does not have, and for different ones that overlap.
    """
    for host in by_host:
        if host not in hosts:
            raise InputError(f".channels: no host {host!r}{did_you_mean(host, hosts)}")
    for key, number in (("channel", channel), *((f"channels.{host}", number)
                                                for host, number in by_host.items())):
        if complaint := standard.no_channel(number):
            raise InputError(f".{key}: {complaint}")
    for one, other in pairwise(sorted({*by_host.values(), channel})):
        if allowed := standard.overlap(other, standard, one):
            raise InputError(f".channels: {one} and {other} overlap, which this model knows "
                             f"nothing of; allowed: {allowed}")
    return np.array([by_host.get(host, channel) for host in hosts])
