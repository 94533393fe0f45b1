"""The command ``desim``; the commands themselves stand in ``commands/``."""

from __future__ import annotations

import atexit
import gc
import sys
from io import TextIOWrapper
from typing import Annotated

import typer

from desim.commands import (
    campaigns,
    communication,
    exports,
    loops,
    maps,
    networks,
    pictures,
    plugins,
    results,
    robots,
    runs,
    scenarios,
    slam,
)
from desim.commands.usage import Commands

app = typer.Typer(cls=Commands, no_args_is_help=True, pretty_exceptions_enable=False,
                  invoke_without_command=True,
                  help="Simulate a fleet of robots and the networks between them, on one clock.",
                  epilog="Exit codes: 0 done, 1 failed or a check does not hold, 2 wrong input, "
                         "130 interrupted. With --traceback, anywhere, a plug-in's error shows "
                         "its traceback.")


# A terminal that cannot show a character shows a question mark.
for stream in (sys.stdout, sys.stderr):
    if isinstance(stream, TextIOWrapper):
        stream.reconfigure(errors="replace")


@app.callback()
def desim(version: Annotated[bool, typer.Option(
              "--version", help="print the version and end", is_eager=True)] = False) -> None:
    if version:
        from desim import __version__

        typer.echo(f"desim {__version__}")
        raise typer.Exit


# ``net`` reads the options of a case itself.
_UNREAD = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}

# In the order of the help.
for command in (scenarios.new, maps.map_, robots.robot, runs.run, pictures.view,
                communication.trace, communication.why,
                results.diff, pictures.figure, communication.graph, results.ls, results.check,
                results.compare,
                exports.export, exports.import_,
                campaigns.sweep, campaigns.report, campaigns.ladder, campaigns.deploy,
                networks.net, networks.coverage, slam.slam, networks.validate, plugins.plugins,
                plugins.describe, plugins.schema):
    app.command(command.__name__.rstrip("_"),  # import_
                context_settings=_UNREAD if command is networks.net else None)(command)

app.add_typer(loops.app, name="loop")

# Python's end looks for garbage among all that is left: 0.1 s of the 0.7 s of hello.yaml.
atexit.register(gc.freeze)

if __name__ == "__main__":
    app()
