"""Goodput of a chain of hops, against the bounds by interference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from desim.ports.cases import Check, Play
from netmodels.cases.chain import RelayChain
from netmodels.multihop.batman import HEADER_BYTES, BatmanConstants
from netmodels.validation.tolerance import within

SHORT, LONG = (2, 3, 4, 6, 8, 12), (6, 8)  # hops
SEEDS = (1, 2, 3)
MESSAGE_BYTES = BatmanConstants().message_bytes


class Chains:
    """Chains whose hosts hinder others up to two hops away: without collisions 1 / hops of what one
    hop carries, and 1 / 4 from four hops on, within 0.5 %; with carrier sense between 1 / 8 and 1 /
    4 at six and eight. When a host leaves, a protocol repairs its route after one to five of its
    messages' intervals (the memory of a way is five messages), and its messages are on the air:
    each host's, passed on by each other one at most."""

    source = ("Li, Blake, De Couto, Lee, Morris 2001: 1 / 4 at best, about 1 / 7 under 802.11; "
              "from 1 / 8 to 1 / 4 and the repair are properties, not publications")

    def checks(self, play: Play) -> Iterator[Check]:
        for mac in "ideal", "tdma":
            for hops in SHORT:
                yield within(0.005, f"chain, {mac}, {hops} hops: share of one hop's goodput",
                             _played(play, hops, mac)["goodput_share"], 1 / min(hops, 4))
        for hops in LONG:
            yield Check(f"chain, dcf, {hops} hops: share of one hop's goodput",
                        _played(play, hops, "dcf")["goodput_share"], 3 / 16, 1 / 16)
        for mac in "ideal", "tdma":
            for seed in SEEDS:
                yield from repaired(play, mac, seed)


def repaired(play: Play, mac: str, seed: int) -> Iterator[Check]:
    """Messages come every second, 0.98 to 1.02 s; the spare host's, too: there are six hosts."""
    whole, deserted = (_played(play, 4, mac, seed, routing="batman", **leave)
                       for leave in ({}, {"leave": "3 s"}))
    what = f"chain, {mac}, 4 hops, a host leaves, seed {seed}"
    yield Check(f"{what}: time without goodput",
                whole["measured_s"] * (1 - deserted["goodput_mbps"] / whole["goodput_mbps"]),
                3.0, 2.0, "s")
    frames = deserted["control_frames"]
    messages = (deserted["control_bytes"] - HEADER_BYTES * frames) / MESSAGE_BYTES
    yield Check(f"{what}: messages", messages / deserted["measured_s"],
                (36 / 0.98 + 6 / 1.02) / 2, (36 / 0.98 - 6 / 1.02) / 2, "1/s")


def _played(play: Play, hops: int, mac: str, seed: int = 1, **more: str) -> Mapping[str, float]:
    return play(RelayChain(RelayChain.Params(hops=hops, mac=mac, **more)).setup(), seed)
