"""The parts of the messages' times for a replay, of a run that has kept its ledger."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from desim.report.replay.columns import Columns
from desim.report.replay.traffic import BornMessages
from desim.results.message_columns import words_of


def add_ledger(columns: Columns, ledger: pa.Table, messages: BornMessages, kept: np.ndarray,
               hosts: Sequence[str]) -> dict[str, list[str]]:
    """Add the parts (docs/why.md) of the messages ``kept``, and the words that they index."""
    place = {name: i for i, name in enumerate(hosts)}
    names, destination = words_of(ledger["destination"])
    own = np.array([place[name] for name in names], np.int64)[destination]
    # A message has a row for each receiver.
    key = ledger["number"].to_numpy() * len(hosts) + own
    order = np.argsort(key, kind="stable")
    wanted = messages.number[kept] * len(hosts) + messages.destination[kept]
    rows = pa.array(order[np.searchsorted(key, wanted, sorter=order)])
    columns.add("part.count", ledger["parts"].take(rows).combine_chunks().value_lengths()
                .fill_null(0).to_numpy(zero_copy_only=False))
    found: dict[str, list[str]] = {}
    for name in ("parts", "places"):
        found[name], indices = words_of(pa.chunked_array(
            [ledger[name].take(rows).combine_chunks().flatten()]))
        columns.add(f"part.{name}", indices)
    columns.add("part.ns", ledger["times_ns"].take(rows).combine_chunks().flatten().to_numpy())
    return found
