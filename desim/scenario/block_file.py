"""A parameter block in a YAML file of its own; every error at once, with its place."""

from __future__ import annotations

from dataclasses import dataclass

from desim.errors import InputError
from desim.ports import Params
from desim.scenario import yaml12
from desim.scenario.complaints import lines, validated
from desim.scenario.source_places import Places


@dataclass(frozen=True)
class PlacedBlock:
    """A block, and where each of its keys was written."""

    params: Params
    places: Places

    def placed(self, error: InputError) -> InputError:
        """An error that was found when the block was used, with places: a line that begins with a
        dot and a path, ``.flows.0.to: ...``, gets the place of that path, any other line the name
        of the file."""
        return InputError(*(self._placed(str(line)) for line in error.args))

    def _placed(self, line: str) -> str:
        if not line.startswith("."):
            return f"{self.places.root.source}: {line}"
        path, _, rest = line[1:].partition(": ")
        return f"{self.places.where(path)}: {rest}"


def read(path: str, block: type[Params]) -> PlacedBlock:
    """The block in the file. Raises ``InputError`` with one line for each thing that is wrong."""
    data, places = yaml12.read(path)
    result = validated(block, data)
    if isinstance(result, list):
        raise InputError(*lines(result, places))
    return PlacedBlock(result, places)
