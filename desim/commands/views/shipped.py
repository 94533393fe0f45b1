"""The shipped scenarios in words: their list, and the next steps with one that was written."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from desim.scenario.shipped import shipped
from desim.scenario.starter import Texts

_ABOUT = {"desim run": "scenarios, of one run (desim run)",
          "desim loop": "real programs on the networks of a scenario (desim loop)",
          "desim sweep": "designs, of many runs (desim sweep)",
          "desim net layout": "layouts of a network without robots (desim net layout)"}


def listing() -> str:
    """All that is shipped, each with its question."""
    parts = []
    for command, group in groupby(shipped(), lambda one: one.command):
        rows = [(one.name, one.question) for one in group]
        width = max(len(name) for name, _ in rows)
        parts.append("\n".join([_ABOUT[command],
                                *(f"  {name:<{width}}  {text}" for name, text in rows)]))
    return "\n\n".join([*parts, "desim new NAME writes one to start from"])


def next_steps(to: Path, written: Texts) -> str:
    """The written files, and the command that plays the first of them."""
    name = next(iter(written)).with_suffix("").as_posix()
    command = next(one.command for one in shipped() if one.name == name)
    return written_steps([to / file for file in written], command)


def written_steps(files: Sequence[Path], command: str = "desim run") -> str:
    """Files that were written, and the command that plays the first of them."""
    first, *others = map(str, files)
    beside = f", and beside it {', '.join(others)}" if others else ""
    return f"wrote {first}{beside}\nplay it: {command} {shlex.quote(first)}"
