"""The traffic of a run by second and link, and the links that were up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from desim.results.recording import LinkChange
from desim.results.source import ReplaySource
from desim.units import NS_PER_S

DELIVERED = "delivered"


class LinkLoad(NamedTuple):
    """The messages from one host to another whose fates became known within a second: how many
    were delivered, their bytes and mean latency, and how many were dropped."""

    source: str
    destination: str
    messages: int
    size_bytes: int
    latency_ns: float
    dropped: int


class Traffic:
    """The link loads of ``recording``; ``at(k)`` are those of (k - 1 s, k s]."""

    def __init__(self, recording: ReplaySource) -> None:
        table = recording.messages if recording.run.has("messages.parquet") else None
        self._loads: dict[int, list[LinkLoad]] = {}
        if table is not None and len(table):
            self._add(table)

    def at(self, second: int) -> list[LinkLoad]:
        return self._loads.get(second, [])

    def _add(self, table: pa.Table) -> None:
        sources, source = _words(table["source"])
        destinations, destination = _words(table["destination"])
        second = -(-table["end_ns"].to_numpy() // NS_PER_S)
        fates, fate = _words(table["fate"])
        arrived = fate == (fates.index(DELIVERED) if DELIVERED in fates else -1)
        key = (second * len(sources) + source) * len(destinations) + destination
        keys, link = np.unique(key, return_inverse=True)
        latency_ns = np.nan_to_num(table["latency_ns"].to_numpy().astype(float))
        messages = np.bincount(link, arrived)
        size_bytes = np.bincount(link, arrived * table["size_bytes"].to_numpy())
        total_ns = np.bincount(link, arrived * latency_ns)
        dropped = np.bincount(link, ~arrived)
        rest, to = np.divmod(keys, len(destinations))
        seconds, from_ = np.divmod(rest, len(sources))
        for i, at in enumerate(seconds.tolist()):
            self._loads.setdefault(at, []).append(LinkLoad(
                sources[from_[i]], destinations[to[i]], int(messages[i]), int(size_bytes[i]),
                total_ns[i] / max(messages[i], 1), int(dropped[i])))


def _words(column: pa.ChunkedArray) -> tuple[list[str], np.ndarray]:
    """The different words of a column, and the index of each row's."""
    whole = column.cast(pa.string()).combine_chunks().dictionary_encode()
    return whole.dictionary.to_pylist(), whole.indices.to_numpy(zero_copy_only=False)


def changes(recording: ReplaySource) -> Sequence[LinkChange]:
    """The changes of links; none where a run has not sampled them."""
    return recording.links if recording.run.has("links.parquet") else ()


def linked_pairs(recording: ReplaySource) -> Iterator[tuple[int, frozenset[tuple[str, str]]]]:
    """The pairs (host, other) between which frames get, from each instant on at which they change.
    """
    now: set[tuple[str, str]] = set()
    known = changes(recording)
    for i, change in enumerate(known):
        (now.add if change.linked else now.discard)((change.host, change.other))
        if i + 1 == len(known) or known[i + 1].time_ns != change.time_ns:
            yield change.time_ns, frozenset(now)
