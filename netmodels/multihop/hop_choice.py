"""The choice of single hops to build on."""

from __future__ import annotations

from typing import Literal, TypeVar

from pydantic import Field, model_validator

from desim import ports
from netmodels.disk import Disk
from netmodels.ideal_mac import IdealMac
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.tdma import Tdma

Hop = DcfRadio | Disk | IdealMac | Tdma
HOPS: dict[str, type[DcfRadio] | type[Disk] | type[IdealMac] | type[Tdma]] = {
    "radio": DcfRadio, "disk": Disk, "ideal_mac": IdealMac, "tdma": Tdma}

P = TypeVar("P", bound=ports.Params)


class HopChoice(ports.Params):
    """A model of single hops by its name, and its parameters under that name."""

    hop: Literal["radio", "disk", "ideal_mac", "tdma"] = Field("radio", description=(
        "the model of single hops; its parameters stand under its name (Wi-Fi)"))
    radio: DcfRadio.Params | None = Field(None, description=(
        "of hop: radio (its own defaults, but broadcasts are as fast as unicast frames: who "
        "hears a routing message should get packets, too)"))
    disk: Disk.Params | None = Field(None, description="of hop: disk (its own defaults)")
    ideal_mac: IdealMac.Params | None = Field(None, description="of hop: ideal_mac (its own "
                                                                "defaults)")
    tdma: Tdma.Params | None = Field(None, description="of hop: tdma (its own defaults)")

    @model_validator(mode="before")
    @classmethod
    def _spelled_out(cls, given: object) -> object:
        """The chosen model's parameters, and no other's."""
        if not isinstance(given, dict):
            return given
        hop = given.get("hop", "radio")
        for name in HOPS:
            if name != hop and given.get(name) is not None:
                raise ValueError(f"{name} is given, but hop is {hop}: its parameters stand "
                                 f"under {hop}")
        return {hop: {}, **given} if hop in HOPS else given

    def chosen(self) -> Hop:
        """The model."""
        return HOPS[self.hop](as_fast(getattr(self, self.hop)))


def as_fast(params: P) -> P:
    """A radio's parameters with its broadcasts at the rate of unicast frames, if they have none."""
    if not isinstance(params, DcfRadio.Params) or params.broadcast_rate_bps is not None:
        return params
    return params.model_copy(update={"broadcast_rate_bps": params.rate_bps})
