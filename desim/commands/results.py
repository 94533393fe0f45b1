"""The commands about several results: their list, and two of them compared."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands import completion
from desim.commands.arguments import RunPath
from desim.commands.compiling import compiling
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json


def ls(folder: Annotated[Path, typer.Argument(
           help="the folder of results, of one scenario, or of a campaign, whose runs are then "
                "listed")] = Path("results"),
       as_json: Annotated[bool, typer.Option("--json", help="a list of JSON objects")] = False,
       ) -> None:
    """List the runs and campaigns in a folder, newest first; damaged folders, too."""
    with exit_codes():
        from desim.campaign.folder.results_list import listed

        found = listed(folder)
        if as_json:
            say_json([entry.json_object() for entry in found])
        else:
            from desim.commands.views.results_list import show

            show(folder, found)


def compare(first: Annotated[Path, typer.Argument(metavar="FIRST", show_default=False,
                                                  autocompletion=completion.result_folders,
                                                  help="the folder of a run or a campaign")],
            second: Annotated[Path, typer.Argument(metavar="SECOND", show_default=False,
                                                   autocompletion=completion.result_folders,
                                                   help="another one of the same kind")],
            as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False,
            ) -> None:
    """Two runs or two campaigns side by side: keys that differ, metrics, when the robots part."""
    with exit_codes():
        with compiling(as_json):
            from desim.campaign.folder.comparison import compare as compared
            from desim.commands.views import comparison
        found = compared(first, second)
        if as_json:
            say_json(found.json_object())
        else:
            comparison.show(found)


def diff(first: RunPath, second: RunPath) -> None:
    """The first trace row in which two runs differ; exit code 1 if there is one."""
    with exit_codes():
        with compiling(False):
            from desim.commands.views.differences import difference
        text = difference(first, second)
        say(text or "the traces are equal")
        if text:
            raise typer.Exit(1)
