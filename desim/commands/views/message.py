"""The story of one message, row by row, and where its time went; and lists of messages."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
from rich.console import Console

from desim.commands.views.message_rows import story
from desim.commands.views.why import show_message
from desim.engine.trace import Names
from desim.errors import InputError
from desim.results import tables
from desim.results.file_names import MESSAGES
from desim.results.ledger import trace_and_ledger
from desim.results.message_log import DELIVERED
from desim.results.run import Run, readable
from desim.results.traces import spools
from desim.results.why import fates
from desim.units import NS_PER_S

_LISTED = 40  # a screen
_READ_WITHIN_NS = NS_PER_S  # nodes look at what they keep at least so often


def show_story(run: Run, number: int, console: Console) -> None:
    """Print the story of message ``number`` of a run. Where its rows were not kept,
    the run is repeated until the message was read. Raises ``InputError`` if there is no such
    message."""
    path = run.path
    with spools() as folder:
        (rows, names), ledger = trace_and_ledger(run, folder / "trace", _read_by_ns(run, number))
        steps = story(rows, names, number)
        if not steps:
            last = np.count_nonzero(rows["kind"] == Names().id("sent"))
            raise InputError(f"{path}: no message {number}; a run's messages between hosts have "
                             f"the numbers 1 to {last}")
    born_ns = steps[0].time_ns
    for step in steps:
        _print(console, f"{step.time_ns / 1e9:16.9f} s  {(step.time_ns - born_ns) / 1e6:+14.6f} ms"
                        f"  {step.what:<12} {step.where:<16} {step.detail}")
    if ledger is None:
        _print(console, f"\nwhere its time went (the run is repeated): desim why {path} --message "
                        f"{number}")
        return
    found = fates(ledger.filter(pc.equal(ledger["number"], number)))
    for fate in found:
        _print(console)
        show_message(fate, console)
    if not found:
        _print(console, "\nit had not reached its fate when the run ended")


def _print(console: Console, line: str = "") -> None:
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def _read_by_ns(run: Run, number: int) -> int | None:
    """An instant when the message was read, where the run has kept messages."""
    if not run.keeps(MESSAGES):
        return None
    rows = run.table("messages", ("number", "end_ns"))
    ends_ns = rows["end_ns"][rows["number"] == number].tolist()
    return max((end_ns + _READ_WITHIN_NS for end_ns in ends_ns), default=None)


def message_list(path: Path, topic: str | None, dropped: bool, at_ns: int | None) -> str:
    """The first messages of the run in ``path`` that are of ``topic``, dropped, or under way at
    ``at_ns``, a line for each receiver. Raises ``InputError`` where messages were not kept."""
    run = Run(path)
    if not run.has(MESSAGES):
        raise InputError(f"{path}: its messages were not kept; run it with trace.keep: messages")
    with readable(run.file(MESSAGES)) as file:
        rows = tables.read(file).to_pylist()
    asked = [row for row in rows
             if (topic is None or fnmatchcase(row["topic"], topic))
             and (at_ns is None or row["born_ns"] <= at_ns <= row["end_ns"])]
    found = [row for row in asked if not dropped or row["fate"] != DELIVERED]
    found.sort(key=lambda row: (row["number"], row["destination"]))
    lines = [f"{row['number']:>8}  {row['born_ns'] / 1e9:12.6f} s  "
             f"{(row['end_ns'] - row['born_ns']) / 1e6:12.3f} ms  {row['topic']}  {row['source']} "
             f"-> {row['destination']}  {row['reason'] or row['fate']}" for row in found[:_LISTED]]
    if not rows:
        return "no message between hosts had reached its fate when the run ended"
    if not found:
        if asked:
            return f"none of {len(asked)} messages was dropped"
        return (f"none of {len(rows)} messages; topics are "
                f"{', '.join(sorted({row['topic'] for row in rows})[:_LISTED])}")
    head = f"{'message':>8}  {'published at':>14}  {'after':>15}  topic, from -> to, fate"
    more = [f"and {len(found) - _LISTED} more"] if len(found) > _LISTED else []
    return "\n".join([head, *lines, *more])
