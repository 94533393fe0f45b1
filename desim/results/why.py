"""Late and lost messages of a ledger, and the breakdown of their latency into parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from desim.errors import InputError, did_you_mean
from desim.middleware.message_ledger import PARTS
from desim.ports import TimePart, natural_key
from desim.results.data_age import DataAge, data_age
from desim.results.latency_by_topic import Lost, TopicBreakdowns, by_topic, hosts_of, losses
from desim.results.message_log import DELIVERED

# Before the parts, where the callback that published a message took time: it waited for its node,
# and for a processor, and computed.
BEFORE = ("node's queue", "run queue", "computing")
# Behind them: from a message's arrival until its node looked at it first, or until a callback got
# it, which had to wait for its node or for a processor.
READ, BUSY = "receiver's queue", "busy receiver"
_BEFORE = ("node_queue_ns", "run_queue_ns", "computing_ns")  # columns
_FRAMES_LOST = ("frames_lost", "frames_lost_for", "frames_lost_from_ns", "frames_lost_until_ns",
                "frames_lost_at", "frames_lost_behind_people")
_JOINING = ("joining", "joined", "joining_from_ns", "joined_ns")
_NAMED = 12  # topics in a complaint


@dataclass(frozen=True)
class Query:
    """A selection of messages: those of a ``topic``, from or to a host (in names, * and ? stand for
    letters), or one by its number; of them the ``late`` ones with the greatest latency, or ``late``
    of those ``dropped``. ``since``: the topic of the readings on which they are based."""

    topic: str | None = None
    source: str | None = None
    destination: str | None = None
    message: int | None = None
    late: int = 10
    dropped: bool = False
    since: str | None = None


class MessagePart(NamedTuple):
    """A part of a message's time, and the place where it was spent."""

    part: str
    place: str
    time_ns: int


class FramesLost(NamedTuple):
    """Frames between a message's hosts, lost while it was under way: how many for the most frequent
    ``reason``, when the first and the last of them, and at which ``place`` most (None: an older
    ledger does not say); with people on the line ``behind_people`` of them."""

    frames: int
    reason: str
    from_ns: int
    until_ns: int
    place: str | None = None
    behind_people: int | None = None


class AssociationWait(NamedTuple):
    """A sender's or receiver's time without an access point while a message was under way, until
    it hung on ``access_point`` or the message had its fate."""

    host: str
    access_point: str
    from_ns: int
    until_ns: int

    @property
    def time_ns(self) -> int:
        """Its length."""
        return self.until_ns - self.from_ns


class MessageFate(NamedTuple):
    """One message at one receiver: delivered, or dropped for a ``reason`` at a ``place``.
    ``before``: what the callback that published it did before its birth (of ``BEFORE``; nothing on
    ideal computers); ``waited_ns``: from its arrival until it was first read (None: never), and
    ``waited_in``: ``READ`` or ``BUSY``."""

    number: int
    topic: str
    source: str
    destination: str
    size_bytes: int
    born_ns: int
    end_ns: int
    reason: str | None
    place: str | None
    before: tuple[MessagePart, ...]
    parts: tuple[MessagePart, ...]
    waited_ns: int | None
    waited_in: str
    frames_lost: FramesLost | None = None
    association: AssociationWait | None = None

    @property
    def latency_ns(self) -> int:
        """The time from its birth to its fate."""
        return self.end_ns - self.born_ns


@dataclass(frozen=True)
class LatencyBreakdown:
    """The answer to a query: the fates of the ``messages`` that it selects, the latest first or, of
    those dropped, in order of time. For all ``delivered`` messages that match, the time (ns) in
    each part (of ``BEFORE``, ``PARTS``, ``READ`` and ``BUSY``), and the same of the ``messages``
    alone; the drops by reason and place; all that match ``by_topic``; and the ``age`` of the data
    of those delivered, where the query says since which topic."""

    messages: tuple[MessageFate, ...]
    delivered: int
    dropped: int
    times_ns: dict[str, int]
    messages_times_ns: dict[str, int]
    lost: tuple[Lost, ...]
    by_topic: TopicBreakdowns
    age: DataAge | None

    @property
    def is_itemized(self) -> bool:
        """Whether all network models on the way give the parts of their time."""
        return TimePart.MEDIUM not in self.times_ns


def breakdown(ledger: pa.Table, query: Query) -> LatencyBreakdown:
    """The answer of a ledger (of ``ledger.SCHEMA``) to ``query``. Raises ``InputError`` where no
    message matches."""
    if not len(ledger):
        raise InputError("no message between hosts had reached its fate when the run ended")
    found = _matching(ledger, query)
    arrived = pc.equal(found["fate"], DELIVERED).to_numpy(zero_copy_only=False)
    delivered, dropped = found.filter(pa.array(arrived)), found.filter(pa.array(~arrived))
    if query.dropped:
        shown = dropped.slice(0, query.late)
    else:
        order = np.argsort(-delivered["latency_ns"].to_numpy(), kind="stable")
        shown = delivered.take(pa.array(order[:query.late]))
        if query.message is not None:
            shown = pa.concat_tables([shown, dropped])
    return LatencyBreakdown(fates(shown), len(delivered), len(dropped),
                            _times_ns(delivered), _times_ns(shown), losses(dropped),
                            by_topic(found, hosts_of(ledger)),
                            None if query.since is None else _age(ledger, query.since, delivered))


