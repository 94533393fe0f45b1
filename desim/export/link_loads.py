"""The loads of links, second by second, and which links there were."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from desim.results.file_names import LINKS, MESSAGES
from desim.results.message_columns import Groups, words_of
from desim.results.message_log import DELIVERED
from desim.results.recording import LinkChange
from desim.results.source import ReplaySource
from desim.units import NS_PER_S


class LinkLoad(NamedTuple):
    """The messages from one host to another whose fates became known within a second: how many
    were delivered, their bytes and mean latency, and how many were dropped."""

    source: str
    destination: str
    messages: int
    size_bytes: int
    latency_ns: float
    dropped: int


class LinkLoads:
    """The link loads of ``recording``; ``at(k)`` are those of (k - 1 s, k s]."""

    def __init__(self, recording: ReplaySource) -> None:
        table = recording.messages if recording.run.has(MESSAGES) else None
        self._loads: dict[int, list[LinkLoad]] = {}
        if table is not None and len(table):
            self._add(table)

    def at(self, second: int) -> list[LinkLoad]:
        return self._loads.get(second, [])

    def _add(self, table: pa.Table) -> None:
        sources, source = words_of(table["source"])
        destinations, destination = words_of(table["destination"])
        fates, fate = words_of(table["fate"])
        arrived = fate == (fates.index(DELIVERED) if DELIVERED in fates else -1)
        latency_ns = np.nan_to_num(table["latency_ns"].to_numpy().astype(float))
        groups = Groups(-(-table["end_ns"].to_numpy() // NS_PER_S), source, destination)
        columns = [*groups.columns, groups.sums(arrived),
                   groups.sums(arrived * table["size_bytes"].to_numpy()),
                   groups.sums(arrived * latency_ns), groups.sums(~arrived)]
        for second, from_, to, messages, size_bytes, total_ns, dropped in zip(
                *(column.tolist() for column in columns), strict=True):
            self._loads.setdefault(second, []).append(LinkLoad(
                sources[from_], destinations[to], int(messages), int(size_bytes),
                total_ns / max(messages, 1), int(dropped)))


def changes(recording: ReplaySource) -> Sequence[LinkChange]:
    """The changes of links; none where a run has not sampled them."""
    return recording.links if recording.run.has(LINKS) else ()


def linked_pairs(recording: ReplaySource) -> Iterator[tuple[int, frozenset[tuple[str, str]]]]:
    """The pairs (host, other) between which frames get, from each instant on at which they change.
    """
    now: set[tuple[str, str]] = set()
    known = changes(recording)
    for i, change in enumerate(known):
        (now.add if change.linked else now.discard)((change.host, change.other))
        if i + 1 == len(known) or known[i + 1].time_ns != change.time_ns:
            yield change.time_ns, frozenset(now)
