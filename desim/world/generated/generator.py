"""The generator of terrains: a plan becomes a shape."""

from __future__ import annotations

import numpy as np

from desim.engine.streams import Streams
from desim.ports import materials
from desim.scenario.schema.environment import Shape
from desim.scenario.schema.generated import FloorPlan, Generated, GeneratedMaze, GeneratedOffice
from desim.world.generated import maze, office, warehouse


def shape_of(source: Generated) -> tuple[str, Shape]:
    """The name of a generated terrain, and the walls and blocks that its plan leads to.

    Raises ``InputError`` for an unknown material.
    """
    if isinstance(source, GeneratedMaze):
        return "maze", maze.shape(source.maze, _numbers(source.maze, "maze"))
    if isinstance(source, GeneratedOffice):
        return "office", office.shape(source.office, _numbers(source.office, "office"))
    return "warehouse", warehouse.shape(source.warehouse, _numbers(source.warehouse, "warehouse"))


def _numbers(plan: FloorPlan, name: str) -> np.random.Generator:
    materials.index(plan.material, f"environment.terrain.{name}.material")
    return Streams(plan.seed)("terrain", name)
