"""Saturated stations of 802.11n, ac and ax, with and without aggregates, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.saturation import Saturation
from netmodels.cases.traffic import SAME_POWER, numbered, udp_bytes
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.validation.tolerance import within

_BACKLOG = 1000

# Stations that all hear each other equally well, by standard, MCS, MHz and whether packets are
# aggregated: stations to Mb/s of payload (1000 B of UDP, one sink; one stream, guard intervals of
# 800 ns) and the share of data and of requests for block acknowledgements that got no reply. Means
# of four runs of 20 s, 30 stations at 80 MHz of 10 s, without aggregates of 3 to 5 s; block
# acknowledgements were agreed on before.
SATURATION_OF_MCS = {
    ("11n", 0, 20, True): {1: (5.807, .0000), 2: (5.431, .1132), 5: (4.758, .2657),
                               10: (4.130, .3790), 30: (3.135, .5291)},
    ("11n", 4, 20, True): {1: (35.074, .0000), 2: (32.900, .1109), 5: (28.831, .2644),
                               10: (25.043, .3792), 30: (18.949, .5366)},
    ("11n", 7, 20, True): {1: (58.507, .0000), 2: (54.742, .1137), 5: (48.092, .2642),
                               10: (41.525, .3807), 30: (31.488, .5309)},
    ("11n", 0, 20, False): {1: (5.256, .0000), 2: (5.044, .1133), 5: (4.654, .2634),
                               10: (4.299, .3732), 30: (3.688, .5343)},
    ("11n", 4, 20, False): {1: (19.501, .0000), 2: (19.830, .1116), 5: (19.124, .2661),
                               10: (18.083, .3727), 30: (15.830, .5355)},
    ("11n", 7, 20, False): {1: (24.811, .0000), 2: (25.850, .1106), 5: (25.380, .2670),
                               10: (24.199, .3766), 30: (21.434, .5367)},
    ("11ac", 0, 20, True): {1: (5.807, .0000), 5: (4.742, .2684), 30: (3.154, .5379)},
    ("11ac", 4, 20, True): {1: (35.074, .0000), 5: (28.646, .2704), 30: (19.234, .5374)},
    ("11ac", 8, 20, True): {1: (70.223, .0000), 5: (57.112, .2722), 30: (38.745, .5350)},
    ("11ax", 0, 20, True): {1: (7.603, .0000), 5: (6.213, .2667), 30: (4.069, .5426)},
    ("11ax", 4, 20, True): {1: (46.312, .0000), 5: (37.761, .2709), 30: (25.233, .5375)},
    ("11ax", 7, 20, True): {1: (77.200, .0000), 5: (62.788, .2720), 30: (42.505, .5347)},
    ("11ax", 11, 20, True): {1: (126.147, .0000), 5: (103.401, .2671), 30: (69.904, .5342)},
    ("11ax", 0, 80, True): {1: (31.885, .0000), 5: (25.910, .2705)},
    ("11ax", 4, 80, True): {1: (185.492, .0000)},
    ("11ax", 7, 80, True): {1: (293.022, .0000)},
    ("11ax", 11, 80, True): {1: (445.873, .0000)},
}

# The same with several packets as one (``BE_MaxAmsduSize``), by standard, MCS, MHz, bytes of an
# A-MSDU and of a packet's payload. Means of two runs of 5 to 10 s, of five stations of six.
AMSDUS = {
    ("11n", 4, 20, 3839, 200): {1: (29.617, .0000), 5: (24.231, .2690)},
    ("11ac", 4, 80, 7935, 1000): {1: (155.838, .0000), 5: (128.257, .2623)},
    ("11ax", 7, 20, 3839, 1000): {1: (77.872, .0000), 5: (62.221, .2836)},
    ("11ax", 7, 80, 3839, 1000): {1: (295.415, .0000), 5: (243.509, .2661)},
    ("11n", 7, 20, 3839, 1000): {1: (58.966, .0000), 5: (48.411, .2651)},
}


class SaturationOfMcs:
    """802.11n, ac and ax saturated, as in ns-3, with A-MSDUs and blocks of 256, too: goodput within
    3 %, failures within 0.02."""

    source = "ns-3.44, AdhocWifiMac with QoS, best effort, every pair at -50 dBm"

    def checks(self, play: Play) -> Iterator[Check]:
        for (standard, mcs, mhz, aggregation), rows in SATURATION_OF_MCS.items():
            for stations, (goodput_mbps, failure_rate) in rows.items():
                found = play(Saturation(Saturation.Params(
                    standard=standard, mcs=mcs, width=f"{mhz} MHz", stations=stations,
                    aggregation=aggregation, duration=_duration(stations, aggregation))).setup())
                alone = "" if aggregation else "no aggregates, "
                what = f"{standard}, MCS {mcs}, {mhz} MHz, {alone}{stations} stations"
                yield within(0.03, f"{what}: goodput", found["goodput_mbps"], goodput_mbps, "Mb/s")
                yield Check(f"{what}: failures", found["failure_rate"], failure_rate, 0.02)
        yield from AmsdusOfNs3().checks(play)
        yield from BlocksOf256().checks(play)


def _duration(stations: int, aggregation: bool) -> str:
    """As long as ns-3's four runs together where one run of 20 s scatters by 2 %."""
    if not aggregation:
        return "5 s"
    return "80 s" if stations == 30 else "20 s"


