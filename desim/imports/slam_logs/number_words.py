"""Words of a line as numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from desim.errors import InputError, printable


def finite(words: Sequence[str], where: str, kind: str) -> list[float]:
    """Convert ``words`` to finite numbers. Raises ``InputError`` for another word, with the place
    (file:line) and the ``kind`` of the line."""
    found = []
    for word in words:
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f"{where}: {kind} has {printable(word)!r} where a number is wanted")
        found.append(value)
    return found
