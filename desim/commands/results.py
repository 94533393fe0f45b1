"""The commands about several results: their list, and two of them compared."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands import completion
from desim.commands.arguments import RunPath, Trust
from desim.commands.compiling import compiling
from desim.commands.exit_codes import reading
from desim.commands.output import say, say_json


def ls(folder: Annotated[Path, typer.Argument(
           help="the folder of results, of one scenario, or of a campaign, whose runs are then "
                "listed")] = Path("results"),
       as_json: Annotated[bool, typer.Option("--json", help="a list of JSON objects")] = False,
       ) -> None:
    """List the runs and campaigns in a folder, newest first; damaged folders, too."""
    with reading():
        from desim.campaign.folder.results_list import listed

        found = listed(folder)
        if as_json:
            say_json([entry.json_object() for entry in found])
        else:
            from desim.commands.views.results_list import show

            show(folder, found)


def check(folder: Annotated[Path, typer.Argument(metavar="FOLDER", show_default=False,
                                                 autocompletion=completion.result_folders,
                                                 help="the folder of a run or a campaign")],
          ) -> None:
    """Say what of a run or a campaign is whole, was healed, or is missing.

    Exit code 1 if not all is whole. Every file is compared with the digest that the run's manifest
    has of it. Nothing is changed.
    """
    with reading():
        from desim.campaign.folder.check import checked

        found = checked(folder)
        say("\n".join([f"{folder}: {found.lines[0]}", *found.lines[1:], *found.wrong]))
        if found.wrong:
            raise typer.Exit(1)


def compare(first: Annotated[Path, typer.Argument(metavar="FIRST", show_default=False,
                                                  autocompletion=completion.result_folders,
                                                  help="the folder of a run or a campaign")],
            second: Annotated[Path, typer.Argument(metavar="SECOND", show_default=False,
                                                   autocompletion=completion.result_folders,
                                                   help="another one of the same kind")],
            as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
            ) -> None:
    """Two runs or two campaigns side by side: keys that differ, metrics, when the robots part."""
    with reading():
        with compiling(as_json):
            from desim.campaign.folder.comparison import compare as compared
            from desim.commands.views import comparison
        found = compared(first, second)
        if as_json:
            say_json(found.json_object())
        else:
            comparison.show(found)


def diff(first: RunPath, second: RunPath, trust: Trust = False) -> None:
    """The first trace row in which two runs differ; exit code 1 if there is one."""
    with reading(trust):
        with compiling(False):
            from desim.commands.views.differences import difference
        text = difference(first, second, trust)
        say(text or "the traces are equal")
        if text:
            raise typer.Exit(1)
