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
    from desim.imports.terrains.found import Choices
    from desim.scenario.starter import Texts


def new(name: Annotated[str | None, typer.Argument(
            metavar="SCENARIO", show_default=False, autocompletion=completion.shipped_names,
            help="a name that desim new lists; with --from: the scenario's own")] = None,
        from_: Annotated[Path | None, typer.Option(
            "--from", metavar="FILE", show_default=False,
            help="a map, a floor plan, a building or a world for the scenario to stand on")] = None,
        robots: Annotated[str, typer.Option(metavar="TYPE", help="of --from")] = "pioneer3dx",
        resolution: Annotated[float | None, typer.Option(
            min=0.001, max=10.0, show_default=False,
            help="of --from: width in m of an image's pixel")] = None,
        scale: Annotated[float | None, typer.Option(
            min=1e-6, max=1e6, show_default=False, help="of --from: a drawing's unit in m")] = None,
        level: Annotated[str | None, typer.Option(
            show_default=False, help="of --from: of a building, or layers of a drawing")] = None,
        to: Annotated[Path, typer.Option(help="the folder to write into")] = Path(),
        force: Annotated[bool, typer.Option("--force", help="replace files that differ")] = False,
        ) -> None:
    """Write a scenario to start from, with the files that it needs; without a name, list them.

    Beside it stands the schema of scenarios, so that an editor with yaml-language-server completes
    and checks its keys. With --from it stands on a terrain of yours, with two robots.
    """
    with exit_codes():
        from desim.commands.views import shipped

        if from_ is not None:
            from desim.imports.terrains.found import Choices

            stem = name or f"{from_.name.partition('.')[0]}_fleet"
            path = to / f"{stem}.yaml"
            say(_start_on(from_, Choices(level, resolution, scale), robots, path, force))
            return
        if name is None:
            say(shipped.listing())
            return
        from desim.scenario.starter import texts

        written = texts(name)
        _write(written, to, force)
        say(shipped.next_steps(to, written))


def _start_on(file: Path, choices: Choices, robots: str, path: Path, force: bool) -> str:
    """Write a scenario on the terrain in a file; the next steps. Raises ``InputError``."""
    from desim.commands.views.shipped import written_steps
    from desim.errors import InputError, did_you_mean
    from desim.files import writing
    from desim.imports.terrains.read import read_terrain
    from desim.imports.terrains.written import write_scenario
    from desim.scenario.schema.built_in_robots import BUILT_IN_TYPES

    if robots not in BUILT_IN_TYPES:
        raise InputError(f"--robots: unknown type {robots!r}{did_you_mean(robots, BUILT_IN_TYPES)};"
                         f" allowed: {', '.join(BUILT_IN_TYPES)}")
    if path.exists() and not force:
        raise InputError(f"{path}: already there; allowed: another name (desim new NAME --from "
                         "FILE), another folder (--to FOLDER), or --force to replace it")
    _, found = read_terrain(file, choices)
    with writing(path, "--to"):
        path.parent.mkdir(parents=True, exist_ok=True)
    files = write_scenario(found, file.name, path, robots)
    return "\n".join([*(f"note: {note}" for note in found.notes), written_steps(files)])


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
                beside.write_text(text, "utf-8")
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
