"""The sections of the judge, by the names of the real programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from desim.validation.real import drawn, ros1, tcp
from desim.validation.real.judge import JudgedRow, Need


class JudgedSection(NamedTuple):
    """The needs of the real side, and the rows; ``rows(seed)`` may draw them."""

    needs: Sequence[Need]
    rows: Callable[[int], Iterable[JudgedRow]]


SECTIONS = {
    "tcp": JudgedSection((), lambda seed: tcp.rows()),
    "new": JudgedSection((), drawn.rows),
    "ros1": JudgedSection(ros1.NEEDS, lambda seed: ros1.rows()),
}
