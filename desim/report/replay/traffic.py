"""The messages of a run for its replay: each by itself, as load per link, and per topic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from desim.monitor.meters.belief_metrics import LATE_NS
from desim.monitor.traffic import KINDS, family, kind
from desim.report.replay.columns import Columns
from desim.results.message_columns import Groups, words_of
from desim.results.message_log import DELIVERED
from desim.units import NS_PER_S

MAX_MESSAGES = 300_000  # drawn one by one; more are thinned
MAX_LOADS = 400_000  # rows of load per link; more are summed over longer times
NS_PER_US = 1000
SIMULATION = KINDS.index("simulation")


class BornMessages(NamedTuple):
    """The messages of a run, [n] each, in the order of their births; ``topic`` indexes ``topics``,
    ``kind`` and ``family`` are by topic, ``reason`` indexes ``reasons`` (0: delivered)."""

    topics: tuple[str, ...]
    families: tuple[str, ...]
    kind: np.ndarray
    family: np.ndarray
    reasons: tuple[str, ...]
    number: np.ndarray
    topic: np.ndarray
    source: np.ndarray
    destination: np.ndarray
    size_bytes: np.ndarray
    born_ns: np.ndarray
    first_ns: np.ndarray
    end_ns: np.ndarray
    reason: np.ndarray

    @property
    def is_late(self) -> np.ndarray:
        """[n] those that were delivered after ``LATE_NS`` or more."""
        return (self.reason == 0) & (self.end_ns - self.born_ns >= LATE_NS)


def traffic_of(messages: pa.Table, hosts: Sequence[str]) -> BornMessages:
    """``messages`` as ``messages.parquet`` has them, hosts as indices into ``hosts``."""
    order = np.argsort(messages["born_ns"].to_numpy(), kind="stable")

    def numbers(name: str) -> np.ndarray:
        # A message of which no frame ever left has no first one.
        return pc.fill_null(messages[name], -1).to_numpy()[order]

    def words(name: str) -> tuple[list[str], np.ndarray]:
        found, indices = words_of(messages[name])
        return found, indices[order]

    topics, topic = words("topic")
    reasons, reason = words("reason")
    place = {name: i for i, name in enumerate(hosts)}
    sources, source = words("source")
    destinations, destination = words("destination")
    known = frozenset(hosts)
    family_of = [family(name, known) for name in topics]
    families = sorted(set(family_of))
    return BornMessages(
        tuple(topics), tuple(families), np.array([KINDS.index(kind(name)) for name in topics], int),
        np.array([families.index(name) for name in family_of], int), (DELIVERED, *reasons),
        numbers("number"), topic, np.array([place[name] for name in sources], int)[source],
        np.array([place[name] for name in destinations], int)[destination], numbers("size_bytes"),
        numbers("born_ns"), numbers("first_ns"), numbers("end_ns"), reason + 1)


def add_messages(columns: Columns, traffic: BornMessages) -> tuple[np.ndarray, str | None]:
    """Add the messages that are drawn one by one: all but those of sensors and commands. Their
    rows, and the sentence that says what was left out, if anything was."""
    shown = np.flatnonzero(traffic.kind[traffic.topic] != SIMULATION)
    kept = _thinned(traffic, shown)
    columns.add("message.born_us", traffic.born_ns[kept] // NS_PER_US)
    # How long it waited at its sender; -1: no frame of it ever left.
    left_ns = traffic.first_ns[kept]
    columns.add("message.left_us",
                np.where(left_ns < 0, -1, (left_ns - traffic.born_ns[kept]) // NS_PER_US))
    columns.add("message.flight_us",
                (traffic.end_ns[kept] - traffic.born_ns[kept]) // NS_PER_US)
    for name in ("number", "topic", "source", "destination", "size_bytes", "reason"):
        columns.add(f"message.{name}", getattr(traffic, name)[kept])
    if len(kept) == len(shown):
        return kept, None
    return kept, (f"{len(kept):,} of {len(shown):,} messages are drawn one by one: late and lost "
                  "ones first, of the others every so many; topics have all")


def _thinned(traffic: BornMessages, shown: np.ndarray) -> np.ndarray:
    if len(shown) <= MAX_MESSAGES:
        return shown
    special = (traffic.is_late | (traffic.reason > 0))[shown]
    first = _spread(shown[special], MAX_MESSAGES // 2)
    return np.sort(np.concatenate([first, _spread(shown[~special], MAX_MESSAGES - len(first))]))


def _spread(rows: np.ndarray, most: int) -> np.ndarray:
    """At most so many of the rows, evenly."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).astype(int)]


def add_loads(columns: Columns, traffic: BornMessages) -> tuple[int, list[str]]:
    """Add the bytes delivered per link, kind of traffic and bin of time; the bin in seconds, and
    the sentences that say what was reduced."""
    done = np.flatnonzero(traffic.reason == 0)
    links = Groups(traffic.source[done], traffic.destination[done],
                   traffic.kind[traffic.topic[done]])
    busy, notes = _busiest(links, traffic.size_bytes[done])
    done, link, width_s = done[busy], links.group[busy], 1
    while True:
        groups = Groups(traffic.end_ns[done] // (width_s * NS_PER_S), link)
        if len(groups) <= MAX_LOADS:
            break
        width_s *= 2
    bin_, which = groups.columns
    columns.add("load.bin", bin_)
    for name, values in zip(("source", "destination", "kind"), links.columns, strict=True):
        columns.add(f"load.{name}", values[which])
    columns.add("load.bytes", groups.sums(traffic.size_bytes[done]).astype(np.int64))
    if width_s > 1:
        notes.append(f"loads of links are means over {width_s} s")
    return width_s, notes


def _busiest(links: Groups, size_bytes: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """[messages] bool: those on the links that carry most, so few of them that several bins of time
    have room; and the sentence that says it if these are not all."""
    if len(links) <= MAX_LOADS // 4:
        return np.ones(len(size_bytes), bool), []
    kept = np.zeros(len(links), bool)
    kept[np.argsort(-links.sums(size_bytes), kind="stable")[:MAX_LOADS // 4]] = True
    note = f"only the {kept.sum():,} busiest of {len(links):,} links have loads"
    return kept[links.group], [note]


def add_topics(columns: Columns, traffic: BornMessages, begin_ns: int, end_ns: int) -> None:
    """Add for each family and second from ``begin_ns`` on: bytes and messages delivered, the mean
    and the longest latency [us], and messages that were lost."""
    first = begin_ns // NS_PER_S
    shape = len(traffic.families), max(-(-end_ns // NS_PER_S) - first, 1)
    cell = (traffic.family[traffic.topic] * shape[1]
            + np.minimum(traffic.end_ns // NS_PER_S - first, shape[1] - 1))
    done, cells = traffic.reason == 0, shape[0] * shape[1]
    latency_us = (traffic.end_ns - traffic.born_ns)[done] // NS_PER_US
    count = np.bincount(cell[done], minlength=cells)
    longest = np.zeros(cells, np.int64)
    np.maximum.at(longest, cell[done], latency_us)
    total_us = np.bincount(cell[done], latency_us, cells)
    for name, values in (
            ("bytes", np.bincount(cell[done], traffic.size_bytes[done], cells)),
            ("messages", count), ("latency_us", total_us / np.maximum(count, 1)),
            ("longest_us", longest), ("lost", np.bincount(cell[~done], minlength=cells))):
        columns.add(f"topic.{name}", np.asarray(values).astype(np.int64).reshape(shape))
