"""Where does a thing belong? Prints each package with the first line of its docstring.

    python tools/packages.py [PACKAGE ...] [--modules | --counts]

PACKAGE, as ``desim/network`` or ``network``, is printed alone, with the first line of each of its
modules. Without one: all packages, and with --modules their modules too. With --counts, a line for
each package of desim instead: statements in the syntax tree, names ``Any``, and casts and ``type:
ignore`` comments.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IGNORE = re.compile(r"#\s*type: ignore(\[[^]]*\])?")

# The packages and modules of desim, from the lowest up: each imports only those before it.
LAYERS = ["units", "errors", "operating_system", "files", "unpacking", "outside_yaml",
          "outside_xml", "colours", "compiler", "ports", "modules", "plugins", "engine",
          "statistics", "scenario", "world", "network", "computers", "middleware", "robot",
          "monitor", "advice", "simulation", "results", "netcases", "blame", "api",
          "loop", "stepping", "envs", "campaign", "validation", "testing", "export", "imports",
          "report", "commands", "cli"]


def first_line(file: Path) -> str:
    """The first line of a file's docstring."""
    return (ast.get_docstring(ast.parse(file.read_text())) or "").partition("\n")[0]


def tree(package: Path, modules: bool, depth: int = 0) -> list[str]:
    """A line for the package, then those of what is in it, packages last."""
    lines = [f"{'  ' * depth}{package.name + '/':{32 - 2 * depth}}"
             f"{first_line(package / '__init__.py')}"]
    if modules:
        lines += [f"{'  ' * depth}  {file.name:{30 - 2 * depth}}{first_line(file)}"
                  for file in sorted(package.glob("*.py")) if file.name != "__init__.py"]
    for folder in sorted(package.iterdir(), key=lambda path: (
            LAYERS.index(path.name) if depth == 0 and path.name in LAYERS else 0, path.name)):
        if (folder / "__init__.py").is_file():
            lines += tree(folder, modules, depth + 1)
    return lines


def packages(name: str) -> list[Path]:
    """The packages called ``network``, ``middleware/tcp``, ``middleware.tcp`` or ``desim/network``;
    ends the program where there is none."""
    wanted = Path(*name.removesuffix("/").replace(".", "/").split("/")).parts
    found = [file.parent for top in ("desim", "netmodels")
             for file in sorted((ROOT / top).rglob("__init__.py"))
             if file.parent.relative_to(ROOT).parts[-len(wanted):] == wanted]
    if not found:
        sys.exit(f"no package {name!r}; tools/packages.py alone prints all of them")
    return found


def counts_by_layer() -> dict[str, Counter[str]]:
    """The counts of each layer of desim, of netmodels, and their sum as ``all``."""
    by_layer: dict[str, Counter[str]] = {}
    for package in ("desim", "netmodels"):
        for file in sorted((ROOT / package).rglob("*.py")):
            parts = file.relative_to(ROOT).with_suffix("").parts
            layer = package if package == "netmodels" else parts[1]
            by_layer.setdefault(layer, Counter()).update(counted(file.read_text()))
    by_layer["all"] = sum(by_layer.values(), Counter())
    return by_layer


def counts() -> list[str]:
    """A line a layer of desim, one for netmodels, and their sum."""
    kinds = ("statements", "Any", "casts")
    return [f"{'':16}" + "".join(f"{kind:>12}" for kind in kinds),
            *(f"{layer:16}" + "".join(f"{count[kind]:12}" for kind in kinds)
              for layer, count in counts_by_layer().items())]


def counted(text: str) -> Counter[str]:
    """Statements, names ``Any``, and casts and ignores of a file."""
    nodes = list(ast.walk(ast.parse(text)))
    return Counter(
        statements=sum(isinstance(node, ast.stmt) for node in nodes),
        Any=sum(map(_any_in, nodes)),
        casts=len(list(casts_and_ignores(text))))


def _any_in(node: ast.AST) -> int:
    """The number of ``Any`` that a node writes; an annotation may be a string."""
    if isinstance(node, ast.arg | ast.AnnAssign) and isinstance(node.annotation, ast.Constant):
        return len(re.findall(r"\bAny\b", str(node.annotation.value)))
    return _is_typings(node, "Any")


def _is_typings(node: ast.AST, name: str) -> bool:
    """Whether a node is ``name`` or ``typing.name``."""
    if isinstance(node, ast.Attribute):
        return (node.attr == name and isinstance(node.value, ast.Name)
                and node.value.id == "typing")
    return isinstance(node, ast.Name) and node.id == name


def casts_and_ignores(text: str) -> Iterator[tuple[int, bool]]:
    """Line of each cast and ``type: ignore``, and whether a comment there or on the line above
    gives a reason."""
    if "cast(" not in text and "type: ignore" not in text:
        return  # most files: reading their tokens takes long
    comments = {token.start[0]: token.string
                for token in tokenize.generate_tokens(io.StringIO(text).readline)
                if token.type == tokenize.COMMENT}
    reasons = {line for line, comment in comments.items() if IGNORE.sub("", comment).strip("# ")}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and _is_typings(node.func, "cast"):
            lines = range(node.lineno - 1, (node.end_lineno or node.lineno) + 1)
            yield node.lineno, not reasons.isdisjoint(lines)
    for line, comment in comments.items():
        if IGNORE.search(comment):
            yield line, not reasons.isdisjoint((line - 1, line))


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("packages", nargs="*", metavar="PACKAGE", help="only these, with modules")
    parser.add_argument("--modules", action="store_true", help="each module's first line too")
    parser.add_argument("--counts", action="store_true", help="statements, Any and casts by layer")
    chosen = parser.parse_args()
    if chosen.counts:
        lines = counts()
    else:
        shown = [package for name in chosen.packages for package in packages(name)]
        lines = [line for package in shown or (ROOT / "desim", ROOT / "netmodels")
                 for line in tree(package, chosen.modules or bool(shown))]
    print("\n".join(lines))


if __name__ == "__main__":
    main()
