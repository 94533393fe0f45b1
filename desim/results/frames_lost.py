"""The frames between two hosts that were lost while a message between them was under way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import groupby

import numpy as np
import pyarrow as pa

from desim.network.passages import FrameLoss

_INT = pa.int64()


def frames_lost(rows: np.ndarray, losses: Sequence[FrameLoss], place: Callable[[int, int], str]
                ) -> list[pa.Array]:
    """Columns of a ledger with these ``rows``: how many frames between the two hosts were lost from
    the message's birth to its fate, in either direction, for the most frequent reason; the reason;
    the first and the last of these losses (ns); the ``place(medium, host)`` (numbers as in
    ``Stamp``) of most of them; and how many were lost with people between. Null where none was."""
    between = {pair: list(found)
               for pair, found in groupby(sorted(losses, key=_pair), key=_pair)}
    times = {pair: np.array([loss.time_ns for loss in found]) for pair, found in between.items()}
    columns: list[list[int | str | None]] = [[], [], [], [], [], []]
    for source, destination, born_ns, end_ns in zip(
            *(rows[name].tolist() for name in ("source", "destination", "born_ns", "end_ns")),
            strict=True):
        pair = min(source, destination), max(source, destination)
        first, behind = (np.searchsorted(times[pair], (born_ns, end_ns + 1)).tolist()
                         if pair in times else (0, 0))
        for column, value in zip(columns, _summed(between.get(pair, [])[first:behind], place),
                                 strict=True):
            column.append(value)
    words = pa.dictionary(pa.int32(), pa.string())
    return [pa.array(column, type_) for column, type_ in
            zip(columns, (_INT, words, _INT, _INT, words, _INT), strict=True)]


def _pair(loss: FrameLoss) -> tuple[int, int]:
    return min(loss.source, loss.receiver), max(loss.source, loss.receiver)


def _summed(losses: Sequence[FrameLoss], place: Callable[[int, int], str]
            ) -> tuple[int | str | None, ...]:
    if not losses:
        return (None,) * 6
    (reason, count), = Counter(loss.reason for loss in losses).most_common(1)
    alike = [loss for loss in losses if loss.reason == reason]
    (most, _), = Counter((loss.medium, loss.host) for loss in alike).most_common(1)
    return count, reason, alike[0].time_ns, alike[-1].time_ns, place(*most), \
        sum(loss.people > 0 for loss in alike)
