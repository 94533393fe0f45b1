"""The command that reads robots in the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json


def robot(files: Annotated[list[Path], typer.Argument(metavar="FILE...", show_default=False, help=(
              "URDF files, parameters of Nav2 or of ROS 1's navigation; later ones come first"))],
          name: Annotated[str | None, typer.Option(
              show_default="the first file's", help="of the type")] = None,
          to: Annotated[Path | None, typer.Option(
              metavar="FILE", show_default=False, help="a file to write, which a scenario extends"
          )] = None,
          as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False) -> None:
    """Read a robot's description and its navigation's parameters, and write a type of robot."""
    with exit_codes():
        import re

        from desim.commands.views.robot import facts, text
        from desim.imports.robots.read import read_robot, type_of, write

        kinds, found = read_robot(files)
        known = re.sub(r"\W", "_", name or files[0].name.split(".")[0])
        known = known if known[:1].isalpha() else f"robot_{known}"
        facts_of = facts(known, files, kinds, found, type_of(known, found))
        if to is not None:
            write(known, found, [file.name for file in files], to)
        if as_json:
            say_json({**facts_of, "written": None if to is None else str(to)})
        else:
            say(text(facts_of, to))
