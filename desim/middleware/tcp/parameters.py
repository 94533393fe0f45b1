"""The parameters of TCP, and how bytes become segments."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise
from typing import Literal

from pydantic import Field

from desim import ports
from desim.middleware.headers import MSS_BYTES, SEGMENT_HEADER_BYTES
from desim.units import ByteSize, Duration, Pace, Period

TIMEOUT_MIN_NS = 2_000_000  # Linux 6.7 TCP_TIMEOUT_MIN_US; two ticks before
SYN_BYTES = SEGMENT_HEADER_BYTES + 8  # 20 B of options: MSS, SACK, timestamps, window scale


class TcpConstants(ports.Constants):
    """The constants of TCP. Each has its source in brackets; those of Linux and of RFCs are from
    general knowledge."""

    ascending = ("rto_min_ns", "rto_max_ns"), ("first_rto_ns", "rto_max_ns")

    tick_ns: Duration = Field("4 ms", description=(
        "the clock of timers, which run up to an eighth longer than they are set for (Linux "
        "CONFIG_HZ=250, kernel/time/timer.c; 0 ns: they are exact)"))
    rto_min_ns: Pace = Field("200 ms", description=(
        "what a retransmission timeout has at least beside the smoothed round trip (Linux "
        "TCP_RTO_MIN in __tcp_set_rto)"))
    rto_max_ns: Pace = Field("120 s", description=(
        "greatest retransmission timeout, to which it doubles (Linux TCP_RTO_MAX)"))
    first_rto_ns: Pace = Field("1 s", description=(
        "timeout of the first SYN, and of data before the first measured round trip (RFC 6298)"))
    syn_retries: int = Field(6, ge=0, le=127, description=(
        "times that a SYN is sent again after timeouts that double; a connection attempt ends "
        "after about 131 s (Linux tcp_syn_retries)"))
    syn_linear: int = Field(4, ge=0, le=127, description=(
        "times that it is sent again before that, each after the first timeout (Linux 6.5 "
        "tcp_syn_linear_timeouts; 0 before)"))
    synack_retries: int = Field(5, ge=0, le=255, description=(
        "times that a SYN-ACK is sent again (Linux tcp_synack_retries)"))
    retries: int = Field(15, ge=0, le=255, description=(
        "data is sent again without an answer for as long as so many retransmissions would take "
        "at the least timeout, then the connection is given up: 15 are 924.6 s (Linux "
        "tcp_retries2)"))
    initial_window: int = Field(10, ge=1, description="segments of the first flight (RFC 6928)")
    delayed_ack_ns: Duration = Field("40 ms", description=(
        "an acknowledgement waits that long for data to travel with, unless more than one full "
        "segment is to be acknowledged, where the receiver answers what it hears; in one "
        "direction it goes at once (Linux TCP_DELACK_MIN, pingpong mode)"))
    ack_every: int = Field(2, ge=1, description=(
        "full segments of a train that have one acknowledgement; with 44 a train has one, as where "
        "the receiver's GRO puts it together; behind a gap each has one, or where it is above 2 so "
        "many (RFC 1122, Linux tcp_comp_sack_nr)"))
    duplicate_acks: int = Field(3, ge=1, description=(
        "segments that arrived behind a gap that show at once that it is lost; fewer have to "
        "wait for a quarter of a round trip (Linux tcp_reordering, RFC 8985)"))
    keepalive_idle_ns: Pace = Field("60 s", description=(
        "silence after which a kept alive connection is probed (roscpp transport_tcp)"))
    keepalive_interval_ns: Pace = Field("10 s", description=(
        "from probe to probe (roscpp transport_tcp)"))
    keepalive_probes: int = Field(9, ge=1, description=(
        "probes without an answer after which the peer is taken for dead (roscpp transport_tcp)"))
    window_bytes: ByteSize = Field("3 MB", ge=2 * MSS_BYTES, description=(
        "most that may be unacknowledged, the receiver's window (Linux tcp_rmem, half of 6 MB)"))
    segment_bytes: ByteSize = Field("2304 B", ge=1, description=(
        "memory that a full segment is taken to need: the send buffer has room for twice the "
        "congestion window of them (Linux tcp_sndbuf_expand; measured, 46 080 B at first; kernels "
        "with long link headers, as those of Debian: 4352 B)"))
    piece_segments: int = Field(26, ge=1, le=45, description=(
        "full segments in a piece of memory, by which unsent data are collected: half of the "
        "window that a receiver offers first (Linux tcp_bound_to_half_wnd; measured with 6.18; "
        "with 6.1: 22)"))
    buffer_bytes: ByteSize = Field("4 MB", ge=1, description=(
        "most that the send buffer grows to (Linux tcp_wmem)"))
    near_ns: Duration = Field("0.1 ms", description=(
        "where the first round trip was shorter, a message goes as one train and does not wait for "
        "the window to open, which takes some such round trips, until something gets lost (ours, "
        "for fewer frames; 0 ns: never)"))
    train: int = Field(256, ge=2, description=(
        "most segments that go to the network as one train (ours: a map of 400 x 400 cells has "
        "111; Linux GSO: 44)"))
    burst_ns: Period = Field("4 ms", description=(
        "a train is no longer than that at the rate of two windows a round trip, so that a short "
        "path sees few of them; a third of the window is worth one (ours, for fewer frames; "
        "Linux: 1 ms, tcp_tso_win_divisor)"))

    @property
    def silence_ns(self) -> int:
        """The time for which data is sent again without an answer (Linux tcp_model_timeout)."""
        most_ns: int = self.rto_max_ns
        least_ns: int = self.rto_min_ns
        most = (most_ns // least_ns).bit_length() - 1  # doublings up to the longest
        doubled = min(self.retries, most)
        return ((2 << doubled) - 1) * least_ns + (self.retries - doubled) * most_ns


class TcpParams(ports.Params):
    """Parameters of all TCP connections of a run."""

    arp: Literal["natural", "static"] = Field("natural", description=(
        "natural: a host asks for the other's address, and again when it has not heard of it for "
        "long, and a retransmission that finds none takes one doubling of the timeout back (RFC "
        "6069), as on any LAN; static: addresses are known for good, as where the hosts are "
        "not on one subnet"))
    constants: TcpConstants = Field(default_factory=TcpConstants, description="(those of Linux)")


def runs(segments: int, lost: Collection[int]) -> list[tuple[int, int]]:
    """The runs of segments of a train that are not ``lost``: number of the first one, and of the
    first one behind the run."""
    gaps = [-1, *sorted(lost), segments]
    return [(gap + 1, after) for gap, after in pairwise(gaps) if after > gap + 1]