class AmsdusOfNs3:
    """A-MSDUs in aggregates, as in ns-3: goodput within 3 %, failures within 0.02."""

    source = SaturationOfMcs.source

    def checks(self, play: Play) -> Iterator[Check]:
        for (standard, mcs, mhz, amsdu_bytes, payload_bytes), rows in AMSDUS.items():
            for stations, (goodput_mbps, failure_rate) in rows.items():
                found = play(Saturation(Saturation.Params(
                    standard=standard, mcs=mcs, width=f"{mhz} MHz", stations=stations,
                    amsdu=f"{amsdu_bytes} B", payload=f"{payload_bytes} B", duration="10 s",
                )).setup())
                what = (f"{standard}, MCS {mcs}, {mhz} MHz, A-MSDUs of {amsdu_bytes} B, "
                        f"{payload_bytes} B, {stations} stations")
                yield within(0.03, f"{what}: goodput", found["goodput_mbps"], goodput_mbps, "Mb/s")
                yield Check(f"{what}: failures", found["failure_rate"], failure_rate, 0.02)


# 802.11ax at MCS 7 with up to 256 packets in an aggregate, by MHz, bytes of a packet's payload and
# of an aggregate. Means of two runs of 5 s, of five stations of six of 5 to 10 s.
BLOCKS_OF_256 = {
    (20, 200, 65535): {1: (60.886, .0000), 5: (49.404, .2738)},
    (80, 1000, 1_000_000): {1: (322.861, .0000), 5: (261.956, .2738)},
}


class BlocksOf256:
    """Block acknowledgements of 256 packets, as in ns-3: goodput within 3 %, failures within 0.02.
    """

    source = SaturationOfMcs.source

    def checks(self, play: Play) -> Iterator[Check]:
        for (mhz, payload_bytes, most_bytes), rows in BLOCKS_OF_256.items():
            for stations, (goodput_mbps, failure_rate) in rows.items():
                found = play(_of_11ax(stations, mhz, payload_bytes, most_bytes))
                what = f"11ax, {mhz} MHz, {payload_bytes} B, {most_bytes} B, {stations} stations"
                yield within(0.03, f"{what}: goodput", found["goodput_mbps"], goodput_mbps, "Mb/s")
                yield Check(f"{what}: failures", found["failure_rate"], failure_rate, 0.02)


def _of_11ax(stations: int, mhz: int, payload_bytes: int, most_bytes: int) -> Setup:
    radio = DcfRadio(DcfRadio.Params(
        preset="ns3_3_44", standard="11ax", channel=36, mcs=7, width=f"{mhz} MHz", queue=_BACKLOG,
        path_loss=SAME_POWER, constants={"aggregate": f"{most_bytes} B"}))
    senders = numbered("sender", stations)
    return Setup(radio, dict.fromkeys((*senders, "sink"), NOWHERE), [
        Flow(sender, ("sink",), udp_bytes(payload_bytes), payload_bytes, backlog=_BACKLOG)
        for sender in senders], 8 * NS_PER_S, NS_PER_S)
