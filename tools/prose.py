"""Are docstrings, pages and names in plain English? Checks their words.

    python tools/prose.py [file or folder ...]

The first line of a docstring is a sentence with a subject and a verb, or a noun phrase of the
field, or a question. In a module's docstring it ends with a full stop, a question mark or an
exclamation mark. It does not open with a relative clause that has no head ("What is sent later
..."). Words of a private dialect are not used at all. No name that the code gives (to a module, a
class, a function, a parameter, an attribute, a variable) has a word that docs/glossary.md rules out
in its last column, in the singular or the plural. Only the name of a test is a sentence, in which
verbs may end in s. Exit code 1 if anything is found.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
GLOSSARY = ROOT / "docs" / "glossary.md"
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
EVERYTHING = ("desim", "netmodels", "tools", "scenarios", "tests", "docs", "README.md",
              "CONTRIBUTING.md")

# No docstring opens with these, unless it asks a question.
HEADLESS = re.compile(r"(What|Who|Whom|Whose|Which|Where|When|How|Why|That|Luck)\b")
QUESTION = re.compile(r"[^.:]*\?")
# Words that the field does not use, and what it says instead.
DIALECT = {"maniest": "number", "whoever": "the one that", "hardly ever": "rarely",
           "by luck": "at random", "gives in": "saturates", "gave in": "saturated",
           "spoilt": "obsolete", "in vain": "wasted", "told from chance": "significant",
           "tell from chance": "significant", "as most often": "mostly",
           "as nearly always": "mostly"}


class Finding(NamedTuple):
    """Something to mend: its place, and why."""

    file: Path
    line: int
    why: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.why}"


@cache
def ruled_out() -> dict[str, str]:
    """Words that names do not have, to the words of the glossary that stand for them."""
    rows = [line.strip("| \n").split(" | ") for line in GLOSSARY.read_text().splitlines()
            if line.startswith("| ")]
    found: dict[str, str] = {}
    for row in rows:
        for word in row[2].split(", ") if len(row) == 3 and row[2] != "not" else ():
            found[word] = f"{found[word]}, {row[0]}" if word in found else row[0]
    return found


def names(file: Path, tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and name of all that a file names: itself, its package, and what it defines."""
    home = file.resolve()
    yield 1, home.parent.name if home.stem == "__init__" else home.stem
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield node.lineno, name
            case (ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name)
                  | ast.ClassDef(name=name) | ast.arg(arg=name) | ast.alias(asname=str(name))
                  | ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name))
                  | ast.MatchStar(name=str(name)) | ast.MatchMapping(rest=str(name))):
                yield node.lineno, name


def in_names(file: Path, tree: ast.Module) -> Iterator[Finding]:
    """Findings in the names of a Python file, each name once."""
    first: dict[str, int] = {}
    for line, name in names(file, tree):
        first.setdefault(name, line)
    for name, line in first.items():
        for word in map(str.lower, WORD.findall(name)):
            one = word if name.startswith("test_") else word.removesuffix("s")
            if instead := ruled_out().get(word) or ruled_out().get(one):
                yield Finding(file, line, f"the name {name}: the glossary says {instead!r}")


def in_python(file: Path) -> Iterator[Finding]:
    """Findings in the names and docstrings of a Python file."""
    tree = ast.parse(file.read_text())
    yield from in_names(file, tree)
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef
                          | ast.AsyncFunctionDef):
            continue
        text = ast.get_docstring(node)
        if text is None:
            continue
        line = node.body[0].lineno
        if HEADLESS.match(text) and not QUESTION.match(text):
            yield Finding(file, line, f"a docstring opens with {text.split()[0]!r}: "
                                      f"{text.partition(chr(10))[0]}")
        if isinstance(node, ast.Module) and text.partition("\n")[0][-1] not in ".?!":
            yield Finding(file, line, "the first sentence of a module's docstring does not end on "
                                      f"its first line: {text.partition(chr(10))[0]}")
        yield from dialect(file, line, text)


def in_page(file: Path) -> Iterator[Finding]:
    """Findings in a Markdown page, outside of its code."""
    text = re.sub(r"```.*?```", lambda found: "\n" * found[0].count("\n"), file.read_text(),
                  flags=re.DOTALL)
    for number, line in enumerate(text.splitlines(), 1):
        yield from dialect(file, number, line)


def dialect(file: Path, line: int, text: str) -> Iterator[Finding]:
    """Findings among the words of a text."""
    for word, instead in DIALECT.items():
        if re.search(rf"\b{word}\b", text, re.IGNORECASE):
            yield Finding(file, line, f"{word!r}: say {instead!r}")


def findings(paths: list[Path]) -> list[Finding]:
    """All findings in files and folders."""
    files = [file for path in paths for file in (sorted(path.rglob("*")) if path.is_dir()
                                                 else [path])]
    return [found for file in files if file.suffix in (".py", ".md")
            for found in (in_python(file) if file.suffix == ".py" else in_page(file))]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("paths", nargs="*", type=Path)
    chosen = parser.parse_args().paths or [ROOT / name for name in EVERYTHING
                                           if (ROOT / name).exists()]
    found = findings(chosen)
    print(*found, sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
