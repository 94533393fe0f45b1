"""The time for which a host of a message hung on no access point while that was under way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from desim.network.passages import KnownMedium

_TYPES = (pa.dictionary(pa.int32(), pa.string()),) * 2 + (pa.int64(),) * 2


class _Gap(NamedTuple):
    """A host's time without an access point, until it hung on one, on medium ``number``."""

    number: int
    host: str
    access_point: str
    from_ns: int
    until_ns: int

    def during(self, born_ns: int, end_ns: int) -> _Gap:
        """The part of it from a message's birth to its fate; of no length where there is none."""
        from_ns = max(self.from_ns, born_ns)
        return self._replace(from_ns=from_ns, until_ns=max(min(self.until_ns, end_ns), from_ns))


def association_waits(rows: np.ndarray, media: Sequence[KnownMedium], stamps: np.ndarray,
                      counts: Sequence[int]) -> list[pa.Array]:
    """Columns of a ledger with these ``rows``, each with ``counts`` of ``stamps``: which of sender
    and receiver hung on no access point for the longest between the message's birth and its fate,
    on a medium that it took; the access point on which it hung then; and the first and the last of
    that time (ns). Null where there was no such time."""
    gaps: dict[int, list[_Gap]] = {}
    for number, medium in enumerate(media):
        for one in () if medium.associations is None else medium.associations.handovers:
            gaps.setdefault(one.host, []).append(_Gap(
                number, medium.places[one.host], one.access_point, one.time_ns - one.gap_ns,
                one.time_ns))
    waits: list[tuple[str | int | None, ...]] = []
    first = 0
    for row, count in zip(rows[["source", "destination", "born_ns", "end_ns", "medium"]].tolist(),
                          counts, strict=True):
        source, destination, born_ns, end_ns, lost_on = row
        own = [gap for host in (source, destination) for whole in gaps.get(host, ())
               if (gap := whole.during(born_ns, end_ns)).until_ns > gap.from_ns]
        if own and (count or lost_on >= 0):  # else it was lost above all media
            took = {lost_on, *stamps["medium"][first:first + count].tolist()}
            own = [gap for gap in own if gap.number in took]
        first += count
        longest = max(own, key=lambda gap: gap.until_ns - gap.from_ns, default=None)
        waits.append((None,) * 4 if longest is None else longest[1:])
    columns = zip(*waits, strict=True) if waits else ((),) * 4
    return [pa.array(column, type_) for column, type_ in zip(columns, _TYPES, strict=True)]
