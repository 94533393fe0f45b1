"""Labels of a logarithmic axis."""

from __future__ import annotations

from matplotlib.axis import Axis
from matplotlib.ticker import LogFormatter


class _Plain(LogFormatter):
    """Labels such as 0.01 instead of TeX's power of ten, which figures whose labels are plain text
    cannot render."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def plain(axis: Axis) -> None:
    """Label a logarithmic ``axis`` with plain numbers."""
    axis.set_major_formatter(_Plain())
    axis.set_minor_formatter(_Plain())
