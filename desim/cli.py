"""The command ``desim``; the commands themselves stand in ``commands/``."""

from __future__ import annotations

import typer

from desim.commands import campaigns, deployments, networks, plugins, runs
from desim.commands.usage import Commands

app = typer.Typer(cls=Commands, no_args_is_help=True, add_completion=False,
                  pretty_exceptions_enable=False,
                  help="Simulate a fleet of robots and the networks between them, on one clock.")
for family in runs, campaigns, deployments, networks, plugins:
    family.add_to(app)

if __name__ == "__main__":
    app()
