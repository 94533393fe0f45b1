"""Lines on the terminal."""

from __future__ import annotations

import json

import typer

from desim.errors import printable


def say(text: str, err: bool = False) -> None:
    """Print a line, or several. Control characters of foreign text are escaped."""
    typer.echo(printable(text), err=err)


def say_json(value: object) -> None:
    """Print a JSON object."""
    say(json.dumps(value, indent=2))
