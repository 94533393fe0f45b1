"""The place where each key and value of a scenario was written: file, line, column, by path."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

Data = dict[str, Any]  # a mapping as YAML gives it: mappings, lists, text, numbers and null in it
Path = tuple[str | int, ...]
Folder = Callable[[Path], str]  # of the file in which the value at a path was written


class SourcePlace(NamedTuple):
    """``file:line:column``; line 0 is another source as a whole, such as ``--set a.b=1``."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


class Places:
    """The places of each key and its value, by path. For paths that are not its own it asks the
    places ``below``, as far as the data that came with these still have them."""

    def __init__(self, root: SourcePlace, below: tuple[Places, object] | None = None) -> None:
        self.root = root
        self._of: dict[Path, tuple[SourcePlace, SourcePlace]] = {}
        self._below = below

    def put(self, path: Path, key: SourcePlace, value: SourcePlace) -> None:
        """Note where the key (or list item) and the value at ``path`` stand."""
        self._of[path] = (key, value)

    def put_all(self, data: object, place: SourcePlace, path: Path) -> None:
        """Note one place for everything in ``data``, which belongs at ``path``."""
        self.put(path, place, place)
        for step, below in items(data):
            self.put_all(below, place, (*path, step))

    def __contains__(self, path: Path) -> bool:
        """Whether somebody wrote what is at ``path``."""
        return self._at(path) is not None

    def key(self, path: Path) -> SourcePlace:
        """The place of the key at ``path``, or of the nearest thing around it."""
        return self._nearest(path, 0)

    def value(self, path: Path) -> SourcePlace:
        """The place of the value at ``path``, or of the nearest thing around it (its key)."""
        found = self._at(path)
        return found[1] if found else self._nearest(path[:-1], 0)

    def _nearest(self, path: Path, which: int) -> SourcePlace:
        for end in range(len(path), 0, -1):
            if (found := self._at(path[:end])) is not None:
                return found[which]
        return self.root

    def _at(self, path: Path) -> tuple[SourcePlace, SourcePlace] | None:
        found = self._of.get(path)
        if found is None and self._below is not None:
            lower, data = self._below
            return lower._at(path) if _has(data, path) else None
        return found

    def under(self, top: Places, data: object) -> Places:
        """The places of ``data``, which came about by laying ``top`` over this. They are looked up
        on demand: most scenarios of a campaign are right."""
        laid = Places(top.root, (self, data))
        laid._of = top._of
        return laid

    def where(self, path: str) -> str:
        """``file:line:column: path`` for a dotted path such as ``faults.0.at``."""
        return f"{self.value(path_of(path))}: {path}"


def items(data: object) -> list[tuple[str | int, object]]:
    """The keys or indices directly below ``data``, each with its value."""
    if isinstance(data, dict):
        return list(data.items())
    return list(enumerate(data)) if isinstance(data, list) else []


def dotted(path: Path) -> str:
    """``faults.0.at``: the notation of ``--set`` and of all messages."""
    return ".".join(map(str, path))


def path_of(path: str) -> Path:
    """The inverse of ``dotted``."""
    return tuple(int(step) if step.isdecimal() else step for step in path.split("."))


def _has(data: Any, path: Path) -> bool:
    for step in path:
        step = str(step) if isinstance(data, dict) else step
        if not (step in data if isinstance(data, dict) else
                isinstance(data, list) and isinstance(step, int) and step < len(data)):
            return False
        data = data[step]
    return True
