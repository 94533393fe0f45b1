"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands import completion

RunPath = Annotated[Path, typer.Argument(metavar="RUN", help="a run's folder", show_default=False,
                                         autocompletion=completion.run_folders)]


def found_file(path: Path) -> Path:
    """The file of a scenario or design that a user calls ``path``."""
    from desim.scenario.shipped import found

    return found(path)


ScenarioPath = Annotated[Path, typer.Argument(
    metavar="SCENARIO", show_default=False, callback=found_file,
    autocompletion=completion.yaml_files,
    help="a scenario's YAML file, or the name of one that desim new lists")]
Until = Annotated[str | None, typer.Option(
    metavar="DURATION", help="short for --set stop.elapsed=DURATION", show_default=False)]
DesignPath = Annotated[Path, typer.Argument(metavar="DESIGN", show_default=False,
                                            autocompletion=completion.yaml_files,
                                            help="a design's YAML file")]
Overrides = Annotated[list[str], typer.Option(
    "--set", metavar="A.B.C=VALUE", help=(
        "a key's value; a mapping is merged into what is there, null takes a named entry away; can "
        "be given again"))]
Trust = Annotated[bool, typer.Option(
    "--trust", help="let code run that the folder names and that is no installed plug-in, where "
                    "the run has to be made again")]
Quiet = Annotated[bool, typer.Option("--quiet", help="print nothing but errors")]
