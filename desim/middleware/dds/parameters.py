"""The parameters of DDS, and the two implementations whose values are known."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.dds import wire
from desim.middleware.dds.domains import MOST_DOMAIN
from desim.units import DURATION, NS_PER_S, ByteSize, Duration, Pace


class DdsConstants(ports.Constants):
    """The constants of ``fastdds``; those that ``cyclonedds`` has different stand beside them."""

    ascending = (("heartbeat_period_ns", "heartbeat_limit_ns"),
                 ("discovery_heartbeat_period_ns", "discovery_heartbeat_limit_ns"))

    initial_announcements: int = Field(6, ge=1, le=1000, description=(
        "of a participant that starts (fastdds 6, cyclonedds 1; measured)"))
    first_times: int = Field(1, ge=1, le=100, description=(
        "announcements in the first packet (fastdds 1, cyclonedds 2; measured)"))
    initial_period_ns: Pace = Field("100 ms", description="between these (fastdds)")
    announcement_period_ns: Pace | None = Field("3 s", description=(
        "after these; null: 80 % of the host's lease, at most 30 s (fastdds 3 s, cyclonedds null)"))
    announces_when_found: bool = Field(True, description=(
        "whenever it finds a participant, one announces itself to all and to each that it knows "
        "(fastdds yes, cyclonedds no; measured)"))
    responses: int = Field(0, ge=0, le=1000, description=(
        "announcements sent to a newly heard participant alone (fastdds 0, "
        "cyclonedds 4; measured)"))
    response_period_ns: Pace = Field("1 s", description="between these (cyclonedds, measured)")
    liveliness_period_ns: Duration | None = Field("0 ns", description=(
        "of messages that say nothing else, 0: none; null: 80 % of the host's lease (fastdds none, "
        "cyclonedds null)"))
    start_spread_ns: Duration = Field("200 ms", description=(
        "a participant starts up to so much after its host, at random: hosts that all announce "
        "themselves in one nanosecond would collide on a radio for ever (ours; eight processes "
        "that a loop started were 0.25 s apart)"))
    endpoint_delay_ns: Duration = Field("35 ms", description=(
        "from a participant's start until its endpoints are there (measured, cyclonedds)"))
    initial_heartbeat_ns: Duration = Field("0 ns", description=(
        "to a new reader (fastdds at once, measured; cyclonedds 5 ms)"))
    first_heartbeat_to_all: bool = Field(False, description=(
        "that heartbeat goes to all readers of the writer, and the new one alone answers (fastdds "
        "no, cyclonedds yes; measured)"))
    discovery_heartbeat_period_ns: Pace = Field("1 s", description=(
        "the same of discovery's own writers as heartbeat_period (fastdds 1 s, cyclonedds 100 ms; "
        "measured)"))
    discovery_heartbeat_limit_ns: Pace = Field("1 s", description=(
        "up to which that period doubles without an answer (fastdds: never; cyclonedds 8 s)"))
    discovery_heartbeats_all: bool = Field(True, description=(
        "that heartbeat goes to all if one has not acknowledged (fastdds yes, cyclonedds no; "
        "measured)"))
    discovery_heartbeat_response_ns: Duration = Field("10 us", description=(
        "until a reader of discovery answers (fastdds EDPSimple.cpp 10 us, cyclonedds at once)"))
    discovery_nack_response_ns: Duration = Field("100 us", description=(
        "until a writer of discovery repeats something (fastdds EDPSimple.cpp 100 us, cyclonedds "
        "at once)"))
    heartbeat_rides: Literal["always", "written", "unacknowledged"] = Field(
        "written", description=(
        "on which samples: always (cyclonedds); written: on all once the writer has written depth "
        "of them (fastdds, whose writers keep what was acknowledged, measured); unacknowledged: "
        "while depth of them are not acknowledged (fastdds with the durability VOLATILE of ROS 2's "
        "default topics, measured)"))
    heartbeat_after_bytes: ByteSize | None = Field("106496 B", ge=1000, description=(
        "sent since the last heartbeat, after which one rides anyhow (fastdds: a socket's buffer, "
        "Linux wmem_default 212992 B, of which asio reports half; cyclonedds null)"))
    timer_slip_ns: Duration = Field("100 us", description=(
        "by which a heartbeat comes later than its period (fastdds, measured: 3.0001 s; cyclonedds "
        "1 us: a sample at that instant goes first, measured)"))
    heartbeat_period_ns: Pace = Field("3 s", description=(
        "while something is not acknowledged (fastdds 3 s, cyclonedds 100 ms)"))
    heartbeat_limit_ns: Pace = Field("3 s", description=(
        "up to which the period doubles without an answer (fastdds: never; cyclonedds 8 s)"))
    heartbeat_asks_after_ns: Duration = Field("0 ns", description=(
        "since the last heartbeat, the one behind a sample asks for an answer (fastdds always; "
        "cyclonedds 80 % of its period, measured)"))
    heartbeat_response_ns: Duration = Field("5 ms", description=(
        "until a reader answers (fastdds 5 ms; cyclonedds at once, measured)"))
    initial_acknack_ns: Pace | None = Field("70 ms", description=(
        "until a reader asks a new writer for its samples, then again and again in doubled times; "
        "null: never (fastdds 70 ms, cyclonedds 10 ms)"))
    initial_acknack_limit_ns: Pace | None = Field("70 ms", description=(
        "up to which that time doubles; null: the time between announcements (fastdds does not "
        "double it, measured; cyclonedds null)"))
    nack_delay_ns: Duration = Field("5 ms", description=(
        "until a reader asks for what it misses if it was not asked (fastdds 5 ms, cyclonedds "
        "100 ms)"))
    nack_again_ns: Duration = Field("0 ns", description=(
        "until a reader asks again for the same things, unless they were sent again (fastdds: "
        "whenever it is asked, not verified; cyclonedds NackDelay 100 ms)"))
    nack_renewal_ns: Pace | None = Field(None, description=(
        "until an unanswered reader asks again; null: never (fastdds never, not verified; "
        "cyclonedds AutoReschedNack 3 s)"))
    ack_again_ns: Duration = Field("0 ns", description=(
        "until a reader acknowledges the same again (fastdds: whenever it is asked, not verified; "
        "cyclonedds AckDelay 10 ms)"))
    nack_suppression_ns: Duration = Field("0 ns", description=(
        "until a writer repeats the same again, doubled each time up to the limit of the heartbeat "
        "period (fastdds nackSupressionDuration 0; cyclonedds RetransmitMergingPeriod 5 ms, which "
        "it keeps for all readers or not at all. That it doubles is ours: a real writer stops "
        "while its host's queue is full, which is not modelled)"))
    nack_response_ns: Duration = Field("5 ms", description=(
        "until a writer repeats something (fastdds 5 ms; cyclonedds at once, measured)"))
    repeated_message_bytes: ByteSize = Field("65500 B", le=65_500, description=(
        "of one RTPS message that announces endpoints again (fastdds maximum, cyclonedds "
        "rexmit message)"))
    fragment_bytes: ByteSize = Field("65324 B", ge=1000, le=65_400, description=(
        "of a sample that get lost, are asked for and sent again by themselves (fastdds: in UDP "
        "messages of 65500 B, measured; cyclonedds 1344 B in a rexmit message of 1456 B)"))
    data_message_bytes: ByteSize = Field("65324 B", ge=1000, le=65_400, description=(
        "of a sample in one UDP message at first, in whole fragments (fastdds: UDP messages up to "
        "65500 B; cyclonedds: ten fragments in 14720 B; measured)"))
    max_samples: int | None = Field(5000, ge=1, description=(
        "not acknowledged, from which on a call of a writer that keeps all (depth 0) waits "
        "(fastdds: ResourceLimitsQosPolicy; cyclonedds null)"))
    high_bytes: ByteSize | None = Field(None, description=(
        "the same in bytes (fastdds null; cyclonedds WhcHigh 500 kB, which it begins at 30 kB and "
        "keeps to for all reliable writers: not modelled)"))
    low_bytes: ByteSize = Field("1 kB", description=(
        "of those, at which such a call goes on (cyclonedds WhcLow)"))
    max_blocking_time_ns: Duration = Field("100 ms", description=(
        "after which such a call returns an error, and its message is lost (both; DDS "
        "ReliabilityQosPolicy)"))
    high_water_bytes: ByteSize = Field("250.5 kB", description=(
        "not acknowledged, from which each heartbeat asks (cyclonedds: in the middle between "
        "WhcLow, 1 kB, and WhcHigh, 500 kB; those of fastdds ask anyway)"))
    server_period_ns: Pace = Field("450 ms", description=(
        "in which a client calls a server that does not answer (fastdds)"))

    @model_validator(mode="after")
    def _sound(self) -> DdsConstants:
        if self.liveliness_period_ns is not None and 0 < self.liveliness_period_ns < 10**6:
            raise ValueError(
                f"liveliness_period: {DURATION.format(self.liveliness_period_ns)} is too small; "
                "allowed: 0 ns, or at least 1 ms, or null: 80 % of the lease")
        if self.data_message_bytes < self.fragment_bytes:
            raise ValueError(f"data_message: {self.data_message_bytes} B hold no fragment of "
                             f"{self.fragment_bytes} B; allowed: at least as much as fragment")
        return self

    @property
    def message_fragments(self) -> int:
        """Fragments in one UDP message."""
        return int(self.data_message_bytes // self.fragment_bytes)

    def announcing_ns(self, lease_ns: int) -> int:
        """The time between two announcements of a participant with this lease."""
        if self.announcement_period_ns is None:
            return min(lease_ns * 4 // 5, 30 * NS_PER_S)  # Cyclone DDS: SPDPInterval
        return int(self.announcement_period_ns)

    def asserting_ns(self, lease_ns: int) -> int:
        """The time between two of its assertions of liveliness, 0 for none."""
        period_ns = self.liveliness_period_ns
        return lease_ns * 4 // 5 if period_ns is None else period_ns


# What Cyclone DDS has different (src/core/ddsi/defconfig.c, docs/manual/options.md).
CYCLONEDDS: ports.Preset = {
    "lease": "10 s", "constants": {
        "initial_announcements": 1, "first_times": 2, "announcement_period": None,
        "announces_when_found": False, "responses": 4, "liveliness_period": None,
        "initial_heartbeat": "5 ms", "first_heartbeat_to_all": True, "heartbeat_period": "100 ms",
        "heartbeat_limit": "8 s", "heartbeat_asks_after": "80 ms", "heartbeat_response": "0 ns",
        "heartbeat_rides": "always", "heartbeat_after": None, "timer_slip": "1 us",
        "discovery_heartbeat_period": "100 ms", "discovery_heartbeat_limit": "8 s",
        "discovery_heartbeats_all": False, "discovery_heartbeat_response": "0 ns",
        "discovery_nack_response": "0 ns", "initial_acknack": "10 ms",
        "initial_acknack_limit": None, "nack_delay": "100 ms", "nack_again": "100 ms",
        "nack_renewal": "3 s", "ack_again": "10 ms", "nack_suppression": "5 ms",
        "nack_response": "0 ns", "repeated_message": "1456 B", "max_samples": None,
        "high": "500 kB", "fragment": "1344 B", "data_message": "13440 B"}}
CYCLONE = ("cyclonedds", "cyclonedds_11_0")


Domain = Annotated[int, Field(ge=0, le=MOST_DOMAIN)]


class DdsParams(ports.Params):
    """Defaults are those of ``fastdds``; ``preset: cyclonedds`` changes them where it differs.

    A preset is named after the version whose packets were measured: Fast DDS 2.9.1 as Debian
    builds it, Cyclone DDS 11.0.1. A name without a version is the latest one that was measured.
    """

    preset: Literal["fastdds", "cyclonedds", "fastdds_2_9", "cyclonedds_11_0"] = Field(
        "fastdds", description="(ROS 2's default); a name without a version: the latest measured")
    discovery: Literal["simple", "server"] = Field("simple", description=(
        "everybody tells everybody, or all tell one server (Fast DDS Discovery Server)"))
    server: str | None = Field(None, description="the host of the server (none)")
    domain: Domain = Field(0, description=(
        "ROS_DOMAIN_ID of all hosts: those of another domain do not find each other, and drop each "
        "other's announcements at the socket (0; 0 to 101 and 215 to 232 keep out of the ports "
        "that Linux gives to others)"))
    domains: dict[str, Domain] = Field({}, description=(
        "of hosts by name, or by a pattern with * and ?, of which the first that fits counts "
        "(none)"))
    participants: int = Field(1, ge=1, le=200, description=(
        "processes of each host that are ROS 2 nodes: the first has the fleet's topics, the others "
        "a node's own endpoints; those of one host find each other without frames (the server's "
        "host has one)"))
    lease_ns: Pace = Field("20 s", description=(
        "a participant that was silent for so long is gone; each says it about itself (fastdds "
        "20 s, cyclonedds 10 s)"))
    leases: dict[str, Pace] = Field({}, description="of single hosts, by name (none)")
    allow_multicast: Literal["spdp", "all"] = Field("spdp", description=(
        "what cyclonedds says by multicast: announcements alone, which then also go to each known "
        "participant (its default on wireless networks); or discovery, too (on others). That of "
        "fastdds is always spdp"))
    depth: int | None = Field(None, ge=0, le=1_000_000, description=(
        "samples that a reliable writer keeps for a reader, 0: all (null: the publisher's queue; "
        "ROS 2 default 10)"))
    constants: DdsConstants = Field(default_factory=DdsConstants, description=(
        "(those of the preset)"))

    @model_validator(mode="before")
    @classmethod
    def _filled(cls, given: object) -> object:
        return ports.with_preset(given, "preset", "fastdds", dict.fromkeys(CYCLONE, CYCLONEDDS))

    @model_validator(mode="after")
    def _sound(self) -> DdsParams:
        most_ns = self.constants.announcement_period_ns
        least_ns = min([self.lease_ns, *self.leases.values()])
        if most_ns is not None and most_ns >= least_ns:
            raise ValueError(
                f"announcement_period: {DURATION.format(most_ns)} is not below the shortest lease, "
                f"{DURATION.format(least_ns)}: who says nothing else would be removed between any "
                "two announcements; allowed: less than each lease, or null: 80 % of it")
        if self.allow_multicast == "all" and self.preset not in CYCLONE:
            raise ValueError("allow_multicast: all is cyclonedds' alone; allowed: spdp")
        return self

    @property
    def wire(self) -> wire.RtpsVendor:
        """The dialect of its implementation."""
        if self.preset not in CYCLONE:
            return wire.FASTDDS
        return (wire.CYCLONEDDS if self.allow_multicast == "spdp" else wire.CYCLONEDDS_MULTICAST)
