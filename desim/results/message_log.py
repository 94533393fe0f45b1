"""Every message between hosts at the moment its fate is known, in batches for a table."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from desim.middleware.fates import BatchArrivals, pack_delivered
from desim.middleware.message import Message

BATCH = 1 << 14  # rows at a time: 1.3 MB, a row group of the table
LOOKED_BACK = 1 << 13  # messages: 0.6 MB, which a panel can search at each refresh
COLUMNS = ("number", "topic", "source", "destination", "size_bytes", "born_ns", "first_ns",
           "last_ns", "reason", "end_ns")
DELIVERED, DROPPED = "delivered", "dropped"  # fates

_PACKED = np.dtype(("V", 8 * len(COLUMNS)))  # a row


class MessageLog:
    """Collects the fates of messages: a ``Graph``'s ``on_fate``. ``sink(rows, reasons)`` gets every
    full batch: int64 [n, 10] in the order of ``COLUMNS``, the topic as its name id, hosts as
    indices, the reason as an index into ``reasons``."""

    def __init__(self, sink: Callable[[np.ndarray, list[str]], None]) -> None:
        self.reasons = [DELIVERED]
        self._sink = sink
        self._reason: dict[str | None, int] = {None: 0}
        self._rows: list[bytes] = []
        self._before: list[bytes] = []  # the batch before, for ``active_links``
        self.note_delivered = self._rows.append

    def __call__(self, message: Message, receiver: int, time_ns: int, reason: str | None,
                 first_ns: int, last_ns: int) -> None:
        """``message`` was delivered to host ``receiver`` (reason None) or dropped, at ``time_ns``;
        its first and last frame left at ``first_ns`` and ``last_ns`` (-1: none did)."""
        number = self._reason.get(reason)
        if number is None:
            number = self._reason[reason] = len(self.reasons)
            self.reasons.append(str(reason))
        self.note_delivered(pack_delivered(
            message.number, message.about.id, message.origin.index, receiver, message.size_bytes,
            message.born_ns, first_ns, last_ns, number, time_ns))
        self.flush_if_full()

    def arrivals(self, batch: BatchArrivals) -> None:
        """Many messages of one host were delivered."""
        rows = np.empty((len(batch.numbers), len(COLUMNS)), "<i8")
        rows[:, 0], rows[:, 1], rows[:, 2] = batch.numbers, batch.topics, batch.source
        rows[:, 3], rows[:, 4] = batch.receivers, batch.size_bytes
        rows[:, 5:8] = batch.born_ns[:, None]  # their frames were sent at birth
        rows[:, 8], rows[:, 9] = 0, batch.arrived_ns
        packed: list[bytes] = rows.view(_PACKED)[:, 0].tolist()
        self._rows += packed
        self.flush_if_full()

    def flush_if_full(self) -> None:
        """Pass the rows on if they fill a batch."""
        if len(self._rows) >= BATCH:
            self.flush()

    def flush(self) -> None:
        """Pass the rows that are waiting to the sink."""
        if self._rows:
            self._sink(_array(self._rows), self.reasons)
            self._before = self._rows.copy()
            self._rows.clear()

    def active_links(self, since_ns: int) -> int:
        """The number of (source, destination) pairs with a message settled since then, as far back
        as ``LOOKED_BACK`` messages."""
        before = max(LOOKED_BACK - len(self._rows), 0)
        rows = _array(self._before[len(self._before) - before:] + self._rows[-LOOKED_BACK:])
        return len(np.unique(rows[rows[:, 9] >= since_ns, 2:4], axis=0))


def _array(rows: list[bytes]) -> np.ndarray:
    return np.frombuffer(b"".join(rows), "<i8").reshape(-1, len(COLUMNS))
