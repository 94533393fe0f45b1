"""Where does a thing belong? Prints each package with the first line of its docstring.

    python tools/rooms.py [PACKAGE ...] [--modules | --counts]

PACKAGE, as ``desim/network`` or ``network``, is printed alone, with the first line of each of its
modules. Without one: all packages, and with --modules their modules too. With --counts, a line a
room instead: statements in the syntax tree, names ``Any``, and casts and ``type: ignore`` comments.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections import Counter
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


def packages(name: str) -> list[Path]:
    """The packages called ``network``, ``middleware/tcp``, ``middleware.tcp`` or ``desim/network``;
    ends the program where there is none."""
    wanted = Path(*name.removesuffix("/").replace(".", "/").split("/")).parts
    found = [file.parent for top in ("desim", "netmodels")
             for file in sorted((ROOT / top).rglob("__init__.py"))
             if file.parent.relative_to(ROOT).parts[-len(wanted):] == wanted]
    if not found:
        sys.exit(f"no package {name!r}; tools/rooms.py alone prints all of them")
    return found


def counts() -> list[str]:
    """A line a room of desim, one for netmodels, and their sum."""
    by_room: dict[str, Counter[str]] = {}
    for package in ("desim", "netmodels"):
        for file in sorted((ROOT / package).rglob("*.py")):
            parts = file.relative_to(ROOT).with_suffix("").parts
            room = package if package == "netmodels" else parts[1]
            by_room.setdefault(room, Counter()).update(counted(file.read_text()))
    by_room["all"] = sum(by_room.values(), Counter())
    kinds = ("statements", "Any", "casts")
    return [f"{'':16}" + "".join(f"{kind:>12}" for kind in kinds),
            *(f"{room:16}" + "".join(f"{count[kind]:12}" for kind in kinds)
              for room, count in by_room.items())]


def counted(text: str) -> Counter[str]:
    """Statements, names ``Any``, and casts and ignores of a file."""
    nodes = list(ast.walk(ast.parse(text)))
    return Counter(
        statements=sum(isinstance(node, ast.stmt) for node in nodes),
        Any=sum(isinstance(node, ast.Name) and node.id == "Any" for node in nodes),
        casts=text.count("type: ignore") + sum(
            isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
            and node.func.id == "cast" for node in nodes))


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("packages", nargs="*", metavar="PACKAGE", help="only these, with modules")
    parser.add_argument("--modules", action="store_true", help="each module's first line too")
    parser.add_argument("--counts", action="store_true", help="statements, Any and casts by room")
    chosen = parser.parse_args()
    if chosen.counts:
        lines = counts()
    else:
        shown = [package for name in chosen.packages for package in packages(name)]
        lines = [line for package in shown or (ROOT / "desim", ROOT / "netmodels")
                 for line in rooms(package, chosen.modules or bool(shown))]
    print("\n".join(lines))


if __name__ == "__main__":
    main()
