"""Python files as syntax trees: what each of them imports."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import desim
from desim.engine.garbage import freeze_present_objects

ROOT = Path(__file__).resolve().parent.parent
EXPORTS: dict[str, str] = desim._WHERE  # the names of desim/__init__.py, and their modules


class Source(NamedTuple):
    """One file: its path from the root, its text, its syntax tree."""

    path: PurePosixPath
    text: str
    tree: ast.Module

    @classmethod
    def of(cls, path: str, text: str) -> Source:
        return cls(PurePosixPath(path), text, ast.parse(text))

    @property
    def module(self) -> str:
        parts = self.path.with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def imports(self) -> list[tuple[int, str]]:
        """Line and full name of every imported module, ``from a import b`` as ``a.b``, and where
        desim exports it, under the name of the module that has it."""
        return _imported(self)

    def _written(self) -> Iterator[tuple[int, str]]:
        package = self.module.split(".")
        if self.path.name != "__init__.py":
            package = package[:-1]
        for node in nodes(self.tree):
            if isinstance(node, ast.Import):
                yield from ((node.lineno, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                base = package[:len(package) + 1 - node.level] if node.level else []
                stem = ".".join([*base, *filter(None, [node.module])])
                yield from ((node.lineno, f"{stem}.{alias.name}") for alias in node.names)

    def calls(self) -> Iterator[tuple[int, str, ast.Call]]:
        """Line, dotted name and node of every call whose function has a dotted name."""
        for node in nodes(self.tree):
            if isinstance(node, ast.Call) and (name := dotted(node.func)):
                yield node.lineno, name, node


@cache
def _imported(source: Source) -> list[tuple[int, str]]:
    """``Source.imports``, found once."""
    return [(line, f"{EXPORTS[what]}.{what}" if name == f"desim.{what}" and what in EXPORTS
             else name) for line, name in source._written() for what in [name.rpartition(".")[2]]]


@cache
def nodes(tree: ast.Module) -> list[ast.AST]:
    """All nodes of a syntax tree."""
    return list(ast.walk(tree))


def dotted(node: ast.expr) -> str:
    """``a.b.c`` of an attribute chain, or nothing."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (stem := dotted(node.value)):
        return f"{stem}.{node.attr}"
    return ""


@cache
def below(*folders: str) -> dict[str, Source]:
    """Module name to source, of all Python files below folders of the root."""
    paths = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    gc.disable()  # it would pass over all trees again and again: more than half of the time
    found = [Source.of(str(path.relative_to(ROOT)), path.read_text()) for path in paths]
    freeze_present_objects()
    gc.enable()
    return {source.module: source for source in found}
