"""The values of a design that are paths of files or modules.

Their type in the scenario or in the design decides, and not which files exist.
"""

from __future__ import annotations

from collections.abc import Iterator

from desim import plugins
from desim.campaign.design.design import LoadedDesign
from desim.scenario.merge import choice_at
from desim.scenario.plugin_choices import file_keys
from desim.scenario.schema.communication import RuleChoice
from desim.scenario.schema.environment import BUILT_IN_TERRAINS
from desim.scenario.source_places import Path, items, path_of

# Of the scenario; others are parameters of plug-ins, and what these are named by.
_FILES = (("environment", "terrain"), ("environment", "terrain", "map"), ("fleet", "start", "file"))
_MODULES = (("stop", "when"), ("physics", "model"))


class FilePaths:
    """The paths in one design."""

    def __init__(self, loaded: LoadedDesign) -> None:
        self._design = loaded.design
        self._data = loaded.design.model_dump(mode="json", by_alias=True)
        # Dotted names of plug-ins, wherever they stand.
        self._named = dict.fromkeys(text for part in (self._data, loaded.base[0])
                                    for _, text in leaves(part, ()) if ":" in text)

    def has(self, path: Path, text: str) -> bool:
        """Whether ``text``, which stands at ``path`` of the design, is a path."""
        if path[0] == "metrics" or path == ("vectors", "function"):
            return ":" in text
        return any(self._is_path(place, text) for place in self._places(path))

    def _places(self, path: Path, met: tuple[str, ...] = ()) -> Iterator[Path]:
        """The paths within the scenario that a value of the design sets. ``met``: the parameters on
        the way."""
        family, *rest = path
        if family == "set":
            yield (*path_of(str(rest[0])), *rest[1:])
        elif family in ("stop", "measure"):
            yield (family, *path_of(str(rest[0])), *rest[1:])
        elif family == "parameters" and rest[1:2] == ["levels"] and len(rest) > 3:
            yield (*path_of(str(rest[3])), *rest[4:])
        elif family == "parameters" and rest[1:2] == ["values"] and len(rest) > 2:
            yield from self._of_parameter(str(rest[0]), tuple(rest[3:]), met)
        elif family == "vectors" and len(rest) > 1:
            yield from self._of_parameter(str(rest[1]), tuple(rest[2:]), met)

    def _of_parameter(self, name: str, below: Path, met: tuple[str, ...]) -> Iterator[Path]:
        """The paths that a parameter sets: its own key, and its uses as ``$name``."""
        if name in met:
            return
        key = getattr(self._design.parameters.get(name), "key", None)
        if key is not None:
            yield (*path_of(key), *below)
        for path, text in leaves(self._data, ()):
            if text == f"${name}":
                for place in self._places(path, (*met, name)):
                    yield (*place, *below)

    def _is_path(self, place: Path, text: str) -> bool:
        if place in _FILES:
            return text not in BUILT_IN_TERRAINS
        if place in _MODULES:
            return ":" in text
        block = place[:-1]
        choice = RuleChoice if block[-2:-1] == ("rules",) else choice_at(block)
        if choice is None:
            return False
        if place[-1] == choice.name_key:
            return ":" in text
        return any(place[-1] in file_keys(choice.kind, name)
                   for name in (*plugins.available(choice.kind), *self._named))


def leaves(data: object, path: Path) -> Iterator[tuple[Path, str]]:
    """The texts in ``data``, which stands at ``path``, with their own paths."""
    if isinstance(data, str):
        yield path, data
    for step, below in items(data):
        yield from leaves(below, (*path, step))
