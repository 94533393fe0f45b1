"""The commands that draw a run: a replay for a browser, a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands import completion
from desim.commands.arguments import RunPath, Trust
from desim.commands.compiling import compiling, compiling_inside
from desim.commands.exit_codes import reading
from desim.commands.output import say
from desim.commands.targets import writing_to

PAGE = "replay.html"


def view(path: RunPath,
         other: Annotated[Path | None, typer.Argument(
             metavar="[RUN]", show_default=False, autocompletion=completion.run_folders,
             help="another run, to be shown on the same time line")] = None,
         to: Annotated[Path | None, typer.Option(
             help=f"file to write (default: {PAGE} in the first run's folder)",
             show_default=False)] = None,
         no_open: Annotated[bool, typer.Option(
             "--no-open", help="write the file and do not open it in a browser")] = False,
         trust: Trust = False) -> None:
    """The replay of a run, or of two on one time line, as one HTML file for a browser."""
    with reading(trust):
        with compiling(False):
            from desim.api import recording_of
            from desim.report.replay.page import write
            from desim.results.run import Run
        runs = [Run(each, trust) for each in (path, other) if each is not None]
        with compiling_inside(False):
            recordings = [recording_of(run) for run in runs]
        with writing_to(to, path / PAGE) as target:
            write(recordings, target)
        say(str(target))
        if not no_open:
            from desim.commands.browser import open_page

            open_page(target.resolve().as_uri())


def figure(path: RunPath,
           to: Annotated[Path | None, typer.Option(
               help="file to write, png, pdf or svg (default: figure.png in the run's folder)",
               show_default=False)] = None) -> None:
    """A picture of a run: terrain, trajectories, map, explored share and traffic over time."""
    with reading():
        with compiling(False):
            from desim.report.run_figure import draw
            from desim.results.run import Run
        with writing_to(to, path / "figure.png") as target:
            draw(Run(path), target)
        say(str(target))
