"""The page of the leaderboard, in Markdown: a block of tables for each version of a design.

Blocks stand between comments, in the order in which somebody put them: a new one goes before older
versions of its design, or else to the end. What is around them stays, and in them what other
campaigns entered.
"""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from desim.campaign.design.reference import ReferenceDesign
from desim.errors import InputError
from desim.files import content, target
from desim.ports import natural_key
from desim.report.campaign.numbers import Study
from desim.report.leaderboard.entries import LeaderboardEntry, entries

_NEW = "# Leaderboard\n"  # a page that is not there yet
_MOST_BYTES = 50_000_000
_BEGIN = re.compile(r"^<!-- leaderboard: (\S+), version (\d+)\b.*-->$", re.MULTILINE)
_END = "<!-- end of leaderboard -->\n"
_COLUMNS = ("terrain", "network", "robots", "strategy", "time, s", "runs", "late", "failed",
            "way, m", "map quality", "sent, MB", "desim")
_ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", "|": "&#124;"})


class _Block(NamedTuple):
    """A version of a design in the text of a page, from its first comment to its last one."""

    name: str
    version: int
    begin: int
    end: int


def enter(study: Study, page: Path) -> str:
    """Enter a campaign's results into a page, which is made where there is none: its entries take
    the place of those of the same design, version, terrain, network, robots and strategy. Returns
    what was entered, in words. Raises ``InputError`` for runs of no reference design or of another
    one than the study's design, and for a page that cannot be read or written."""
    reference = _reference(study)
    found = entries(study, reference)
    with target(page, "--leaderboard") as beside:
        text = _entered(page, _read(page), reference, study.design.question, found)
        beside.write_bytes(text.encode())
    return f"{len(found)} entries of {reference.name}, version {reference.version}"


def _reference(study: Study) -> ReferenceDesign:
    reference, design = study.reference, study.design
    if reference is None:
        raise InputError(f"{study.folder}: not the runs of a reference design; the design of such "
                         "runs has the key reference, which desim sweep notes in runs.parquet")
    version = design.reference.version if design.reference else "none"
    if reference[:2] != (design.name, version):
        raise InputError(f"{study.folder}: the runs are of {reference.name}, version "
                         f"{reference.version}; the design is {design.name}, version {version}")
    return reference


def _read(page: Path) -> str:
    try:
        return content(page, _MOST_BYTES).decode()
    except FileNotFoundError:
        return _NEW
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"--leaderboard: {page} cannot be read: {error}") from error


def _entered(page: Path, text: str, reference: ReferenceDesign, question: str,
             new: list[LeaderboardEntry]) -> str:
    blocks = list(_blocks(page, text))
    own = next((block for block in blocks if block[:2] == reference[:2]), None)
    if own is None:
        begin = next((block.begin for block in blocks if block.name == reference.name
                      and block.version < reference.version), len(text))
        before, after = text[:begin].rstrip("\n") + "\n\n", text[begin:].lstrip("\n")
        after = after and f"\n{after}"
    else:
        before, after = text[:own.begin], text[own.end:]
        new = [*_known(page, text, own), *new]
    latest = {(*entry.group, entry.strategy): entry for entry in new}
    ordered = sorted(latest.values(), key=lambda entry: entry.order)
    return before + _written(reference, question, ordered) + after


def _blocks(page: Path, text: str) -> Iterator[_Block]:
    """The blocks of a page, in its order."""
    for match in _BEGIN.finditer(text):
        end, following = text.find(_END, match.end()), _BEGIN.search(text, match.end())
        if end < 0 or (following is not None and following.start() < end):
            raise InputError(f"{_line(page, text, match.start())}: the block that begins here has "
                             f"no end, {_END.strip()}")
        yield _Block(match[1], int(match[2]), match.start(), end + len(_END))


def _known(page: Path, text: str, block: _Block) -> Iterator[LeaderboardEntry]:
    """The entries of a block."""
    at = text.find(_row(_COLUMNS), block.begin, block.end)
    if at < 0:
        raise InputError(f"{_line(page, text, block.begin)}: the block that begins here has other "
                         "columns; take it out, and enter its campaigns again")
    for number, line in enumerate(text[at:block.end].split("\n")):
        if number < 2:  # the head
            continue
        if not line.startswith("| "):
            return
        cells = [html.unescape(cell) for cell in line[2:-2].split(" | ")]
        if len(cells) != len(_COLUMNS):
            raise InputError(f"{_line(page, text, at, number)}: {len(cells)} cells, but "
                             f"{len(_COLUMNS)} columns")
        yield LeaderboardEntry(*cells)


def _line(page: Path, text: str, at: int, below: int = 0) -> str:
    """``page:line`` of a place in the text, or of so many lines ``below`` it."""
    before = text.count("\n", 0, at)
    return f"{page}:{before + 1 + below}"


def _written(reference: ReferenceDesign, question: str, ordered: list[LeaderboardEntry]) -> str:
    """A block."""
    title = f"{reference.name}, version {reference.version}"
    return "\n".join([
        f"<!-- leaderboard: {title}; desim report --leaderboard writes this block -->",
        f"## {title}\n",
        *([f"{' '.join(question.split()).translate(_ESCAPES)}\n"] if question else []),
        "The fastest:\n", _fastest(ordered), "All:\n", _table(_COLUMNS, ordered)]) + _END


def _fastest(ordered: list[LeaderboardEntry]) -> str:
    """The table of the fastest strategies, terrain by terrain."""
    terrains = tuple(dict.fromkeys(entry.terrain for entry in ordered))
    rows: dict[tuple[str, str], dict[str, str]] = {}
    for (terrain, *where), group in groupby(ordered, lambda entry: entry.group):
        rows.setdefault((where[0], where[1]), {})[terrain] = _first(list(group))
    return _table(("network", "robots", *terrains), (
        (*where, *(rows[where].get(terrain, "") for terrain in terrains))
        for where in sorted(rows, key=lambda where: [*map(natural_key, where)])))


def _first(group: list[LeaderboardEntry]) -> str:
    """The fastest one, and in brackets how many others have an interval that overlaps its own."""
    first = group[0]
    if math.isinf(first.times.median):
        return "none"
    others = sum(other.times.low <= first.times.high for other in group[1:])
    return f"{first.strategy} {first.times.median} s" + (f" (+{others})" if others else "")


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    return "".join([_row(head), f"|{'---|' * len(head)}\n", *map(_row, rows)])


def _row(cells: tuple[str, ...]) -> str:
    return f"| {' | '.join(cell.translate(_ESCAPES) for cell in cells)} |\n"
