"""Numbers along an axis."""

from __future__ import annotations

from matplotlib.axis import Axis
from matplotlib.ticker import LogFormatter


class _Plain(LogFormatter):
    """0.01 instead of TeX's ten to a power, which figures whose labels are text would not set."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def plain(axis: Axis) -> None:
    """A logarithmic axis says its ticks as plain numbers."""
    axis.set_major_formatter(_Plain())
    axis.set_minor_formatter(_Plain())
