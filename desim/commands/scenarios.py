"""The command that writes a scenario to start from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from desim.commands import completion
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say

if TYPE_CHECKING:
    from desim.commands.views.starters import Texts


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
        from desim.commands.views import starters

        if name is None:
            say(starters.listing())
            return
        texts = starters.texts(name)
        _write(texts, to, force)
        say(starters.next_steps(to, texts))


def _write(texts: Texts, to: Path, force: bool) -> None:
    """Write all files, or none where one would be replaced by another. Raises ``InputError``."""
    from desim.commands.views.starters import is_schema
    from desim.errors import InputError
    from desim.files import replacing

    other = [str(to / file) for file, text in texts.items() if not force
             and (to / file).exists() and (to / file).read_bytes() != text.encode()
             and not is_schema(to / file)]
    if other:
        raise InputError(f"{', '.join(other)}: already there, with other content; allowed: another "
                         "folder (--to FOLDER), or --force to replace it")
    try:
        for file, text in texts.items():
            (to / file).parent.mkdir(parents=True, exist_ok=True)
            with replacing(to / file) as beside:
                beside.write_text(text)
    except OSError as error:
        raise InputError(f"{error.filename or to}: cannot be written: {error.strerror or error}"
                         ) from error
