"""The table of a run's key figures."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from desim.report.key_figures import Summary, headline, key_figures


def result_table(metrics: Summary, manifest: Summary, is_narrow: bool = False) -> Table:
    """The key figures of a run, for the terminal. ``is_narrow``: values and what they mean share a
    column."""
    table = Table(title=Text(headline(metrics, manifest)), title_justify="left",
                  title_style="bold", box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="cyan", no_wrap=True)
    if is_narrow:
        table.add_column(overflow="fold")
        for name, figure, meaning in key_figures(metrics, manifest):
            table.add_row(Text(name), Text.assemble(figure, " ", (meaning, "dim")))
        return table
    table.add_column(no_wrap=True)
    table.add_column(style="dim")
    for row in key_figures(metrics, manifest):
        table.add_row(*map(Text, row))
    return table
