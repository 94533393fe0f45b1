"""The beliefs of all hosts about each other, beside the truth: in words, and as JSON."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import groupby

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from desim.results.beliefs import BeliefSnapshot, PairBelief
from desim.units import NS_PER_S

SIGNS = {"online": "+", "offline": "-", "removed": "x", "never": "."}
LISTED = 30  # of ghosts, and of missing matches: a screen


def show(beliefs: BeliefSnapshot, console: Console) -> None:
    """Print the matrix and the lists of what is wrong."""
    table = matrix(beliefs)
    if console.is_terminal and _width(table, console) > console.width:
        table = matrix(beliefs, narrow=True)
    console.width = max(console.width, _width(table, console))
    console.print(beliefs.headline, style="bold", highlight=False, soft_wrap=True)
    console.print(truth(beliefs), highlight=False, soft_wrap=True)
    console.print(table)
    console.print(Text("+ seen online, - offline, x removed, . never seen; known/true matches of "
                       f"the {beliefs.informed} with the other host; !n ghosts", style="dim"),
                  soft_wrap=True)
    for name, lines in (("mistaken", mistaken(beliefs)), ("ghosts", ghosts(beliefs)),
                        ("missing", missing(beliefs))):
        if lines:
            console.print(f"\n{name}:", style="bold", highlight=False)
            for line in lines[:LISTED]:
                console.print(f"  {line}", highlight=False, soft_wrap=True, markup=False)
            if len(lines) > LISTED:
                console.print(f"  and {len(lines) - LISTED} more (--json has all)",
                              highlight=False)


def truth(beliefs: BeliefSnapshot) -> str:
    """The parts of the fleet that can reach each other, in words."""
    parts = beliefs.parts
    if parts is None:
        return "in truth: who could reach whom was not kept"
    if len(parts) <= 1:
        return "in truth: every host that is up can reach every other one, directly or over others"
    return f"in truth apart: {' | '.join(_names(part, list(beliefs.up)) for part in parts)}"


def matrix(beliefs: BeliefSnapshot, narrow: bool = False) -> Table:
    """The beliefs as a table, one row per believer and one column per host. ``narrow``:
    without numbers."""
    table = Table(box=None, padding=(0, 1, 0, 0) if narrow else (0, 2, 0, 0))
    table.add_column("believes", no_wrap=True, style="cyan")
    for host, up in beliefs.up.items():
        # A name under its kind: "robot" over "12".
        table.add_column(Text(host.replace("_", "\n"), style="" if up else "strike dim"))
    views = {(view.believer, view.other): view for view in beliefs.views}
    for believer, up in beliefs.up.items():
        cells = [cell(views[believer, other], narrow) if up and other != believer else Text("")
                 for other in beliefs.up]
        table.add_row(believer if up else f"{believer} (stopped)", *cells)
    return table


def cell(view: PairBelief, narrow: bool = False) -> Text:
    """A cell such as ``+ 2/3 !1``: seen online, two of three matches known, one ghost."""
    style = "red" if view.ghosts else "yellow" if view.missing else "green" if view.known else "dim"
    text = SIGNS.get(view.sees, view.sees)
    matches = len(view.known) + len(view.missing)
    if not narrow:
        text += f" {len(view.known)}/{matches}" if matches else ""
        text += f" !{len(view.ghosts)}" if view.ghosts else ""
    return Text(text, style=style)


def mistaken(beliefs: BeliefSnapshot) -> list[str]:
    """The hosts that are believed to be online and are not, or the other way round, in words."""
    truth = {False: "has stopped", True: "is out of reach"}  # by whether it is up
    return [f"{believers} {_verb('take', several)} {others} for {seen}"
            for believers, several, others, seen in _grouped(beliefs, (
                (view, f"{view.sees}, which "
                       f"{'is in reach' if view.reached else truth[beliefs.up[view.other]]}")
                for view in beliefs.views if view.mistaken))]


def ghosts(beliefs: BeliefSnapshot) -> list[str]:
    """The matches that are believed in and do not exist, in words."""
    return [f"{believers} {_verb('believe', several)} that {others} {_does(beliefs, others)} "
            f"{topic}"
            for believers, several, others, topic in _grouped(beliefs, (
                (view, f"{topic}{'' if beliefs.up[view.other] else ' (stopped)'}")
                for view in beliefs.views for topic in view.ghosts))]


def missing(beliefs: BeliefSnapshot) -> list[str]:
    """The matches of which one end does not know, in words."""
    return [f"{believers} {'do' if several else 'does'} not know that {others} "
            f"{_does(beliefs, others)} {topic}"
            for believers, several, others, topic in _grouped(beliefs, (
                (view, topic) for view in beliefs.views for topic in view.missing))]


def _grouped(beliefs: BeliefSnapshot, entries: Iterable[tuple[PairBelief, str]]
             ) -> list[tuple[str, bool, str, str]]:
    """The entries, similar ones together: the believers in words, whether they are several, the
    other hosts in words, and the rest, in which ``*`` stands for the other host's name."""
    of: dict[tuple[str, str], list[str]] = {}  # believer and rest, to others
    for view, rest in entries:
        of.setdefault((view.believer, _starred(rest, view.other)), []).append(view.other)
    alike: dict[tuple[str, tuple[str, ...]], list[str]] = {}  # rest and others, to believers
    for (believer, rest), others in of.items():
        alike.setdefault((rest, tuple(others)), []).append(believer)
    hosts = list(beliefs.up)
    return [(_names(believers, hosts), len(believers) > 1, _names(list(others), hosts),
             rest.replace("which is", "which are").replace("which has", "which have")
             if len(others) > 1 else rest.replace("*", others[0]))
            for (rest, others), believers in alike.items()]


def _starred(topic: str, host: str) -> str:
    """``/*/scan`` of robot_1's ``/robot_1/scan``; ``/robot_12/scan`` belongs to another host."""
    return re.sub(rf"\b{re.escape(host)}\b", "*", topic)


def _verb(verb: str, several: bool) -> str:
    return verb if several else f"{verb}s"


def json_object(beliefs: BeliefSnapshot) -> dict[str, object]:
    """The beliefs and the truth as an object for ``--json``."""
    return {"at_s": beliefs.at_ns / NS_PER_S, "informed": beliefs.informed,
            "matches": beliefs.known + beliefs.missing, "known": beliefs.known,
            "missing": beliefs.missing, "ghosts": beliefs.ghosts,
            "divergence": beliefs.divergence, "seen": beliefs.seen,
            "mistaken": None if beliefs.parts is None else beliefs.mistaken,
            "parts": beliefs.parts, "up": beliefs.up,
            "views": [view._asdict() for view in beliefs.views]}


def _names(part: list[str], hosts: list[str]) -> str:
    """The names of a part, such as ``base, robot_0 to robot_7``."""
    spans = []
    for _, members in groupby(enumerate(part), lambda entry: (
            hosts.index(entry[1]) - entry[0], entry[1].rpartition("_")[0])):
        names = [host for _, host in members]
        spans += names if len(names) < 3 else [f"{names[0]} to {names[-1]}"]
    return ", ".join(spans)


def _does(beliefs: BeliefSnapshot, hosts: str) -> str:
    several = "," in hosts or " to " in hosts
    return (f"{_verb('listen', several)} to" if beliefs.informed == "publisher"
            else _verb("say", several))


def _width(table: Table, console: Console) -> int:
    return Measurement.get(console, console.options.update(max_width=10_000), table).maximum
