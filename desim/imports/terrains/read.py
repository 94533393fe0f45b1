"""The reader of each format of terrains, and the file that is read by it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from desim.errors import InputError
from desim.files import reading
from desim.imports.terrains import (
    building,
    dxf,
    gazebo,
    moving_ai,
    picture,
    stage,
    svg,
)
from desim.imports.terrains.found import Choices, FoundTerrain, ImportedPlan
from desim.scenario import file_kinds
from desim.scenario.file_kinds import FileKind, kind_of
from desim.scenario.schema.environment import MapFile
from desim.units import LENGTH
from desim.world import sources

# Ground in cells, from a file.
_GRIDS: dict[FileKind, Callable[[Path, Choices], FoundTerrain]] = {
    file_kinds.IMAGE: picture.read,
    file_kinds.MOVING_AI: moving_ai.read,
    file_kinds.STAGE: stage.read,
}
# A plan of walls and blocks, from a file.
_PLANS: dict[FileKind, Callable[[Path, Choices], ImportedPlan]] = {
    file_kinds.BUILDING: building.read,
    file_kinds.SDF: gazebo.read,
    file_kinds.SVG: svg.read,
    file_kinds.DXF: dxf.read,
}
# The choices that a format leaves open, beside height and material.
_OPEN = {file_kinds.BUILDING: {"level", "scale", "resolution_m"},
         file_kinds.SDF: {"resolution_m"}, file_kinds.STAGE: {"resolution_m"},
         file_kinds.IMAGE: {"resolution_m"}, file_kinds.MOVING_AI: {"resolution_m"},
         file_kinds.SVG: {"level", "scale", "resolution_m"},
         file_kinds.DXF: {"level", "scale", "resolution_m"}}
_OPTIONS = {"level": "--level", "resolution_m": "--resolution", "scale": "--scale"}


def read_terrain(path: Path, choices: Choices) -> tuple[FileKind, FoundTerrain]:
    """The terrain in a file of any format that desim knows. Raises ``InputError``."""
    with reading(path):
        kind = kind_of(path)
        if kind is None or kind.command != file_kinds.MAP:
            elsewhere = "" if kind is None else f"; {file_kinds.advice(path)}"
            raise InputError(f"{path}: no terrain{elsewhere}; allowed: "
                             f"{', '.join(known.name for known in formats())}")
        for choice, option in _OPTIONS.items():
            if getattr(choices, choice) is not None and choice not in _OPEN.get(kind, ()):
                raise InputError(f"{option}: {path} is {kind.name}, which leaves no such choice")
        return kind, _read(path, kind, choices)


def formats() -> list[FileKind]:
    """All formats that can be read."""
    return [file_kinds.MAP_SERVER, *_GRIDS, *_PLANS]


def _read(path: Path, kind: FileKind, choices: Choices) -> FoundTerrain:
    if kind == file_kinds.MAP_SERVER:
        return _of_map(path, choices)
    try:
        if kind in _GRIDS:
            return _GRIDS[kind](path, choices)
        plan = _PLANS[kind](path, choices)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    shape = plan.shape(path)
    return FoundTerrain(sources.from_shape(path.name.split(".")[0], shape), shape,
                        tuple(plan.doors), tuple(plan.notes))


def _of_map(path: Path, choices: Choices) -> FoundTerrain:
    given = {"height": None if choices.height_m is None else LENGTH.format(choices.height_m),
             "material": choices.material}
    source = MapFile(map=str(path.absolute()),
                     **{key: value for key, value in given.items() if value is not None})
    terrain = sources.load(source)
    return FoundTerrain(terrain, source, notes=terrain.doubts)
