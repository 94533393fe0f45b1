"""How long are the pages and their sentences? Counts words, and words a sentence.

    python tools/page_words.py

Prints a row a page, then the sum of docs/. A word has a letter or a digit. Words in code do not
count, nor does the leaderboard: a program writes it. A sentence ends with ``.``, ``?`` or ``!``
before a space; rows of tables and headings are no sentences. ``tests/test_prose.py`` holds the
sums.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
_CODE = re.compile(r"^ *```.*?^ *```|^    .*?$|<!--.*?-->", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\([^)]*\)")
_WRITTEN_BY_PROGRAMS = "leaderboard.md"


class Count(NamedTuple):
    """The words of a page, and the words and the number of its sentences."""

    words: int
    in_sentences: int
    sentences: int


def count(text: str) -> Count:
    """The count of a Markdown text."""
    text = _LINK.sub("]", _CODE.sub("", text))
    plain = "\n".join(line for line in text.splitlines() if not line.startswith(("|", "#", "![")))
    blocks = re.split(r"\n\s*\n|\n *(?:[-*]|\d+\.) ", plain)
    sentences = [part for block in blocks for part in re.split(r"(?<=[.?!:])\s+", block)
                 if len(part.split()) > 2]
    words = [word for word in text.split() if re.search(r"\w", word)]
    return Count(len(words), sum(len(part.split()) for part in sentences), len(sentences))


def pages() -> dict[str, Count]:
    """The counts of README.md and of the pages in docs/, by path."""
    files = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return {str(file.relative_to(ROOT)): count(file.read_text()) for file in files
            if file.name != _WRITTEN_BY_PROGRAMS}


def main() -> None:
    found = pages()
    for page, counted in sorted(found.items(), key=lambda item: item[1].words):
        print(f"{counted.words:7} words {counted.in_sentences / max(counted.sentences, 1):5.1f} a "
              f"sentence  {page}")
    docs = [counted for page, counted in found.items() if page.startswith("docs/")]
    words, inside, sentences = (sum(column) for column in zip(*docs, strict=True))
    print(f"{words:7} words {inside / sentences:5.1f} a sentence  docs/")


if __name__ == "__main__":
    main()
