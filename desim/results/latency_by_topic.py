"""Messages by family of topics: sums of a ledger's parts of latency and of its losses, and ages."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from desim.middleware.message_ledger import PARTS
from desim.monitor.traffic import family
from desim.ports import natural_key
from desim.results.message_columns import words_of
from desim.results.seal import Json

_NUMBER = re.compile(r"_\d+$")


class Lost(NamedTuple):
    """Messages that were dropped for one reason at one place."""

    reason: str
    place: str
    messages: int


class Quantiles(NamedTuple):
    """The median of times, and their 95th percentile."""

    median_ns: int
    p95_ns: int


class MessageAges(NamedTuple):
    """The age of messages on their arrival, in three steps: the callback that published them had
    ``waited`` for its node and for a processor, it had ``computed``, and they were ``on_the_way``.
    """

    waited: Quantiles
    computed: Quantiles
    on_the_way: Quantiles


@dataclass(frozen=True)
class TopicBreakdown:
    """The messages of a family of topics: of those ``delivered`` the sum of their latencies, and
    the time (ns) in each part, in the order of ``PARTS``; those ``lost``; and the ``ages`` of those
    delivered that callbacks published, None where computers are ideal."""

    delivered: int
    latency_ns: int
    times_ns: dict[str, int]
    lost: tuple[Lost, ...]
    ages: MessageAges | None = None

    @property
    def dropped(self) -> int:
        """The number of those lost."""
        return sum(lost.messages for lost in self.lost)


TopicBreakdowns = dict[str, TopicBreakdown]  # by family


def hosts_of(ledger: pa.Table) -> frozenset[str]:
    """The hosts between which a ledger's messages went."""
    return frozenset(host for end in ("source", "destination")
                     for host in pc.unique(ledger[end].cast(pa.string())).to_pylist())


def by_topic(ledger: pa.Table, hosts: Collection[str]) -> TopicBreakdowns:
    """The sums of a ledger (of ``ledger.SCHEMA``) by family of topics.
    ``hosts``: those whose names a family leaves open."""
    topics, topic = _words_of(ledger["topic"])
    families = [family(name, frozenset(hosts)) for name in topics]
    names = sorted(set(families), key=natural_key)
    of_row = np.array([names.index(name) for name in families], int)[topic]
    latency_ns = ledger["latency_ns"].fill_null(0).to_numpy()
    lost = np.asarray(ledger["latency_ns"].is_null())
    sums = np.zeros(len(names), np.int64)
    np.add.at(sums, of_row, latency_ns)
    times_ns = _times_ns(ledger, of_row, len(names))
    delivered = np.bincount(of_row[~lost], minlength=len(names))
    return {name: TopicBreakdown(
        int(delivered[i]), int(sums[i]),
        {str(part): int(time_ns) for part, time_ns in zip(PARTS, times_ns[i], strict=True)
         if time_ns}, losses(ledger.filter(pa.array(lost & (of_row == i)))),
        _ages(ledger.filter(pa.array(~lost & (of_row == i)))))
        for i, name in enumerate(names)}


def _ages(delivered: pa.Table) -> MessageAges | None:
    timed = delivered.filter(pc.is_valid(delivered["computing_ns"]))
    if not len(timed):
        return None
    node_queue_ns, run_queue_ns, computing_ns, latency_ns = (timed[name].to_numpy() for name in (
        "node_queue_ns", "run_queue_ns", "computing_ns", "latency_ns"))
    steps = node_queue_ns + run_queue_ns, computing_ns, latency_ns
    median_ns, p95_ns = np.rint(np.quantile(steps, (0.5, 0.95), axis=1)).astype(int).tolist()
    return MessageAges(*map(Quantiles, median_ns, p95_ns))


def losses(dropped: pa.Table) -> tuple[Lost, ...]:
    """The rows of a ledger, all of them drops, by reason and place; the most frequent first."""
    flat = pa.table({name: dropped[name].cast(pa.string()) for name in ("reason", "place")})
    rows = flat.group_by(["reason", "place"]).aggregate([([], "count_all")]).to_pylist()
    return tuple(sorted((Lost(row["reason"], row["place"], row["count_all"]) for row in rows),
                        key=lambda lost: (-lost.messages, lost.reason, natural_key(lost.place))))


def without_numbers(place: str) -> str:
    """A place for all hosts of its kind: ``lan at robot_3`` to ``lan at robot_*``."""
    return _NUMBER.sub("_*", place)


def as_json(found: TopicBreakdowns) -> Json:
    """The sums as JSON, which ``from_json`` reads."""
    return {name: {"delivered": one.delivered, "latency_ns": one.latency_ns,
                   "times_ns": one.times_ns, "lost": [lost._asdict() for lost in one.lost],
                   "ages": one.ages and {step: times._asdict()
                                         for step, times in one.ages._asdict().items()}}
            for name, one in found.items()}


def from_json(found: Json) -> TopicBreakdowns:
    """The sums that ``as_json`` has written."""
    return {name: TopicBreakdown(one["delivered"], one["latency_ns"], one["times_ns"],
                                 tuple(Lost(**lost) for lost in one["lost"]),
                                 _ages_from(one.get("ages")))
            for name, one in found.items()}


def _ages_from(found: Json | None) -> MessageAges | None:
    """The ages of ``as_json``; runs of before there were ages have none."""
    return None if found is None else MessageAges(
        **{step: Quantiles(**times) for step, times in found.items()})


def _times_ns(ledger: pa.Table, of_row: np.ndarray, families: int) -> np.ndarray:
    """[families, parts] the time in each part."""
    words, word = _words_of(pc.list_flatten(ledger["parts"]))
    part = np.array([list(map(str, PARTS)).index(name) for name in words], int)[word]
    counts = pc.list_value_length(ledger["parts"]).to_numpy()
    times_ns = np.zeros((families, len(PARTS)), np.int64)
    np.add.at(times_ns, (np.repeat(of_row, counts), part),
              pc.list_flatten(ledger["times_ns"]).to_numpy())
    return times_ns


def _words_of(column: pa.ChunkedArray) -> tuple[list[str], np.ndarray]:
    """``words_of`` without the words that only rows outside of ``column`` have."""
    return words_of(column.cast(pa.string()))
