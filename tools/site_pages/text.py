"""Docstrings and tables as Markdown."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; its cells may have inline Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |"
                     for line in lines)


def prose(docstring: str) -> str:
    """A docstring as Markdown: paragraphs, and literal blocks where it is indented."""
    parts = []
    for paragraph in re.split(r"\n\s*\n", docstring.strip("\n")):
        if paragraph.startswith("    ") or "\n    " in paragraph:
            parts.append(f"```text\n{textwrap.dedent(paragraph)}\n```")
        else:
            parts.append(inline(" ".join(paragraph.split())))
    return "\n\n".join(parts)


def inline(text: str) -> str:
    """Text of one line, with ``code`` in it; all other marks of Markdown are escaped."""
    parts = re.split(r"``(.+?)``", text)
    return "".join(code(part) if i % 2 else re.sub(r"([\\`*_<>\[\]{}$#~|])", r"\\\1", part)
                   for i, part in enumerate(parts))


def code(text: object) -> str:
    """Text as inline code."""
    words = str(text)
    fence = "``" if "`" in words else "`"
    return f"{fence}{words}{fence}" if words else ""