def _age(ledger: pa.Table, since: str, delivered: pa.Table) -> DataAge:
    topics = _wanted(ledger, "topic", since, "topic", None)
    return data_age(_where(ledger, "topic", topics), delivered)


def fates(rows: pa.Table) -> tuple[MessageFate, ...]:
    """The messages in ``rows`` of a ledger, in their order."""
    return tuple(map(_fate, rows.to_pylist()))


def _matching(ledger: pa.Table, query: Query) -> pa.Table:
    if query.message is not None:
        ledger = _numbered(ledger, query.message)
    whole = ledger
    for column, pattern, what in (("topic", query.topic, "topic"),
                                  ("source", query.source, "sender"),
                                  ("destination", query.destination, "receiver")):
        if pattern is None:
            continue
        ledger = _where(ledger, column, _wanted(whole, column, pattern, what, query.message))
    if not len(ledger):
        raise InputError("no message of this topic between these hosts had reached its fate when "
                         "the run ended")
    if query.dropped and query.message is not None \
            and not pc.any(pc.not_equal(ledger["fate"], DELIVERED)).as_py():
        raise InputError(f"message {query.message} was delivered, not dropped")
    return ledger


def _wanted(ledger: pa.Table, column: str, pattern: str, what: str, message: int | None
            ) -> list[str]:
    """The words in ``column`` that match ``pattern``."""
    words = pc.unique(ledger[column].cast(pa.string())).to_pylist()
    wanted = [word for word in words if fnmatchcase(word, pattern)]
    if not wanted:
        raise _unknown(what, pattern, words, message)
    return wanted


def _where(ledger: pa.Table, column: str, words: Sequence[str]) -> pa.Table:
    """The rows with one of ``words`` in ``column``."""
    return ledger.filter(pc.is_in(ledger[column].cast(pa.string()), pa.array(words)))


def _numbered(ledger: pa.Table, number: int) -> pa.Table:
    found = ledger.filter(pc.equal(ledger["number"], number))
    if not len(found):
        last = pc.max(ledger["number"]).as_py() or 0
        raise InputError(f"no message {number} among those with a fate; the last of them is {last}")
    return found


def _unknown(what: str, pattern: str, words: Sequence[str], message: int | None) -> InputError:
    known = sorted(words, key=natural_key)
    more = f" and {len(known) - _NAMED} more" if len(known) > _NAMED else ""
    names = f"{', '.join(known[:_NAMED])}{more}"
    if message is not None:
        return InputError(f"message {message} has not the {what} {pattern!r}, but {names}")
    return InputError(f"no message has the {what} {pattern!r}{did_you_mean(pattern, known)}; there "
                      f"are {names}")


def _times_ns(table: pa.Table) -> dict[str, int]:
    """The time (ns) in each part, in the order of ``PARTS``, and before and behind them."""
    names, times = (pc.list_flatten(table[column]) for column in ("parts", "times_ns"))
    sums = dict.fromkeys((*BEFORE, *map(str, PARTS), READ, BUSY), 0)
    flat = pa.table({"part": names.cast(pa.string()), "time": times})
    for row in flat.group_by("part").aggregate([("time", "sum")]).to_pylist():
        sums[row["part"]] = row["time_sum"]
    for part, column in zip(BEFORE, _BEFORE, strict=True):
        sums[part] = pc.sum(table[column]).as_py() or 0
    waited_ns = pc.subtract(table["read_ns"], table["end_ns"])
    busy_ns = waited_ns.filter(pc.fill_null(table["by_callback"], False))
    sums[BUSY] = pc.sum(busy_ns).as_py() or 0
    sums[READ] = (pc.sum(waited_ns).as_py() or 0) - sums[BUSY]
    return {part: time_ns for part, time_ns in sums.items() if time_ns}


def _fate(row: dict[str, Any]) -> MessageFate:
    node = f"{row['source']} {row['node']}"
    before = tuple(MessagePart(part, node, row[column])
                   for part, column in zip(BEFORE, _BEFORE, strict=True) if row[column])
    spent = tuple(map(MessagePart, row["parts"], row["places"], row["times_ns"]))
    waited_ns = None if row["read_ns"] is None else row["read_ns"] - row["end_ns"]
    return MessageFate(row["number"], row["topic"], row["source"], row["destination"],
                       row["size_bytes"], row["born_ns"], row["end_ns"], row["reason"],
                       row["place"], before, spent, waited_ns,
                       BUSY if waited_ns and row["by_callback"] else READ,
                       None if row["frames_lost"] is None else
                       FramesLost(*(row[column] for column in _FRAMES_LOST)),
                       None if row["joining"] is None else
                       AssociationWait(*(row[column] for column in _JOINING)))
