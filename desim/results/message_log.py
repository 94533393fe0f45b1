"""Every message between hosts at the moment its fate is known, in batches for a table."""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct

import numpy as np

from desim.middleware.message import Message

BATCH = 1 << 14  # rows at a time: 1.3 MB, a row group of the table
LOOKED_BACK = 1 << 13  # messages: 0.6 MB, which a panel can search at each refresh
COLUMNS = ("number", "topic", "source", "destination", "size_bytes", "born_ns", "first_ns",
           "last_ns", "reason", "end_ns")
DELIVERED, DROPPED = "delivered", "dropped"  # fates

_pack = Struct(f"<{len(COLUMNS)}q").pack
_ROW_BYTES = 8 * len(COLUMNS)


class MessageLog:
    """Collects the fates of messages: a ``Graph``'s ``on_fate``. ``sink(rows, reasons)`` gets every
    full batch: int64 [n, 10] in the order of ``COLUMNS``, the topic as its name id, hosts as
    indices, the reason as an index into ``reasons``."""

    def __init__(self, sink: Callable[[np.ndarray, list[str]], None]) -> None:
        self.reasons = [DELIVERED]
        self._sink = sink
        self._reason: dict[str | None, int] = {None: 0}
        self._rows = bytearray()
        self._before = self._rows  # the batch before, for ``active_links``

    def __call__(self, message: Message, receiver: int, time_ns: int, reason: str | None,
                 first_ns: int, last_ns: int) -> None:
        """``message`` was delivered to host ``receiver`` (reason None) or dropped, at ``time_ns``;
        its first and last frame left at ``first_ns`` and ``last_ns`` (-1: none did)."""
        number = self._reason.get(reason)
        if number is None:
            number = self._reason[reason] = len(self.reasons)
            self.reasons.append(str(reason))
        self._take(_pack(
            message.number, message.about.id, message.origin.index, receiver, message.size_bytes,
            message.born_ns, first_ns, last_ns, number, time_ns))

    def delivered(self, deliveries: np.ndarray) -> None:
        """Many messages were delivered."""
        rows = np.zeros((len(deliveries), len(COLUMNS)), "<i8")
        for column, name in enumerate(("number", "topic", "source", "receiver", "size_bytes",
                                       "born_ns", "first_ns", "last_ns")):
            rows[:, column] = deliveries[name]
        rows[:, -1] = deliveries["arrived_ns"]
        self._take(rows.tobytes())

    def flush(self) -> None:
        """Pass the rows that are waiting to the sink."""
        if self._rows:
            self._sink(_array(self._rows), self.reasons)
            self._before, self._rows = self._rows, bytearray()

    def active_links(self, since_ns: int) -> int:
        """The number of (source, destination) pairs with a message settled since then, as far back
        as ``LOOKED_BACK`` messages."""
        rows = _array(self._before + self._rows)[-LOOKED_BACK:]
        return len(np.unique(rows[rows[:, 9] >= since_ns, 2:4], axis=0))

    def _take(self, rows: bytes) -> None:
        self._rows += rows
        if len(self._rows) >= BATCH * _ROW_BYTES:
            self.flush()


def _array(rows: bytes | bytearray) -> np.ndarray:
    return np.frombuffer(rows, "<i8").reshape(-1, len(COLUMNS))
