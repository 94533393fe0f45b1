"""802.11b: saturated stations against Bianchi's model as ns-3 evaluates it."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from netmodels.cases.saturation import Saturation
from netmodels.validation.within import within

# Mb/s of payload, 1500 B, by rate in Mb/s and stations.
TABLE = {
    11: {5: 6.4734, 10: 6.1774, 20: 5.7819, 30: 5.5289, 50: 5.1745},
    5.5: {5: 3.8896, 10: 3.6707, 30: 3.2429, 50: 3.0184},
    2: {5: 1.6228, 10: 1.5168, 30: 1.3253, 50: 1.2279},
    1: {5: .8437, 10: .7861, 30: .6847, 50: .6336},
}


class SaturationOf11b:
    """802.11b saturated, as in Bianchi's model: goodput within 2 %. Its figures are those of
    acknowledgements at 2 Mb/s (1 Mb/s at 1 Mb/s): by the formula 6.521 Mb/s for 5 stations at 11
    Mb/s, and 6.328 or 6.687 with acknowledgements at 1 or 11 Mb/s."""

    source = "ns-3, src/wifi/examples/reference/bianchi_11b_difs.txt"

    def checks(self, play: Play) -> Iterator[Check]:
        for mbps, rows in TABLE.items():
            for stations, goodput_mbps in rows.items():
                found = play(Saturation(Saturation.Params(
                    standard="11b", rate=f"{mbps} Mb/s", stations=stations,
                    payload="1500 B", basic_rates=["1 Mb/s", "2 Mb/s"])).setup())
                yield within(0.02, f"11b, {mbps} Mb/s, {stations} stations: goodput",
                             found["goodput_mbps"], goodput_mbps, "Mb/s")
