"""Questions to a ledger: which messages were late or lost, and what their time went into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from desim.errors import InputError, did_you_mean
from desim.middleware.ledger import PARTS
from desim.ports import natural_key
from desim.results.ledger_topics import Lost, TopicAccounts, accounts, hosts_of, losses

READ = "receiver's queue"  # behind the parts: from a message's arrival until it was first read
_NAMED = 12  # topics in a complaint


@dataclass(frozen=True)
class Question:
    """The messages that are asked about: those of a ``topic``, from or to a host (in names, * and ?
    stand for letters), or one by its number; of them the ``late`` ones with the greatest latency,
    or ``late`` of those ``dropped``."""

    topic: str | None = None
    source: str | None = None
    destination: str | None = None
    message: int | None = None
    late: int = 10
    dropped: bool = False


class Portion(NamedTuple):
    """Time in a part, somewhere."""

    part: str
    place: str
    time_ns: int


class Tale(NamedTuple):
    """One message at one receiver. Where it was dropped, ``reason`` and ``place`` say why and
    where. ``waited_ns``: from its arrival until it was first read (None: never)."""

    number: int
    topic: str
    source: str
    destination: str
    size_bytes: int
    born_ns: int
    end_ns: int
    reason: str | None
    place: str | None
    parts: tuple[Portion, ...]
    waited_ns: int | None


@dataclass(frozen=True)
class Findings:
    """The answer to a question: ``tales`` of single messages, the latest first or, of those
    dropped, in order of time. For all ``delivered`` messages that match, the time (ns) in each part
    (of ``PARTS``, or ``READ``), and the same for those ``shown``; the drops by
    reason and place; and all that match ``by_topic``."""

    tales: tuple[Tale, ...]
    delivered: int
    dropped: int
    shares: dict[str, int]
    shown: dict[str, int]
    lost: tuple[Lost, ...]
    by_topic: TopicAccounts

    @property
    def untold(self) -> bool:
        """Whether a network model on the way tells no parts."""
        return "on the medium" in self.shares


def find(ledger: pa.Table, question: Question) -> Findings:
    """Answer ``question`` from a ledger (``ledger.SCHEMA``). Raises ``InputError`` where no message
    matches."""
    if not len(ledger):
        raise InputError("no message between hosts had reached its fate when the run ended")
    found = _matching(ledger, question)
    arrived = pc.equal(found["fate"], "delivered").to_numpy(zero_copy_only=False)
    delivered, dropped = found.filter(pa.array(arrived)), found.filter(pa.array(~arrived))
    if question.dropped:
        shown = dropped.slice(0, question.late)
    else:
        order = np.argsort(-delivered["latency_ns"].to_numpy(), kind="stable")
        shown = delivered.take(pa.array(order[:question.late]))
        if question.message is not None:
            shown = pa.concat_tables([shown, dropped])
    return Findings(tuple(map(_tale, shown.to_pylist())), len(delivered), len(dropped),
                    _shares(delivered), _shares(shown), losses(dropped),
                    accounts(found, hosts_of(ledger)))


def _matching(ledger: pa.Table, question: Question) -> pa.Table:
    if question.message is not None:
        ledger = _numbered(ledger, question.message)
    whole = ledger
    for column, pattern, what in (("topic", question.topic, "topic"),
                                  ("source", question.source, "sender"),
                                  ("destination", question.destination, "receiver")):
        if pattern is None:
            continue
        words = pc.unique(whole[column].cast(pa.string())).to_pylist()
        wanted = [word for word in words if fnmatchcase(word, pattern)]
        if not wanted:
            raise _unknown(what, pattern, words, question.message)
        ledger = ledger.filter(pc.is_in(ledger[column].cast(pa.string()), pa.array(wanted)))
    if not len(ledger):
        raise InputError("no message of this topic between these hosts had reached its fate when "
                         "the run ended")
    if question.dropped and question.message is not None \
            and not pc.any(pc.not_equal(ledger["fate"], "delivered")).as_py():
        raise InputError(f"message {question.message} was delivered, not dropped")
    return ledger


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


def _shares(table: pa.Table) -> dict[str, int]:
    """The time (ns) in each part, in the order of ``PARTS``, and until messages were read."""
    names, times = (pc.list_flatten(table[column]) for column in ("parts", "times_ns"))
    sums = dict.fromkeys((*map(str, PARTS), READ), 0)
    flat = pa.table({"part": names.cast(pa.string()), "time": times})
    for row in flat.group_by("part").aggregate([("time", "sum")]).to_pylist():
        sums[row["part"]] = row["time_sum"]
    sums[READ] = pc.sum(pc.subtract(table["read_ns"], table["end_ns"])).as_py() or 0
    return {part: time_ns for part, time_ns in sums.items() if time_ns}


def _tale(row: dict[str, Any]) -> Tale:
    spent = tuple(map(Portion, row["parts"], row["places"], row["times_ns"]))
    waited_ns = None if row["read_ns"] is None else row["read_ns"] - row["end_ns"]
    return Tale(row["number"], row["topic"], row["source"], row["destination"], row["size_bytes"],
                row["born_ns"], row["end_ns"], row["reason"], row["place"], spent, waited_ns)
