"""Ledgers of runs under test."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from graphs import Net

from desim.middleware.message_ledger import PARTS, ROW, STAMP, MessageLedger
from desim.network.passages import Passages
from desim.results.ledger import LedgerRecorder


class Sums(NamedTuple):
    """Of delivered messages: their latencies, the sums of their parts, and each part's share."""

    latency_ns: np.ndarray
    parts_ns: np.ndarray
    by_part: dict[str, int]


def with_ledger(run: Callable[[MessageLedger], object]) -> tuple[MessageLedger, object]:
    """``run(ledger)`` with a ledger, and its answer."""
    ledger = MessageLedger(Passages())
    return ledger, run(ledger)


def table_of_net(play: Callable[[MessageLedger], Net]) -> pa.Table:
    """The ledger's table of the net that ``play(ledger)`` has run."""
    recorder = LedgerRecorder()
    net = play(recorder.messages)
    net.rows()
    for batch in net.batches:
        recorder.sink(batch)
    return recorder.table(net.names, [host.name for host in net.graph.hosts])


def sums(ledger: MessageLedger) -> Sums:
    """The sums of the delivered messages' parts."""
    rows, stamps = (np.frombuffer(b"".join(packed), dtype) for packed, dtype in (
        (ledger.rows, ROW), (ledger.stamps, STAMP)))
    ends = np.cumsum(ledger.counts)
    before = np.concatenate([[0], np.cumsum(stamps["time_ns"])])
    parts_ns = before[ends] - before[ends - ledger.counts]
    arrived = rows["fate"] == 0
    times = np.bincount(stamps["part"], stamps["time_ns"], len(PARTS))
    return Sums((rows["end_ns"] - rows["born_ns"])[arrived], parts_ns[arrived],
                {str(part): int(time_ns) for part, time_ns in zip(PARTS, times, strict=True)
                 if time_ns})


def rows_of(ledger: MessageLedger) -> np.ndarray:
    """All rows."""
    return np.frombuffer(b"".join(ledger.rows), ROW)


def stamps_of(ledger: MessageLedger) -> list[list[tuple[str, str, int]]]:
    """Part, host (``a`` is the first) and ns of each stamp, by row."""
    left = iter(np.frombuffer(b"".join(ledger.stamps), STAMP).tolist())
    return [[(str(PARTS[part]), "abcdefgh"[host], time_ns)
             for part, _, host, time_ns in (next(left) for _ in range(count))]
            for count in ledger.counts]
