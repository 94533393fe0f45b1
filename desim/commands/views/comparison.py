"""Two runs or two campaigns side by side, for the terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from desim.campaign.folder.comparison import ComparedCampaigns
from desim.commands.views.results_list import UNLIMITED
from desim.commands.views.terminal import Terminal
from desim.report.side_by_side import key_rows, metric_cells, outcome, value
from desim.results.comparison import ComparedRuns, KeyDifference


def show(found: ComparedRuns | ComparedCampaigns) -> None:
    """Print all of it that differs."""
    console = Terminal(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = UNLIMITED
    console.print(f"first   {found.first.path}\nsecond  {found.second.path}", soft_wrap=True)
    _keys(console, found.keys)
    if isinstance(found, ComparedRuns):
        _runs(console, found)
    else:
        _campaigns(console, found)


def _keys(console: Terminal, keys: list[KeyDifference]) -> None:
    if keys:
        _print(console, ("key", "first", "second"), key_rows(keys))
    else:
        console.print("\nno key differs")


def _runs(console: Terminal, found: ComparedRuns) -> None:
    unlike = [pair for pair in found.metrics if not pair.is_equal]
    if unlike:
        _print(console, ("metric", "first", "second", "difference", "%"),
               ((pair.name, *metric_cells(pair)) for pair in unlike))
    console.print(f"\n{outcome(found)}", soft_wrap=True)
    if not found.is_same and not found.failed:
        both = f"{found.first.path} {found.second.path}"
        console.print(f"on one time line: desim view {both}\nthe first trace row that differs: "
                      f"desim diff {both}", soft_wrap=True)


def _campaigns(console: Terminal, found: ComparedCampaigns) -> None:
    rows = [(*map(value, pair.levels.values()), metric, *metric_cells(pair.metric),
             f"{pair.runs[0]}, {pair.runs[1]}")
            for metric in found.reported for pair in found.pairs(metric)]
    if rows:
        _print(console, (*found.parameters, "mean of", "first", "second", "difference", "%",
                         "runs"), rows)
    else:
        console.print("\nno vector is in both")
    console.print(f"\n{len(found.metrics)} metrics in all: --json; intervals: desim report",
                  soft_wrap=True)


def _print(console: Terminal, titles: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> None:
    """A table; on a narrow terminal a paragraph for each row, as half a number is a wrong one."""
    if not console.is_narrow:
        console.print(_table(titles, rows))
        return
    for name, *cells in rows:
        named = ", ".join(f"{title} {cell}" for title, cell in zip(titles[1:], cells, strict=True)
                          if cell)
        console.print(Text(f"\n{name}", style="bold"))
        console.print(Padding(Text(named), (0, 0, 0, 2)))


def _table(titles: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold", title=" ")
    numbers = ("first", "second", "difference", "%", "runs") if "%" in titles else ()
    for title in titles:
        table.add_column(title, justify="right" if title in numbers else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    return table
