"""The table of the runs and campaigns in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from desim.campaign.folder.results_list import ListedResult
from desim.commands.views.terminal import Terminal

_STYLES = {"finished": "green", "campaign": "cyan", "interrupted": "yellow", "partial": "yellow"}
_DIGITS = 8  # of a digest
_LEFT_OUT_FIRST = ("digest", "size", "when", "simulated", "seed", "explored in", "")
UNLIMITED = 10_000  # columns, where no terminal breaks lines


def show(folder: Path, found: Sequence[ListedResult]) -> None:
    """Print the table, or that there is nothing."""
    console = Terminal(highlight=False, markup=False)
    if not found:
        console.print(f"{folder}: no run and no campaign in it", soft_wrap=True)
        return
    if not console.is_terminal:
        console.width = UNLIMITED
    table = _table(found)
    if console.is_terminal:
        _fit(table, console)
    console.print(table)


def _fit(table: Table, console: Terminal) -> None:
    """Leave columns out until the names and ids, which other commands ask for, are whole."""
    for title in _LEFT_OUT_FIRST:
        if Measurement.get(console, console.options.update(width=UNLIMITED),
                           table).minimum <= console.width:
            return
        table.columns = [column for column in table.columns if column.header != title]
    name = table.columns[0]
    name.no_wrap, name.overflow = False, "fold"


def _table(found: Sequence[ListedResult]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for title in ("name", "id", "seed", "status", "when", "simulated", "explored in", "digest",
                  "size"):
        table.add_column(title, no_wrap=True, min_width=len(title), justify=(
            "right" if title in ("seed", "simulated", "explored in", "size") else "left"))
    if any(entry.note for entry in found):
        table.add_column("", overflow="fold")
    for entry in found:
        explored = "-" if entry.exploration_time_s is None else f"{entry.exploration_time_s:.1f} s"
        of_run = entry.simulated_s is not None
        cells = (entry.name or entry.path.name, entry.run_id or "",
                 "" if entry.seed is None else str(entry.seed), entry.status,
                 datetime.fromtimestamp(entry.ended_s).strftime("%Y-%m-%d %H:%M"),
                 f"{entry.simulated_s:.1f} s" if of_run else "", explored if of_run else "",
                 (entry.digest or "")[:_DIGITS], size(entry.size_bytes), entry.note)
        texts = [Text(cell) for cell in cells[:len(table.columns)]]
        texts[3].stylize(_STYLES.get(entry.status, "red"))
        table.add_row(*texts)
    return table


def size(size_bytes: int) -> str:
    """``512 B``, ``4.6 kB``, ``12.0 MB``."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size_bytes >= factor:
            return f"{size_bytes / factor:.1f} {unit}"
    return f"{size_bytes} B"
