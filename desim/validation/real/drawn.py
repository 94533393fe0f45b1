"""New ground: networks that nobody measured, drawn by a seed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from desim.engine.streams import Streams
from desim.validation.real.judge import JudgedRow
from desim.validation.real.media import cut, lost, radio, wire
from desim.validation.real.tcp import TALKERS, LinkTalk, TcpRow, judged_row

_ROWS = 20
_LOSS = 0.0, 0.0, 0.005, 0.02, 0.05, 0.1
_SIZES_BYTES = 100, 1000, 5000, 20_000, 60_000
_FASTEST_BPS = 2e6  # of one talker, so that guests are done soon


def rows(seed: int) -> Iterator[JudgedRow]:
    """Twenty networks with one to three talkers each: wires and radios, loss, cuts."""
    draw = Streams(seed)("validation", "new ground")
    for number in range(_ROWS):
        yield judged_row(_row(draw, number), f"new{number}")


def _row(draw: np.random.Generator, number: int) -> TcpRow:
    size_bytes = int(draw.choice(_SIZES_BYTES))
    least_ms = max(8e3 * size_bytes / _FASTEST_BPS, 20.0)
    every_ms = int(least_ms * draw.uniform(1, 10))
    loss = float(draw.choice(_LOSS))
    cut_s = (10.0, round(10 + float(draw.uniform(1, 12)), 2)) if draw.random() < 0.3 else None
    pairs = int(draw.integers(1, 4))
    nodelay = bool(draw.random() < 0.5)
    rules = [*lost(loss), *(cut(*cut_s, TALKERS) if cut_s else ())]
    if draw.random() < 0.3:
        medium, where = radio(number, rules), "radio"
    else:
        rate_mbps, way_ms = float(draw.choice((5, 10, 50))), round(float(draw.uniform(0.1, 40)), 1)
        medium, where = wire(rate_mbps, way_ms, rules), f"{rate_mbps:g} Mb/s, {way_ms} ms"
    what = (f"{pairs} x {size_bytes} B every {every_ms} ms, {where}, {100 * loss:g} % lost"
            f"{', nodelay' * nodelay}{f', cut until {cut_s[1]} s' if cut_s else ''}")
    return TcpRow(LinkTalk(what, medium, size_bytes, every_ms, 30, nodelay, pairs), 1, cut_s)
