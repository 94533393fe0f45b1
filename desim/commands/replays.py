"""The command that shows a run in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands import completion
from desim.commands.compiling import compiling, compiling_inside
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say
from desim.commands.runs import RunPath

PAGE = "replay.html"


def view(path: RunPath,
         other: Annotated[Path | None, typer.Argument(
             metavar="[RUN]", show_default=False, autocompletion=completion.run_folders,
             help="another run, to be shown on the same time line")] = None,
         to: Annotated[Path | None, typer.Option(
             help=f"file to write (default: {PAGE} in the first run's folder)",
             show_default=False)] = None,
         no_open: Annotated[bool, typer.Option(
             "--no-open", help="write the file and do not open it in a browser")] = False) -> None:
    """The replay of a run, or of two on one time line, as one HTML file for a browser."""
    with exit_codes():
        with compiling(False):
            from desim.api import recording_of
            from desim.report.replay.page import write
            from desim.results.run import Run
        runs = [Run(each) for each in (path, other) if each is not None]
        with compiling_inside(False):
            recordings = [recording_of(run) for run in runs]
        target = to or path / PAGE
        write(recordings, target)
        say(str(target))
        if not no_open:
            from desim.commands.browser import open_page

            open_page(target.resolve().as_uri())
