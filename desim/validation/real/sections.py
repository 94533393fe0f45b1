"""The sections of the judge, by the names of the real programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from desim.validation.real import dds, drawn, multimaster, ros1, tcp, zenoh
from desim.validation.real.judge import JudgedRow, Need


class JudgedSection(NamedTuple):
    """The needs of the real side, and the rows; ``rows(seed)`` may draw them."""

    needs: Callable[[], Sequence[Need]]
    rows: Callable[[int], Iterable[JudgedRow]]


SECTIONS = {
    "tcp": JudgedSection(lambda: (), lambda seed: tcp.rows()),
    "new": JudgedSection(lambda: (), drawn.rows),
    "ros1": JudgedSection(lambda: ros1.NEEDS, lambda seed: ros1.rows()),
    "cyclonedds": JudgedSection(lambda: dds.CYCLONE_NEEDS, lambda seed: dds.cyclone()),
    "fastdds": JudgedSection(dds.fast_needs, lambda seed: dds.fast()),
    "fastdds_crowded": JudgedSection(dds.fast_needs,
                                     lambda seed: dds.fast(dds.CROWDED_ROWS, "crowd")),
    "zenoh": JudgedSection(lambda: zenoh.NEEDS, lambda seed: zenoh.rows()),
    "multimaster": JudgedSection(lambda: multimaster.NEEDS, lambda seed: multimaster.rows()),
}
