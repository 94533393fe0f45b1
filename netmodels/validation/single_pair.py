"""One sender and one receiver: how far each rate gets."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.packets import UDP_IP_BYTES
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.dcf.radio import DcfRadio

# Rate in Mb/s: m from sender to receiver to the share of transmissions that fail, in one run of 2 s
# of ns-3 each (887 to 6106 of them). Beyond 51.46 m nothing is found.
FAILURES = {6: {51: 0.0, 52: 1.0},
            24: {40: 0.00026, 45: 0.03938, 48: 0.45568, 50: 0.95842},
            54: {21: 0.00359, 22: 0.02113, 23: 0.12245, 24: 0.48159, 25: 0.95476}}

_PAYLOAD_BYTES = 1000
_DURATION_NS = 10 * NS_PER_S


class SinglePair:
    """A saturated pair by its distance, as in ns-3: the share of transmissions that fail within
    0.03, three standard errors of ns-3's 2956 transmissions at 48 m. (Ours is the lower one at
    nearly all of them, by 0.018 there.)"""

    source = "ns-3.44, 802.11a, log-distance, NIST error model, one run each"

    def checks(self, play: Play) -> Iterator[Check]:
        for mbps, rows in FAILURES.items():
            for apart_m, share in rows.items():
                yield Check(f"one pair, {mbps} Mb/s, {apart_m} m: failures",
                            play(_setup(mbps, apart_m))["failure_rate"], share, 0.03)


def _setup(mbps: float, apart_m: float) -> Setup:
    radio = DcfRadio(DcfRadio.Params(preset="ns3_3_44", standard="11a", rate=f"{mbps} Mb/s"))
    flow = Flow("sender", ("receiver",), _PAYLOAD_BYTES + UDP_IP_BYTES + ETHERNET_BYTES,
                _PAYLOAD_BYTES)
    return Setup(radio, {"sender": (0.0, 0.0), "receiver": (apart_m, 0.0)}, [flow], _DURATION_NS)
