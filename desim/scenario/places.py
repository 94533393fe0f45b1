"""Where each thing was written: the place of every key and value, by its path."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

Data = dict[str, Any]  # a mapping as YAML gives it: mappings, lists, text, numbers and null in it
Path = tuple[str | int, ...]
Folder = Callable[[Path], str]  # of the file in which the value at a path was written


class SourcePlace(NamedTuple):
    """``file:line:column``, or another source as a whole (``--set a.b=1``) with line 0."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


class Places:
    """Path to the places of a key and of its value; of what is not its own, those ``below``, as far
    as it is still in the data."""

    def __init__(self, root: SourcePlace, below: tuple[Places, Any] | None = None) -> None:
        self.root = root
        self._of: dict[Path, tuple[SourcePlace, SourcePlace]] = {}
        self._below = below

    def put(self, path: Path, key: SourcePlace, value: SourcePlace) -> None:
        """Note where the key (or list item) and the value at ``path`` stand."""
        self._of[path] = (key, value)

    def put_all(self, data: Any, place: SourcePlace, path: Path) -> None:
        """Everything in ``data``, which belongs at ``path``, comes from one place."""
        self.put(path, place, place)
        for step in steps(data):
            self.put_all(data[step], place, (*path, step))

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

    def under(self, top: Places, data: Any) -> Places:
        """The places of ``data``, which came about by laying ``top`` over this. They are looked for
        when somebody asks: most scenarios of a campaign are right."""
        laid = Places(top.root, (self, data))
        laid._of = top._of
        return laid

    def where(self, path: str) -> str:
        """``file:line:column: path`` for a dotted path such as ``faults.0.at``."""
        return f"{self.value(split(path))}: {path}"


def steps(data: Any) -> list[str | int]:
    """The keys or indices below ``data``."""
    if isinstance(data, dict):
        return list(data)
    return list(range(len(data))) if isinstance(data, list) else []


def dotted(path: Path) -> str:
    """``faults.0.at``: the notation of ``--set`` and of all messages."""
    return ".".join(map(str, path))


def split(path: str) -> Path:
    """The inverse of ``dotted``."""
    return tuple(int(step) if step.isdecimal() else step for step in path.split("."))


def _has(data: Any, path: Path) -> bool:
    for step in path:
        if not (step in data if isinstance(data, dict) else
                isinstance(data, list) and isinstance(step, int) and step < len(data)):
            return False
        data = data[step]
    return True
