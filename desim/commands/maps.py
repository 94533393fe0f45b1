"""The command that reads terrains in the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from desim.commands.exit_codes import exit_codes
from desim.commands.output import say, say_json


def map_(file: Annotated[Path, typer.Argument(metavar="FILE", show_default=False, help=(
             "a map of ROS, a floor plan, a building or a world"))],
         to: Annotated[Path | None, typer.Option(
             metavar="FILE", show_default=False,
             help="a scenario (.yaml) or a map of ROS (.pgm) to write")] = None,
         figure: Annotated[Path | None, typer.Option(
             metavar="FILE", show_default=False, help="picture to write: png, pdf or svg")] = None,
         level: Annotated[str | None, typer.Option(
             show_default="the first with walls", help="of a building with several")] = None,
         resolution: Annotated[float | None, typer.Option(
             min=0.001, max=10.0, show_default=False,
             help="width in m of an image's pixel, or of a cell of the map to write")] = None,
         scale: Annotated[float | None, typer.Option(
             min=1e-6, max=1e6, show_default=False, help="a drawing's unit in m")] = None,
         height: Annotated[float | None, typer.Option(
             min=0.01, max=1000.0, show_default=False, help="of walls in m")] = None,
         material: Annotated[str | None, typer.Option(
             show_default=False, help="of walls, for the radio")] = None,
         as_json: Annotated[bool, typer.Option("--json", help="one JSON object")] = False) -> None:
    """Read a terrain, say what it has, draw it, and write a scenario or a map of ROS."""
    with exit_codes():
        from desim.commands.views.terrain import facts, text
        from desim.imports.terrains import written
        from desim.imports.terrains.found import Choices
        from desim.imports.terrains.read import read_terrain

        if to is not None:
            written.check_target(to)
        if material is not None:
            from desim.ports import materials

            materials.index(material, "--material")
        kind, found = read_terrain(file, Choices(level, resolution, scale, height, material))
        known = facts(kind, found)
        files = []
        if to is not None:
            files += (written.write_scenario(found, file.name, to) if to.suffix != ".pgm" else
                      written.write_map(found.terrain, to, resolution))
        if figure is not None:
            from desim.report.terrain_figure import draw_terrain

            draw_terrain(found, file.name, figure)
            files.append(figure)
        if as_json:
            say_json({"file": str(file), **known, "written": [str(path) for path in files]})
        else:
            say(text(file, known, files))

