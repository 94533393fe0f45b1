"""The rows of a trace that belong to one message, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from desim.engine.trace import Names

# Rows about a message: its source is the entity, or column a; column b is its number there.
_AT_SOURCE = ("sent", "frame")
_ASSOCIATIONS = ("associated", "disassociated")  # of its hosts with access points, meanwhile
_AT_OTHERS = ("lost", "delivered", "dropped", "callback", "read", "overwritten", "repeated")


class Step(NamedTuple):
    """One row of a message's story."""

    time_ns: int
    what: str
    where: str
    detail: str


def story(rows: np.ndarray, names: Mapping[int, str], number: int) -> list[Step]:
    """Every row about message ``number`` (1 is the first of the run), in order, and those of its
    hosts that come to access points or leave them meanwhile; empty if there is no such message."""
    ids = Names()
    sent = _in_order(rows, np.flatnonzero(rows["kind"] == ids.id("sent")))
    if not 1 <= number <= len(sent):
        return []
    first = rows[sent[number - 1]]
    source, seq = first["entity"], first["b"]
    media = [id_ for id_, name in names.items() if name.startswith("medium/")]
    own = (rows["entity"] == source) & np.isin(rows["kind"], [ids.id(kind) for kind in _AT_SOURCE])
    others = (rows["a"] == source) & (
        np.isin(rows["kind"], [ids.id(kind) for kind in _AT_OTHERS])
        | np.isin(rows["entity"], media))
    about = (rows["b"] == seq) & (own | others)
    times_ns, own_ns = rows["t_ns"], rows["t_ns"][about]
    meanwhile = (np.isin(rows["kind"], [ids.id(kind) for kind in _ASSOCIATIONS])
                 & np.isin(rows["entity"], rows["entity"][about])
                 & (own_ns.min() <= times_ns) & (times_ns <= own_ns.max()))
    found = rows[about | meanwhile]
    again = ("its reader asks for it after the next heartbeat" if ids.id("acknack") in names
             else "sent again at its retransmission timeout, or when TCP finds out sooner")
    return [_step(row, names, again) for row in found]


def _in_order(rows: np.ndarray, sent: np.ndarray) -> np.ndarray:
    """The places of rows ``sent`` in the order of the messages: those that a host sent in one
    instant, some of them in batches, by their numbers there."""
    times, hosts, seqs = (rows[column][sent] for column in ("t_ns", "entity", "b"))
    ordered = np.empty_like(sent)
    ordered[np.lexsort((sent, hosts, times))] = sent[np.lexsort((seqs, hosts, times))]
    return ordered


def _step(row: np.void, names: Mapping[int, str], again: str) -> Step:
    """A row as a step. ``again``: the fate of a lost frame, in words."""
    kind, where = names[int(row["kind"])], names[int(row["entity"])]
    a, c = int(row["a"]), int(row["c"])
    detail = {
        "sent": lambda: f"{names[a]}, {c} B",
        "frame": lambda: f"to {names.get(a, a)}, {c} B with headers",
        "lost": lambda: f"{names[c]}; {again}",
        "delivered": lambda: f"{c / 1e6:.6f} ms after it was sent",
        "dropped": lambda: names[c],
        "callback": lambda: names[c],
        "read": lambda: names[c],
        "overwritten": lambda: "the queue was full",
        "repeated": lambda: "a copy",
        "associated": lambda: names[a],
        "disassociated": lambda: names.get(a, "no access point"),
    }.get(kind, lambda: f"{c} receivers")()
    return Step(int(row["t_ns"]), kind, where, detail)
