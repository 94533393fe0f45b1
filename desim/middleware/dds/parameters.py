"""The parameters of DDS, and the two implementations whose values are known."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.dds import wire
from desim.middleware.dds.constants import DdsConstants
from desim.units import DURATION, Pace

# What Cyclone DDS has different (src/core/ddsi/defconfig.c, docs/manual/options.md).
CYCLONEDDS: ports.Preset = {
    "lease": "10 s", "constants": {
        "initial_announcements": 1, "first_times": 2, "announcement_period": None,
        "announces_when_found": False, "responses": 4, "liveliness_period": None,
        "initial_heartbeat": "5 ms", "greets_all": True, "heartbeat_period": "100 ms",
        "heartbeat_limit": "8 s", "heartbeat_asks_after": "80 ms", "heartbeat_response": "0 ns",
        "heartbeat_rides": "always", "heartbeat_after": None, "timer_slip": "0 ns",
        "discovery_heartbeat_period": "100 ms", "discovery_heartbeat_limit": "8 s",
        "discovery_heartbeats_all": False, "discovery_heartbeat_response": "0 ns",
        "discovery_nack_response": "0 ns", "initial_acknack": "10 ms",
        "initial_acknack_limit": None, "nack_delay": "100 ms", "nack_again": "100 ms",
        "nack_renewal": "3 s", "ack_again": "10 ms", "nack_suppression": "5 ms",
        "nack_response": "0 ns", "repeated_message": "1456 B", "fragment": "1344 B",
        "data_message": "13440 B"}}
CYCLONE = ("cyclonedds", "cyclonedds_11_0")


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
    lease_ns: Pace = Field("20 s", description=(
        "a participant that was silent for so long is gone; each says it about itself (fastdds "
        "20 s, cyclonedds 10 s)"))
    leases: dict[str, Pace] = Field({}, description="of single hosts, by name (none)")
    allow_multicast: Literal["spdp", "all"] = Field("spdp", description=(
        "what cyclonedds says by multicast: announcements alone, which then also go to each known "
        "participant (its default on wireless networks); or discovery, too (on others). That of "
        "fastdds is always spdp"))
    acks: Literal["sent", "implied"] = Field("sent", description=(
        "sent: readers answer heartbeats; implied: a writer knows at once that a reader has all, "
        "which answers only to ask for what it misses, for long studies on networks that have room "
        "(sent: DDS)"))
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
    def wire(self) -> wire.RtpsDialect:
        """The dialect of its implementation."""
        if self.preset not in CYCLONE:
            return wire.FASTDDS
        return (wire.CYCLONEDDS if self.allow_multicast == "spdp" else wire.CYCLONEDDS_MULTICAST)
