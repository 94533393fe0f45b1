"""Python files as syntax trees: what each of them imports."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import desim

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

    def imports(self) -> Iterator[tuple[int, str]]:
        """Line and full name of every imported module, ``from a import b`` as ``a.b``, and where
        desim exports it, under the name of the module that has it."""
        for line, name in self._written():
            stem, _, what = name.rpartition(".")
            yield line, f"{EXPORTS[what]}.{what}" if stem == "desim" and what in EXPORTS else name

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
    found = [Source.of(str(path.relative_to(ROOT)), path.read_text()) for path in paths]
    return {source.module: source for source in found}
