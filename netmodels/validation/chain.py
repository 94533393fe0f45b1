"""What a chain of hops carries, against the bounds of who hinders whom."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from netmodels.cases.chain import Chain
from netmodels.validation.within import within

SHORT, LONG = (2, 3, 4, 6, 8, 12), (6, 8, 12, 16)  # hops


class Chains:
    """Chains whose hosts hinder others up to two hops away: without collisions 1 / hops of what one
    hop carries, and 1 / 4 from four hops on, within 0.5 %; with carrier sense between 1 / 8 and 1 /
    4 from six hops on; and that a protocol repairs its route when a host leaves, within 4 s."""

    source = "Li, Blake, De Couto, Lee, Morris 2001: 1 / 4 at best, about 1 / 7 under 802.11"

    def checks(self, play: Play) -> Iterator[Check]:
        for mac in "ideal", "tdma":
            for hops in SHORT:
                yield within(0.005, f"chain, {mac}, {hops} hops: share of one hop's goodput",
                             _played(play, hops, mac)["goodput_share"], 1 / min(hops, 4))
        for hops in LONG:
            yield Check(f"chain, dcf, {hops} hops: share of one hop's goodput",
                        _played(play, hops, "dcf")["goodput_share"], 3 / 16, 1 / 16)
        whole = _played(play, 4, "ideal", routing="batman")
        deserted = _played(play, 4, "ideal", routing="batman", leave="3 s")
        yield Check("chain, ideal, 4 hops, a host leaves: time without goodput",
                    whole["measured_s"] * (1 - deserted["goodput_mbps"] / whole["goodput_mbps"]),
                    2.0, 2.0, "s")


def _played(play: Play, hops: int, mac: str, **more: str) -> dict:
    return play(Chain(Chain.Params(hops=hops, mac=mac, **more)).setup())
