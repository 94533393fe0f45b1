"""The command that writes a scenario to start from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands import completion
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say

if TYPE_CHECKING:
    from desim.scenario.starter import Texts


def new(name: Annotated[str | None, typer.Argument(
            metavar="SCENARIO", show_default=False, autocompletion=completion.shipped_names,
            help="a name that desim new lists")] = None,
        to: Annotated[Path, typer.Option(help="the folder to write into")] = Path(),
        force: Annotated[bool, typer.Option("--force", help="replace files that differ")] = False,
        ) -> None:
    """Write a scenario to start from, with the files that it needs; without a name, list them.

    Beside it stands the schema of scenarios, so that an editor with yaml-language-server completes
    and checks its keys.
    """
    with exit_codes():
        from desim.commands.views import shipped

        if name is None:
            say(shipped.listing())
            return
        from desim.scenario.starter import texts

        written = texts(name)
        _write(written, to, force)
        say(shipped.next_steps(to, written))


def _write(texts: Texts, to: Path, force: bool) -> None:
    """Write all files, or none where one would be replaced by another. Raises ``InputError``."""
    from desim.errors import InputError, unwritable
    from desim.files import replacing

    other = [str(to / file) for file, text in texts.items()
             if not force and _has_other_content(to / file, text)]
    if other:
        raise InputError(f"{', '.join(other)}: already there, with other content; allowed: another "
                         "folder (--to FOLDER), or --force to replace it")
    for file, text in texts.items():
        try:
            (to / file).parent.mkdir(parents=True, exist_ok=True)
            with replacing(to / file) as beside:
                beside.write_text(text)
        except OSError as error:
            raise InputError(f"{unwritable(to / file, error)}; another folder: --to FOLDER"
                             ) from error


def _has_other_content(file: Path, text: str) -> bool:
    """Whether there is something that is neither ``text`` nor a schema that desim wrote."""
    from desim.scenario.starter import is_schema

    try:
        return os.path.exists(file) and file.read_bytes() != text.encode() and not is_schema(file)
    except OSError:  # a folder, or it cannot be read
        return True
