"""Radios in places: who shares the air, and who disturbs whom, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from netmodels.cases.two_senders import Hidden, TwoPairs
from netmodels.validation.tolerance import within

# Rate in Mb/s: m between the pairs to Mb/s of payload of both.
TWO_PAIRS = {
    6: {5: 4.752, 10: 5.408, 20: 5.404, 40: 5.404, 50: 5.404, 51: 5.404, 52: 9.961, 55: 9.961,
        70: 9.961, 400: 9.961},
    24: {5: 15.201, 10: 16.256, 20: 16.253, 30: 17.372, 40: 17.371, 50: 17.199, 51: 17.104,
         52: 30.665, 55: 30.665, 70: 30.665, 400: 30.665},
    54: {5: 25.155, 10: 27.037, 20: 27.035, 30: 27.032, 40: 27.031, 50: 26.743, 51: 26.340,
         52: 20.992, 55: 36.427, 70: 49.105, 400: 49.109},
}

# Rate in Mb/s, m from each sender to the receiver: Mb/s without and with RTS, saturated.
HIDDEN = {(6, 20): (4.763, 4.655), (6, 25.5): (4.763, 4.655), (6, 26): (1.583, 4.501),
          (6, 50): (1.583, 4.500), (24, 20): (15.208, 12.619), (24, 25.5): (15.207, 12.617),
          (24, 26): (10.641, 11.836), (24, 40): (10.568, 11.833)}

# m from each sender to the receiver: Mb/s that each offers at random times to Mb/s of both, 6 Mb/s.
HIDDEN_BY_LOAD = {20: {0.25: 0.496, 0.5: 0.979, 1: 1.992, 2: 3.987, 3: 4.783},
                  40: {0.25: 0.489, 0.5: 0.933, 1: 1.604, 2: 1.536, 3: 1.516}}


class TwoPairsOfNs3:
    """Two pairs of radios, as in ns-3: goodput within 2 %, and within 10 % from 50 to 56 m, where
    carrier sense ends."""

    source = "ns-3.44, 802.11a, log-distance, NIST error model, pairs 10 m long"

    def checks(self, play: Play) -> Iterator[Check]:
        for mbps, rows in TWO_PAIRS.items():
            for apart_m, goodput_mbps in rows.items():
                found = play(TwoPairs(TwoPairs.Params(
                    rate=f"{mbps} Mb/s", distance=f"{apart_m} m", duration="5 s")).setup())
                yield within(0.1 if 50 <= apart_m <= 56 else 0.02,
                             f"two pairs, {mbps} Mb/s, {apart_m} m apart",
                             found["goodput_mbps"], goodput_mbps, "Mb/s")


class HiddenTerminals:
    """Hidden terminals with and without RTS, as in ns-3: goodput within 10 %."""

    source = "ns-3.44, 802.11a, log-distance, NIST error model"

    def checks(self, play: Play) -> Iterator[Check]:
        for (mbps, spacing_m), goodputs_mbps in HIDDEN.items():
            for rts, goodput_mbps in zip((False, True), goodputs_mbps, strict=True):
                found = play(Hidden(Hidden.Params(rate=f"{mbps} Mb/s", spacing=f"{spacing_m} m",
                                                  rts=rts, duration="10 s")).setup())
                yield within(0.1, f"hidden, {mbps} Mb/s, {spacing_m} m{', RTS' if rts else ''}",
                             found["goodput_mbps"], goodput_mbps, "Mb/s")
        for spacing_m, rows in HIDDEN_BY_LOAD.items():
            for load_mbps, goodput_mbps in rows.items():
                found = play(Hidden(Hidden.Params(spacing=f"{spacing_m} m",
                                                  load=f"{load_mbps} Mb/s")).setup())
                yield within(0.1, f"hidden, 6 Mb/s, {spacing_m} m, {load_mbps} Mb/s each",
                             found["goodput_mbps"], goodput_mbps, "Mb/s")
