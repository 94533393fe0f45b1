"""Prints the rooms of the house: each package with the first line of its docstring.

    python tools/rooms.py [--modules]

With --modules, each module's first line too.
"""

from __future__ import annotations

import argparse
import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# The story of the house, from the ground up: a room imports only rooms that stand before it.
STORY = ["units", "errors", "files", "ports", "plugins", "engine", "statistics", "scenario",
         "world", "network", "middleware", "robot", "monitor", "simulation", "results", "netcases",
         "blame", "api", "campaign", "validation", "testing", "report", "commands", "cli"]


def first_line(file: Path) -> str:
    """The first line of a file's docstring."""
    return (ast.get_docstring(ast.parse(file.read_text())) or "").partition("\n")[0]


def rooms(package: Path, modules: bool, depth: int = 0) -> list[str]:
    """A line for the package, then those of what is in it, packages last."""
    lines = [f"{'  ' * depth}{package.name + '/':{32 - 2 * depth}}"
             f"{first_line(package / '__init__.py')}"]
    if modules:
        lines += [f"{'  ' * depth}  {file.name:{30 - 2 * depth}}{first_line(file)}"
                  for file in sorted(package.glob("*.py")) if file.name != "__init__.py"]
    for folder in sorted(package.iterdir(), key=lambda path: (
            STORY.index(path.name) if depth == 0 and path.name in STORY else 0, path.name)):
        if (folder / "__init__.py").is_file():
            lines += rooms(folder, modules, depth + 1)
    return lines


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--modules", action="store_true", help="each module's first line too")
    chosen = parser.parse_args()
    for package in ("desim", "netmodels"):
        print("\n".join(rooms(ROOT / package, chosen.modules)))


if __name__ == "__main__":
    main()
