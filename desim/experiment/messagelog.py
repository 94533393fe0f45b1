"""Every message between hosts at the moment its fate is known, in batches for a table."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from typing import Any

import numpy as np

BATCH = 1 << 14
COLUMNS = ("number", "topic", "source", "destination", "size_bytes", "born_ns", "first_ns",
           "last_ns", "reason", "end_ns")
DELIVERED = "delivered"  # reason number 0


class MessageLog:
    """Its ``fate`` is a graph's ``on_fate``. ``sink(rows, reasons)`` gets every full batch: int64
    [n, 10] in the order of ``COLUMNS``, the topic as its name id, hosts as indices, the reason as
    an index into ``reasons``."""

    def __init__(self, sink: Callable[[np.ndarray, list[str]], None]) -> None:
        self.reasons = [DELIVERED]
        self._sink = sink
        self._reason: dict[str | None, int] = {None: 0}
        self._rows: list[tuple[int, ...]] = []
        self._before: list[tuple[int, ...]] = []  # the batch before, for ``active_links``

    def fate(self, message: Any, receiver: int, time_ns: int, reason: str | None, first_ns: int,
             last_ns: int) -> None:
        """``message`` was delivered to host ``receiver`` (reason None) or dropped, at ``time_ns``;
        its first and last frame left at ``first_ns`` and ``last_ns`` (-1: none did)."""
        number = self._reason.get(reason)
        if number is None:
            number = self._reason[reason] = len(self.reasons)
            self.reasons.append(reason)
        self._rows.append((message.number, message.about.id, message.origin.index, receiver,
                           message.size_bytes, message.born_ns, first_ns, last_ns, number,
                           time_ns))
        if len(self._rows) >= BATCH:
            self.flush()

    def flush(self) -> None:
        """Hand on what has gathered."""
        if self._rows:
            self._sink(np.array(self._rows, np.int64), self.reasons)
            self._before, self._rows = self._rows, []

    def active_links(self, since_ns: int) -> int:
        """How many (source, destination) pairs had a message settled since then, as far back
        as one batch."""
        links = set()
        for row in chain(reversed(self._rows), reversed(self._before)):
            if row[9] < since_ns:
                break
            links.add(row[2:4])
        return len(links)
