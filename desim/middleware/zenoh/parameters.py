"""The parameters of Zenoh, with their sources."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.tcp.parameters import TcpParams
from desim.units import PACE, ByteSize, Duration, Pace, Period


class ZenohConstants(ports.Constants):
    """The constants of ``rmw_zenoh``. What is "measured" was seen between routers of zenoh 1.10.2.
    """

    ascending = ("scout_first_ns", "scout_last_ns"), ("retry_first_ns", "retry_last_ns")

    open_timeout_ns: Period = Field("60 s", description=(
        "time that a link has to open in (zenoh transport/unicast/open_timeout: 10 s; rmw_zenoh: "
        "60 s)"))
    wait_before_close_ns: Period = Field("60 s", description=(
        "time that a message of a stream without a limit (queue: 0) may block a link before this "
        "is closed (zenoh congestion_control/block/wait_before_close: 5 s; rmw_zenoh: 60 s)"))
    wait_before_drop_ns: Duration = Field("1 ms", description=(
        "time that any other message waits for room before it is dropped, for each batch that it "
        "takes (zenoh congestion_control/drop/wait_before_drop)"))
    wait_before_drop_fragments_ns: Duration = Field("50 ms", description=(
        "most that these times add up to (zenoh "
        "congestion_control/drop/max_wait_before_drop_fragments)"))
    batch_bytes: ByteSize = Field("65535 B", ge=64, le=65535, description=(
        "largest batch (zenoh batch_size)"))
    batches: int = Field(2, ge=1, description=(
        "batches of a link, of which one may be in the socket's hands (zenoh queue/size/data; from "
        "general knowledge)"))
    scout_first_ns: Pace = Field("1 s", description=(
        "from the first scout to the second (zenoh orchestrator.rs)"))
    scout_last_ns: Pace = Field("8 s", description=(
        "to which that doubles (zenoh orchestrator.rs)"))
    open_wait_ns: Duration = Field("500 ms", description=(
        "from a host's start to its first declaration: sessions and routers look for others before "
        "they open (zenoh scouting/delay)"))
    scout_jitter_ns: Duration = Field("100 ms", description=(
        "the first scout comes at a random moment, up to that late (ours: simulated hosts start in "
        "one instant, and their scouts would collide on a radio for ever)"))
    retry_first_ns: Pace = Field("1 s", description=(
        "from the first failed connection to an endpoint to the next try (zenoh connect/retry)"))
    retry_last_ns: Pace = Field("4 s", description=(
        "to which that doubles (zenoh connect/retry)"))
    trees_ns: Duration = Field("100 ms", description=(
        "from a change of the topology to the declarations that it calls for (measured; zenoh "
        "TREES_COMPUTATION_DELAY_MS)"))
    flood_ns: Duration = Field("60 us", description=(
        "time that a router's computer works for each message of link states that it passes on: "
        "what it hears meanwhile is passed on after it (measured; about that of a core of 2024)"))


_ZENOH = {"lease": "10 s", "keep_alive": 4,
          "constants": {"open_timeout": "10 s", "wait_before_close": "5 s"}}
PRESETS: dict[str, ports.Preset] = {"zenoh": _ZENOH, "rmw_zenoh": {}, "rmw_zenoh_2024": _ZENOH}


class ZenohParams(ports.Params):
    """Defaults are those of ``rmw_zenoh``; another ``preset`` changes lease, keep_alive and
    two constants."""

    preset: Literal["zenoh", "rmw_zenoh", "rmw_zenoh_2024"] = Field("rmw_zenoh", description=(
        "the defaults of zenoh (DEFAULT_CONFIG.json5), of rmw_zenoh, or of rmw_zenoh as of October "
        "2024 (DEFAULT_RMW_ZENOH_ROUTER_CONFIG.json5)"))
    mode: Literal["router", "peer"] = Field("router", description=(
        "a router on each host, as with rmw_zenoh; or peers, zenoh's default: each links to all "
        "others, of which it hears by discovery or gossip, and forwards nothing"))
    discovery: Literal["multicast", "connect"] = Field("multicast", description=(
        "they find each other by multicast scouting, or only by the endpoints of connect "
        "(rmw_zenoh comes with multicast off and no endpoints, and so finds no other router)"))
    connect: list[str] = Field([], description=(
        "hosts that all others connect to (zenoh connect/endpoints)"))
    routers: list[str] = Field([], description=(
        "hosts that have a router; the others keep one link to one of these. Empty: every host "
        "(rmw_zenoh)"))
    gossip: bool = Field(False, description=(
        "routers connect to those that they hear of from others, as peers always do (zenoh "
        "scouting/gossip/autoconnect, which is empty for routers by default)"))
    lease_ns: Pace = Field("60 s", description=(
        "silence after which a link is closed (zenoh transport/link/tx/lease: 10 s; rmw_zenoh: "
        "60 s)"))
    keep_alive: int = Field(2, ge=1, description=(
        "messages to keep a resting link alive in each lease (zenoh: 4; rmw_zenoh: 2)"))
    tcp: TcpParams = Field(default_factory=TcpParams, description="the TCP below")
    constants: ZenohConstants = Field(default_factory=ZenohConstants, description=(
        "(those of rmw_zenoh; zenoh has another open_timeout and wait_before_close)"))

    @model_validator(mode="after")
    def _times_fit(self) -> ZenohParams:
        if self.lease_ns < self.keep_alive * PACE.least:
            raise ValueError(f"lease / keep_alive must be at least {PACE.format(PACE.least)}, got "
                             f"{PACE.format(self.lease_ns)} / {self.keep_alive}")
        return self

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, values: object) -> object:
        return ports.with_preset(values, "preset", "rmw_zenoh", PRESETS)
