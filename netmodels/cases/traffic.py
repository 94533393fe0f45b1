"""What cases have in common: packets and their sizes, equal flows, stations of 802.11."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.ports.cases import Arrivals, Flow
from desim.units import ByteSize
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import MOST_BYTES

UDP_IP_BYTES = 8 + 20  # headers (RFC 768, RFC 791)
PPP_BYTES = 2  # header, as in ns-3's point-to-point links

# Payload in one packet of 802.11, and of UDP in that; 65535 B of IP, without the headers.
MOST_80211_BYTES = MOST_BYTES - ETHERNET_BYTES
MOST_RADIO_BYTES = MOST_80211_BYTES - UDP_IP_BYTES
MOST_UDP_BYTES = 65_535 - UDP_IP_BYTES

# A path loss at which all stations hear each other equally well, with -50 dBm, wherever they are.
SAME_POWER = {"model": "fixed", "total": "66.0206 dB"}


class StationParams(ports.Params):
    """The parameters of cases in which stations of 802.11 send packets of UDP."""

    standard: Literal["11a", "11b", "11g"] = Field("11a", description="timing and rates (ns-3 "
                                                                      "reference)")
    payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_RADIO_BYTES, description=(
        "of UDP (ns-3 reference)"))
    preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
        "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))

    @property
    def size_bytes(self) -> int:
        """The size of a packet with its headers."""
        return self.payload_bytes + UDP_IP_BYTES + ETHERNET_BYTES

    def radio(self, **params: object) -> DcfRadio:
        """A radio with these parameters and ``params``."""
        return DcfRadio(DcfRadio.Params(preset=self.preset, standard=self.standard, **params))


def numbered(name: str, count: int) -> tuple[str, ...]:
    """``sender_1``, ``sender_2``, ..."""
    return tuple(f"{name}_{number}" for number in range(1, count + 1))


def flows(sources: tuple[str, ...], receiver: str, size_bytes: int, payload_bytes: int,
          arrivals: Arrivals, every_ns: float = 0, backlog: int = 0) -> list[Flow]:
    """Equal flows, one from each of ``sources``."""
    return [Flow(source, (receiver,), size_bytes, payload_bytes, arrivals, round(every_ns), backlog)
            for source in sources]
