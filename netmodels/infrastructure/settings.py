"""The parameters of a network of access points, beside those of its radios."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from desim import ports
from desim.units import Period
from netmodels.infrastructure.fq_codel import FqCodelConstants
from netmodels.infrastructure.joining import JoiningConstants, Security
from netmodels.infrastructure.roaming import Roaming
from netmodels.switch import Switch


class Settings(ports.Params):
    """The network of access points: the wires behind them, how stations get to them and change
    between them."""

    wired: tuple[str, ...] = Field((), description=(
        "hosts with a cable instead of a radio, beside the access points: names or patterns "
        "(none)"))
    wires: Switch.Params = Field(Switch.Params(), description=(
        "between access points and wired hosts (a switch with its own defaults)"))
    queue: Literal["fq_codel", "fifo"] = Field("fq_codel", description=(
        "in front of the radio of each access point and station: by receiver flows in turn, which "
        "lose what waits too long, or all in order, up to the radio's queue (Linux)"))
    fq_codel: FqCodelConstants = Field(FqCodelConstants(), description=(
        "of queue: fq_codel (Linux)"))
    multicast: Literal["flood", "snooping", "unicast"] = Field("flood", description=(
        "of broadcasts: each access point with stations sends them, or only one with receivers, as "
        "with IGMP snooping, or that sends one unicast frame to each receiver (hostapd: "
        "multicast_to_unicast is off)"))
    querier: bool = Field(True, description=(
        "with multicast: snooping, whether somebody asks for memberships; without, they end "
        "(false in Linux's bridge: multicast_querier; true: routers ask)"))
    membership_ns: Period = Field("260 s", description=(
        "after which a host's memberships end where nobody asks for them (Linux's bridge: "
        "multicast_membership_interval; RFC 3376, 8.4)"))
    security: Security = Field("wpa2", description=(
        "of joining: with the 4-way handshake of a shared key, or open (what networks have)"))
    fast_transition: bool = Field(False, description=(
        "802.11r: a station that changes brings its keys along (hostapd: off)"))
    power_save: bool = Field(False, description=(
        "whether stations sleep, so that frames for them wait for a beacon (off; NetworkManager of "
        "Ubuntu turns it on)"))
    associated: bool = Field(True, description=(
        "whether stations hang on the access point that they hear best when a run begins (as those "
        "that were switched on before)"))
    roaming: Roaming = Field(Roaming(), description="when a station looks for another access point "
                                                    "(NetworkManager with wpa_supplicant)")
    constants: JoiningConstants = Field(JoiningConstants(), description=(
        "of beacons, scans and joining (Linux)"))

    def unused(self) -> Iterator[ports.UnusedKeys]:
        """Keys without effect because of the values of others."""
        if self.queue == "fifo":
            yield ports.UnusedKeys(ports.changed_keys(self, "fq_codel"), "queue is fifo")
        if self.multicast != "snooping":
            yield ports.UnusedKeys(ports.changed_keys(self, "querier"),
                                   "memberships count only with multicast: snooping")
        if self.multicast != "snooping" or self.querier:
            yield ports.UnusedKeys(ports.changed_keys(self, "membership_ns"),
                                   "memberships end only with multicast: snooping and without a "
                                   "querier")
