"""The files to start from a shipped scenario: its own, those that it refers to, and the schema."""

from __future__ import annotations

import json
from pathlib import Path

from desim.scenario.json_schema import json_schema
from desim.scenario.shipped import belongings, folder

SCHEMA = "scenario.schema.json"
_SAME = 90  # letters that the schemas of all versions begin with: dialect and title

Texts = dict[Path, str]  # of files, by path


def texts(name: str) -> Texts:
    """The texts of the shipped scenario ``name``, of what it refers to, and of the schema.
    Raises ``InputError`` where there is none of this name."""
    found = {file: (folder() / file).read_text("utf-8").replace("scenarios/", "")
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
