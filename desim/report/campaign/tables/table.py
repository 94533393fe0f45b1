"""A table three times: for the page, for LaTeX, and as CSV with every digit."""

from __future__ import annotations

import csv
import html
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from desim.report.campaign import formatting

Cell = str | float | int | None

_MOST_ROWS = 150  # on the page and in LaTeX; CSV has all
_LONG = 45  # letters of a cell
_OF_LATEX = {"\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
             "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
             "–": "--", "²": "$^2$", "<": "$<$", ">": "$>$", "µ": r"$\mu$",
             "≥": r"$\geq$", "→": r"$\rightarrow$", "×": r"$\times$",
             "\n": r"\newline ",
             "[": "{[}", "]": "{]}"}
_THOUSANDS = re.compile(r"(?<=\d) (?=\d{3}(?!\d))")  # thin, and no place to break a line


class ReportTable(NamedTuple):
    """A table for people, ``head`` and ``rows``, and for programs, ``exact_head`` and
    ``exact_rows``, which are read once: those of many vectors need not be in memory together."""

    name: str
    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell | Shown]]
    exact_head: Sequence[str]
    exact_rows: Iterable[Sequence[Cell]]


class Shown(NamedTuple):
    """A ``text`` that sorts as its ``value``."""

    text: str
    value: float | None


def as_csv(table: ReportTable, folder: Path) -> None:
    """Write ``name``.csv."""
    with open(folder / f"{table.name}.csv", "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table.exact_head)
        writer.writerows(table.exact_rows)


def as_latex(table: ReportTable, folder: Path) -> None:
    """Write ``name``.tex: a longtable, which wants the packages booktabs, longtable and, where
    cells are paragraphs, array."""
    long = [any(_is_long(row[i]) for row in table.rows[:_MOST_ROWS])
            for i in range(len(table.head))]
    width = f"{0.7 / max(sum(long), 1):.2f}"
    columns = "".join(rf">{{\raggedright\arraybackslash}}p{{{width}\linewidth}}" if is_long
                      else "l" if _is_text(table, i) else "r" for i, is_long in enumerate(long))
    head = " & ".join(map(_escaped, table.head)) + r" \\"
    caption = table.caption + ("" if len(table.rows) <= _MOST_ROWS
                               else f" The first {_MOST_ROWS} of {len(table.rows)} rows.")
    packages = "array,booktabs,longtable" if any(long) else "booktabs,longtable"
    lines = [rf"% \usepackage{{{packages}}}", rf"\begin{{longtable}}{{{columns}}}",
             rf"\caption{{{_escaped(caption)}}}\label{{tab:{table.name}}}\\", r"\toprule", head,
             r"\midrule", r"\endfirsthead", r"\toprule", head, r"\midrule", r"\endhead",
             r"\bottomrule", r"\endfoot",
             *(" & ".join(_escaped(text_of(cell)) for cell in row) + r" \\"
               for row in table.rows[:_MOST_ROWS]), r"\end{longtable}"]
    (folder / f"{table.name}.tex").write_text("\n".join(lines) + "\n", "utf-8")


def as_html(table: ReportTable, stacked: bool = False) -> str:
    """A table that sorts by the column whose head is clicked; ``stacked``: on a phone its cells
    stand below one another, each with the name of its column."""
    textual = [_is_text(table, i) for i in range(len(table.head))]
    head = "".join(f'<th scope="col" class="{"words" if words else "num"}" aria-sort="none">'
                   f'<button type="button">{html.escape(title)}</button></th>'
                   for title, words in zip(table.head, textual, strict=True))
    names = [f' data-head="{html.escape(title)}"' if stacked else "" for title in table.head]
    body = "\n".join("<tr>" + "".join(_td(cell, words, name) for cell, words, name in
                                      zip(row, textual, names, strict=True)) + "</tr>"
                     for row in table.rows[:_MOST_ROWS])
    more = len(table.rows) - _MOST_ROWS
    note = f'<p class="note">{more} more rows in tables/{table.name}.csv.</p>' if more > 0 else ""
    kind = "wide stacked" if stacked else "wide"
    return (f'<div class="{kind}"><table id="table-{table.name}" class="sortable">'
            f"<caption>{html.escape(table.caption)}</caption>"
            f"<thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></div>{note}")


def _td(cell: Cell | Shown, words: bool, name: str) -> str:
    value = cell.value if isinstance(cell, Shown) else cell
    sort = "" if value is None or isinstance(value, str) else f' data-v="{value:.9g}"'
    kind = "" if words else f' class="num"{sort}'
    return f"<td{kind}{name}>{html.escape(text_of(cell))}</td>"


def text_of(cell: Cell | Shown) -> str:
    """The text of a cell."""
    text = cell.text if isinstance(cell, Shown) else cell
    return text if isinstance(text, str) else formatting.number(text)


def _is_text(table: ReportTable, column: int) -> bool:
    return any(isinstance(row[column], str) for row in table.rows[:_MOST_ROWS])


def _is_long(cell: Cell | Shown) -> bool:
    """Whether the text needs several lines."""
    text = text_of(cell)
    return "\n" in text or len(text) > _LONG


def _escaped(text: str) -> str:
    return _THOUSANDS.sub(r"\\,", "".join(_OF_LATEX.get(letter, letter) for letter in text))
