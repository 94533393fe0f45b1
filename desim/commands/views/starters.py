"""The shipped scenarios: a list of them, and what ``desim new`` writes of one."""

from __future__ import annotations

import json
import shlex
from itertools import groupby
from pathlib import Path

from desim.scenario.json_schema import json_schema
from desim.scenario.shipped import belongings, folder, shipped

SCHEMA = "scenario.schema.json"
_ABOUT = {"desim run": "scenarios, of one run (desim run)",
          "desim sweep": "designs, of many runs (desim sweep)",
          "desim net layout": "layouts of a network without robots (desim net layout)"}

_SAME = 90  # letters that the schemas of all versions begin with: dialect and title

Texts = dict[Path, str]  # of files, by path


def listing() -> str:
    """All that is shipped, each with its question."""
    parts = []
    for command, group in groupby(shipped(), lambda one: one.command):
        rows = [(one.name, one.question) for one in group]
        width = max(len(name) for name, _ in rows)
        parts.append("\n".join([_ABOUT[command],
                                *(f"  {name:<{width}}  {text}" for name, text in rows)]))
    return "\n\n".join([*parts, "desim new NAME writes one to start from"])


def texts(name: str) -> Texts:
    """The texts of the shipped scenario ``name``, of what it refers to, and of the schema.
    Raises ``InputError`` where there is none of this name."""
    found = {file: (folder() / file).read_text().replace("scenarios/", "")
             for file in belongings(name)}
    scenarios = [file for file in found if file.suffix == ".yaml" and len(file.parts) == 1]
    for file in scenarios:
        found[file] = f"# yaml-language-server: $schema={SCHEMA}\n{found[file]}"
    if scenarios:
        found[Path(SCHEMA)] = _schema()
    return found


def is_schema(file: Path) -> bool:
    """Whether this is a schema that ``desim new`` wrote, of whatever version."""
    return file.name == SCHEMA and file.read_bytes().startswith(_schema()[:_SAME].encode())


def _schema() -> str:
    return json.dumps(json_schema(), separators=(",", ":")) + "\n"


def next_steps(to: Path, written: Texts) -> str:
    """The written files, and the command that plays the first of them."""
    first, *others = written
    beside = f", and beside it {', '.join(str(to / file) for file in others)}" if others else ""
    name = first.with_suffix("").as_posix()
    command = next(one.command for one in shipped() if one.name == name)
    return f"wrote {to / first}{beside}\nplay it: {command} {shlex.quote(str(to / first))}"
