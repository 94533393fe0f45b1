"""Random access without listening, against the formulas of its inventors."""

from __future__ import annotations

import math
from collections.abc import Iterator

from desim.ports.cases import NOWHERE, Check, Play, Setup
from desim.units import NS_PER_S
from netmodels.aloha import Aloha
from netmodels.cases.senders import flows, numbered
from netmodels.validation.within import within

LOADS = (0.25, 0.5, 1.0)  # frames that begin in the time of one
RATE = "24 kb/s"

_RATE_BPS = 24_000
_BYTES = 90  # 30 ms
_STATIONS = 20
_FRAMES = 100_000


class RandomAccess:
    """ALOHA with and without slots: throughput within 2 % (chance makes less than 1 %)."""

    source = "Abramson 1970: G exp(-2 G); Roberts 1975: G exp(-G)"

    def checks(self, play: Play) -> Iterator[Check]:
        frame_ns = _BYTES * 8 * NS_PER_S // _RATE_BPS
        for slot, vulnerable in (None, 2), (f"{frame_ns} ns", 1):
            for load in LOADS:
                found = play(_setup(slot, frame_ns, load))
                yield within(0.02, f"aloha, {'slots, ' if slot else ''}G = {load}: throughput",
                             1e6 * found["throughput_mbps"] / _RATE_BPS,
                             load * math.exp(-vulnerable * load))


def _setup(slot: str | None, frame_ns: int, load: float) -> Setup:
    senders = numbered("station", _STATIONS)
    model = Aloha(Aloha.Params(rate=RATE, slot=slot))
    return Setup(model, dict.fromkeys((*senders, "sink"), NOWHERE),
                 flows(senders, "sink", _BYTES, _BYTES, "poisson", _STATIONS * frame_ns / load),
                 round(_FRAMES * frame_ns / load))
