"""Walls of generated terrains, in the form that a scenario has them written out."""

from __future__ import annotations

from desim.ports.terrain import Wall
from desim.scenario.schema.generated import Maze, Office

Point = tuple[float, float]  # x m, y m


def length(value_m: float) -> str:
    """A length or a position as a scenario has it, to the micrometre."""
    return f"{round(value_m, 6) + 0.0} m"


def wall(plan: Maze | Office, start: Point, end: Point) -> Wall:
    """A wall of the plan's material from ``start`` to ``end``."""
    return Wall.model_validate({
        "from": (length(start[0]), length(start[1])), "to": (length(end[0]), length(end[1])),
        "material": plan.material, "thickness": length(plan.thickness_m)})
