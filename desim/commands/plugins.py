"""The commands that list and describe plug-ins, and print the schema of scenarios."""

from __future__ import annotations

from typing import Annotated

import typer

from desim.commands import completion
from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json


def plugins() -> None:
    """All plug-ins that are installed, by kind."""
    with exit_codes():
        from desim.commands.views.catalogue import listing

        say(listing())


def describe(plugin: Annotated[str, typer.Argument(
        metavar="PLUGIN", show_default=False, autocompletion=completion.plugin_names,
        help="a name that desim plugins lists, a card of a radio, or package.module:Class")]
        ) -> None:
    """Describe a plug-in and its parameters."""
    with exit_codes():
        from desim.commands.views.catalogue import description

        say(description(plugin))


def schema() -> None:
    """The JSON Schema of scenario files, for editors."""
    with exit_codes():
        from desim.scenario.json_schema import json_schema

        say_json(json_schema())
