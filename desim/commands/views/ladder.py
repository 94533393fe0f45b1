"""What people are told when a ladder has been climbed."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from desim.campaign.design.design import Design
from desim.commands.views.terminal import Terminal
from desim.report.campaign import rungs
from desim.report.campaign.estimates import Estimates
from desim.report.campaign.study import Study
from desim.report.campaign.tables import Table as Written
from desim.report.campaign.tables import text_of


def tell(folder: Path, design: Design) -> None:
    """The table of the rungs, and whether the ranking holds."""
    console = Terminal(highlight=False, markup=False)  # [s] is a unit
    study = Study(folder, design)
    metric = design.report.metrics[0]
    found = rungs.compared(study, Estimates(study), metric)
    shown = rungs.table(study, metric, found)
    console.print(drawn(shown))
    for sentence in rungs.sentences(study, metric, found):
        console.print(sentence, soft_wrap=True)


def drawn(shown: Written) -> Table:
    """For a terminal: in one that is narrow names go on in the next line."""
    table = Table()
    for i, title in enumerate(shown.head):
        table.add_column(title, justify="left" if i in (0, len(shown.head) - 1) else "right",
                         overflow="fold")
    for row in shown.rows:
        table.add_row(*map(text_of, row))
    return table
