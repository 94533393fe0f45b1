"""802.11a and g: saturated stations that all hear each other equally well, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from netmodels.cases.saturation import Saturation
from netmodels.validation.within import within

# By standard, rate in Mb/s and slot: stations to Mb/s of payload (1000 B of UDP, one sink) and
# failed transmissions to all of them.
TABLE = {
    ("11a", 6, None): {1: (4.984, .0000), 2: (4.770, .1119), 5: (4.405, .2587), 10: (4.089, .3647),
                       30: (3.522, .5217)},
    ("11a", 24, None): {1: (15.345, .0000), 2: (15.220, .1108), 5: (14.461, .2580),
                        10: (13.565, .3651), 30: (11.875, .5219)},
    ("11g", 54, None): {1: (18.618, .0000), 2: (20.242, .1135), 5: (20.723, .2583),
                        10: (20.011, .3665), 30: (18.116, .5186)},
    ("11g", 54, "9 us"): {1: (24.583, .0000), 2: (25.219, .1109), 5: (24.685, .2565),
                          10: (23.479, .3657), 30: (20.928, .5198)},
}


class SaturationOfOfdm:
    """802.11a and g saturated, as in ns-3: goodput within 1.5 %, failures within 0.015."""

    source = "ns-3.44, AdhocWifiMac, every pair at -50 dBm"

    def checks(self, play: Play) -> Iterator[Check]:
        for (standard, mbps, slot), rows in TABLE.items():
            for stations, (goodput_mbps, failure_rate) in rows.items():
                found = play(Saturation(Saturation.Params(
                    standard=standard, rate=f"{mbps} Mb/s", stations=stations, slot=slot)).setup())
                slots = f"slot {slot}, " if slot else ""
                what = f"{standard}, {mbps} Mb/s, {slots}{stations} stations"
                yield within(0.015, f"{what}: goodput", found["goodput_mbps"], goodput_mbps, "Mb/s")
                yield Check(f"{what}: failures", found["failure_rate"], failure_rate, 0.015)
