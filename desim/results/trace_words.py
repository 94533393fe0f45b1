"""Trace rows in words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from desim.engine.trace import real
from desim.units import NS_PER_S

# Columns that hold the bits of a float.
REALS = {"pose": "abc", "sample": "abc", "sample_motion": "c",
         **dict.fromkeys(("goal", "goal_reached", "goal_aborted"), "ab")}
_SMALLEST_ID = 1 << 16  # below it a value is a number, although it might be the id of a name


def text(row: np.void, names: Mapping[int, str]) -> str:
    """A row in words: time, kind, entity, values."""
    kind = names.get(int(row["kind"]), "?")
    return (f"{int(row['t_ns']) / NS_PER_S:14.9f} s  {kind:<16} "
            f"{names.get(int(row['entity']), '?'):<20} {values(row, kind, names)}").rstrip()


def values(row: np.void | Mapping[str, int], kind: str, names: Mapping[int, str]) -> str:
    """The columns a, b and c: ids as names, bits of floats as floats."""
    reals, texts = REALS.get(kind, ""), []
    for column in "abc":
        value = int(row[column])
        if column in reals:
            texts.append(f"{real(value):.9g}")
        else:
            texts.append(names.get(value, str(value)) if value >= _SMALLEST_ID else str(value))
    return "  ".join(texts)
