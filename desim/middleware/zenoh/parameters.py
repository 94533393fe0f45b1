"""The parameters of Zenoh, with their sources."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from desim import ports
from desim.middleware.tcp.parameters import TcpParams
from desim.middleware.zenoh.constants import ZenohConstants
from desim.units import PACE, Pace

_ZENOH = {"lease": "10 s", "keep_alive": 4,
          "constants": {"open_timeout": "10 s", "wait_before_close": "5 s"}}
PRESETS: dict[str, ports.Preset] = {"zenoh": _ZENOH, "rmw_zenoh": {}, "rmw_zenoh_2024": _ZENOH}


class ZenohParams(ports.Params):
    """Defaults are those of ``rmw_zenoh``; another ``preset`` changes lease, keep_alive and
    two constants."""

    preset: Literal["zenoh", "rmw_zenoh", "rmw_zenoh_2024"] = Field("rmw_zenoh", description=(
        "the defaults of zenoh (DEFAULT_CONFIG.json5), of rmw_zenoh, or of rmw_zenoh as of October "
        "2024 (DEFAULT_RMW_ZENOH_ROUTER_CONFIG.json5)"))
    discovery: Literal["multicast", "connect"] = Field("multicast", description=(
        "routers find each other by multicast scouting, or only by the endpoints of connect "
        "(rmw_zenoh comes with multicast off and no endpoints, and so finds no other router)"))
    connect: list[str] = Field([], description=(
        "hosts whose routers all others connect to (zenoh connect/endpoints)"))
    routers: list[str] = Field([], description=(
        "hosts that have a router; the others keep one link to one of these. Empty: every host "
        "(rmw_zenoh)"))
    gossip: bool = Field(False, description=(
        "routers connect to those that they hear of from others (zenoh scouting/gossip/autoconnect "
        "of routers, which is empty by default)"))
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
