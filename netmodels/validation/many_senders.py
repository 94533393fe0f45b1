"""Many radios in places, relays and mixes of flows, and how long packets take: against ns-3."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from desim.ports.cases import Check, Play
from netmodels.cases.layout import Layout
from netmodels.validation.layouts import CHAINS, MIXES, PAIRS, STARS, parsed
from netmodels.validation.tolerance import within


def played(play: Play, mbps: float, places: list[tuple[float, float]],
           flows: list[dict[str, object]], **more: object) -> Mapping[str, float]:
    """A layout of 802.11a as ns-3 has it; flows that name nothing else are of 1000 B."""
    return play(Layout(Layout.Params(standard="11a", preset="ns3_3_44", rate=f"{mbps} Mb/s",
                                     places=places, flows=flows, **more)).setup())


class ManyPairs:
    """Saturated pairs over an area, some of which hear each other: goodput within 3 %, or ns-3's
    own 95 % interval over five seeds where that is wider, failures within 0.02."""

    source = "ns-3.44, 802.11a, log-distance, NIST error model, five seeds"

    def checks(self, play: Play) -> Iterator[Check]:
        for name, mbps, rts, text, goodput_mbps, interval_mbps, failures in PAIRS:
            places = parsed(text)
            found = played(play, mbps, places, [
                {"from": k, "to": k + 1} for k in range(0, len(places), 2)], rts=rts)
            what = f"pairs, {name}, {mbps} Mb/s"
            yield Check(f"{what}: goodput", found["goodput_mbps"], goodput_mbps,
                        max(0.03 * goodput_mbps, interval_mbps), "Mb/s")
            yield Check(f"{what}: failures", found["failure_rate"], failures, 0.02)


class RelayedFlows:
    """A saturated flow over several hops in a row, two packets for each of them on the way: goodput
    within 1 %, failures within 0.02."""

    source = "ns-3.44, 802.11a, log-distance, NIST error model, five seeds"

    def checks(self, play: Play) -> Iterator[Check]:
        for (hops, apart_m, mbps), (goodput_mbps, failures) in CHAINS.items():
            found = played(play, mbps, [(k * apart_m, 0.0) for k in range(hops + 1)],
                           [{"from": 0, "via": list(range(1, hops + 1))}], duration="20 s")
            what = f"chain, {hops} hops of {apart_m} m, {mbps} Mb/s"
            yield within(0.01, f"{what}: goodput", found["goodput_mbps"], goodput_mbps, "Mb/s")
            yield Check(f"{what}: failures", found["failure_rate"], failures, 0.02)


class Mixes:
    """Unicast packets and broadcasts at random times over an area: the share of all copies that
    arrives, within 0.015."""

    source = "ns-3.44, 802.11a, log-distance, NIST error model, five seeds"

    def checks(self, play: Play) -> Iterator[Check]:
        for name, mbps, period, places, receivers, delivered, _ in MIXES:
            found = played(play, mbps, parsed(places), [
                *({"from": k, "to": to, "arrivals": "poisson", "period": period}
                  for k, to in enumerate(receivers)),
                *({"from": k, "broadcast": True, "payload": "200 B", "arrivals": "poisson",
                   "period": "100 ms"} for k in range(len(receivers)))])
            yield Check(f"mix, {name}, {mbps} Mb/s: delivered", found["delivery_ratio"],
                        delivered, 0.015)


class DelaysOfRadio:
    """Delays from a sender's queue to a receiver, on an idle medium and under load: the mean and
    the 95 % quantile, within 3 %, or ns-3's own 95 % interval over five seeds where
    that is wider."""

    source = "ns-3.44, 802.11a, senders 10 m from one receiver, Poisson, five seeds"

    def checks(self, play: Play) -> Iterator[Check]:
        for mbps, senders, period, mean_ms, interval_ms, p95_ms, interval_95_ms in STARS:
            around = [_on_a_circle(k, senders) for k in range(senders)]
            found = played(play, mbps, [(0.0, 0.0), *around], [
                {"from": k + 1, "to": 0, "arrivals": "poisson", "period": period}
                for k in range(senders)], duration="40 s")
            what = f"{senders} to one, {mbps} Mb/s, one each {period}"
            for name, key, published, interval in (("mean delay", "mean", mean_ms, interval_ms),
                                                   ("95 % within", "p95", p95_ms, interval_95_ms)):
                yield Check(f"{what}: {name}", found[f"delay_{key}_ms"], published,
                            max(0.03 * published, interval), "ms")


def _on_a_circle(k: int, senders: int) -> tuple[float, float]:
    turn_rad = 2 * math.pi * k / senders
    return 10 * math.cos(turn_rad), 10 * math.sin(turn_rad)
