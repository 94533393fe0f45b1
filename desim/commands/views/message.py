"""The story of one message, row by row, with the time of each part; and lists of messages."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq

from desim.commands.views.rows import story
from desim.engine.trace import Names
from desim.errors import InputError
from desim.results.message_log import DELIVERED
from desim.results.run import Run
from desim.results.traces import spools, trace_of
from desim.units import NS_PER_S

_MESSAGES = "messages.parquet"
_LISTED = 40  # a screen
_READ_WITHIN_NS = NS_PER_S  # nodes look at what they keep at least so often


def message_story(path: Path, number: int) -> str:
    """The story of message ``number`` of the run in ``path``; raises ``InputError`` if there is no
    such message. Where rows were not kept, the run is repeated until the message was read."""
    run = Run(path)
    about, until_ns = _fates(run, number)
    with spools() as folder:
        rows, names = trace_of(run, folder / "trace", until_ns)
        steps = story(rows, names, number)
        if not steps:
            last = np.count_nonzero(rows["kind"] == Names().id("sent"))
            raise InputError(f"{path}: no message {number}; a run's messages between hosts have "
                             f"the numbers 1 to {last}")
    born_ns = steps[0].time_ns
    lines = [f"{step.time_ns / 1e9:16.9f} s  {(step.time_ns - born_ns) / 1e6:+14.6f} ms  "
             f"{step.what:<12} {step.where:<16} {step.detail}" for step in steps]
    return "\n".join([*lines, *about])


def message_list(path: Path, topic: str | None, dropped: bool, at_ns: int | None) -> str:
    """The first messages of the run in ``path`` that are of ``topic``, dropped, or under way at
    ``at_ns``, a line for each receiver. Raises ``InputError`` where messages were not kept."""
    run = Run(path)
    if not run.has(_MESSAGES):
        raise InputError(f"{path}: its messages were not kept; run it with trace.keep: messages")
    rows = pq.read_table(run.file(_MESSAGES)).to_pylist()
    asked = [row for row in rows
             if (topic is None or fnmatchcase(row["topic"], topic))
             and (at_ns is None or row["born_ns"] <= at_ns <= row["end_ns"])]
    found = [row for row in asked if not dropped or row["fate"] != DELIVERED]
    found.sort(key=lambda row: (row["number"], row["destination"]))
    lines = [f"{row['number']:>8}  {row['born_ns'] / 1e9:12.6f} s  "
             f"{(row['end_ns'] - row['born_ns']) / 1e6:12.3f} ms  {row['topic']}  {row['source']} "
             f"-> {row['destination']}  {row['reason'] or row['fate']}" for row in found[:_LISTED]]
    if not found:
        if asked:
            return f"none of {len(asked)} messages was dropped"
        return (f"none of {len(rows)} messages; topics are "
                f"{', '.join(sorted({row['topic'] for row in rows})[:_LISTED])}")
    head = f"{'message':>8}  {'published at':>14}  {'after':>15}  topic, from -> to, fate"
    more = [f"and {len(found) - _LISTED} more"] if len(found) > _LISTED else []
    return "\n".join([head, *lines, *more])


def _fates(run: Run, number: int) -> tuple[list[str], int | None]:
    """The parts of the time until each receiver's fate, in words, and an instant when
    it has been read."""
    if not run.has(_MESSAGES):
        return [], None
    rows = pq.read_table(run.file(_MESSAGES), filters=pc.field("number") == number).to_pylist()
    lines = []
    for row in rows:
        name = f"to {row['destination']}: {row['fate']}"
        if row["first_ns"] is None:
            lines.append(f"{name} ({row['reason']}) without a frame")
            continue
        # A lost frame is off the medium long before its message is given up.
        end = "on the medium" if row["fate"] == DELIVERED else "until it was dropped"
        parts = [(row["first_ns"] - row["born_ns"], "in the outbox"),
                 (row["last_ns"] - row["first_ns"], "until its last transmission"),
                 (row["end_ns"] - row["last_ns"], end)]
        where = ", ".join(f"{spent / 1e6:.6f} ms {what}" for spent, what in parts)
        reason = f" ({row['reason']})" if row["reason"] else ""
        lines.append(f"{name}{reason} after {where}")
    return lines, max((row["end_ns"] + _READ_WITHIN_NS for row in rows), default=None)
