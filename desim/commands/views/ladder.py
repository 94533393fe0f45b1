"""The outcome of a comparison on the fidelity ladder, for the terminal."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from desim.campaign.design.design import Design
from desim.commands.views.terminal import Terminal
from desim.report.campaign.answers import rungs
from desim.report.campaign.numbers import Estimates, Study
from desim.report.campaign.tables.table import ReportTable, text_of


def show(folder: Path, design: Design) -> None:
    """Print the table of the rungs, and whether the ranking holds."""
    console = Terminal(highlight=False, markup=False)  # [s] is a unit
    study = Study(folder, design)
    metric = design.report.metrics[0]
    found = rungs.compared(study, Estimates(study), metric)
    shown = rungs.table(study, metric, found)
    console.print(terminal_table(shown))
    for sentence in rungs.sentences(study, metric, found):
        console.print(sentence, soft_wrap=True)


def terminal_table(shown: ReportTable) -> Table:
    """A table of the report for a terminal. In a narrow one, names continue in the next line."""
    table = Table()
    for i, title in enumerate(shown.head):
        table.add_column(title, justify="left" if i in (0, len(shown.head) - 1) else "right",
                         overflow="fold")
    for row in shown.rows:
        table.add_row(*map(text_of, row))
    return table
