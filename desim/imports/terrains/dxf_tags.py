"""DXF as text: pairs of a code and a value, in entities, blocks, layers and the header."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from desim.errors import InputError
from desim.files import content
from desim.imports.terrains.found import Point

_MOST_BYTES = 200_000_000
_BINARY = (b"AutoCAD Binary DXF", b"AC10")  # the latter of DWG

Pair = tuple[int, str, int]  # code, value, number of the line with the value


@dataclass(eq=False)
class Entity:
    """An entity: its kind, its pairs and the entities that belong to it (a polyline's vertices)."""

    kind: str
    path: Path
    pairs: list[Pair]
    parts: list[Entity] = field(default_factory=list)

    def text(self, code: int, default: str = "") -> str:
        """The first value of a code."""
        return next((value for at, value, _ in self.pairs if at == code), default)

    def number(self, code: int, default: float = 0.0) -> float:
        """The first value of a code as a number. Raises ``InputError``."""
        return next(self.numbers(code), default)

    def numbers(self, code: int) -> Iterator[float]:
        """All values of a code as numbers. Raises ``InputError``."""
        for at, value, line in self.pairs:
            if at == code:
                try:
                    if math.isfinite(found := float(value)):
                        yield found
                        continue
                except ValueError:
                    pass
                raise InputError(f"{self.path}:{line}: {self.kind}: code {code} must be a number, "
                                 f"got {value!r}")

    def flags(self, code: int = 70) -> int:
        """The bits of a code."""
        return int(self.number(code))

    def point(self, code: int) -> Point:
        """The point whose x has this code."""
        return self.number(code), self.number(code + 10)

    def points(self, code: int) -> list[Point]:
        """All points whose x has this code."""
        return list(zip(self.numbers(code), self.numbers(code + 10), strict=False))


@dataclass(eq=False)
class Document:
    """The content of a file: the header's variables, layers and blocks by name, and entities."""

    variables: dict[str, str] = field(default_factory=dict)
    layers: dict[str, Entity] = field(default_factory=dict)
    blocks: dict[str, Entity] = field(default_factory=dict)
    entities: list[Entity] = field(default_factory=list)


def read(path: Path) -> Document:
    """The file's content. Raises ``InputError`` for another file than a DXF in ASCII."""
    data = content(path, _MOST_BYTES)
    if data.startswith(_BINARY):
        raise InputError(f"{path}: is a binary drawing; save it as DXF in ASCII")
    found = Document()
    section, variable, block = "", "", Entity("", path, [])
    for entity in _entities(path, data):
        if entity.kind == "SECTION":
            section = entity.text(2)
            for code, value, _ in entity.pairs:  # the header is pairs alone
                variable = value if code == 9 else variable
                if code != 9:
                    found.variables.setdefault(variable, value)
        elif section == "TABLES" and entity.kind == "LAYER":
            found.layers[entity.text(2)] = entity
        elif section == "BLOCKS" and entity.kind == "BLOCK":
            block = found.blocks[entity.text(2)] = entity
        elif section == "BLOCKS" and entity.kind not in ("ENDBLK", "ENDSEC"):
            _append(block.parts, entity)
        elif section == "ENTITIES" and entity.kind != "ENDSEC":
            _append(found.entities, entity)
    if not section:
        raise InputError(f"{path}:1: no section of a DXF begins here")
    return found


def _append(entities: list[Entity], entity: Entity) -> None:
    """Add an entity, a vertex to the polyline before it."""
    if entity.kind == "VERTEX" and entities and entities[-1].kind == "POLYLINE":
        entities[-1].parts.append(entity)
    elif entity.kind != "SEQEND":
        entities.append(entity)


def _entities(path: Path, data: bytes) -> Iterator[Entity]:
    """The entities, each of which begins with a code 0."""
    lines = data.decode("utf-8", errors="replace").split("\n")
    entity: Entity | None = None
    for number in range(0, len(lines) - 1, 2):
        try:
            code = int(lines[number])
        except ValueError:
            if not "".join(lines[number:number + 2]).strip():
                continue
            raise InputError(f"{path}:{number + 1}: must be the code of a pair, a whole number, "
                             f"got {lines[number].strip()[:40]!r}") from None
        value = lines[number + 1].strip()
        if code == 0:
            if entity is not None:
                yield entity
            if value == "EOF":
                return
            entity = Entity(value, path, [])
        elif code != 999 and entity is not None:
            entity.pairs.append((code, value, number + 2))
    raise InputError(f"{path}: ends before its EOF; is it complete?")
