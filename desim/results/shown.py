"""Objects that a notebook shows as HTML; ``desim.report.notebook`` draws them."""

from __future__ import annotations

from collections.abc import Callable

Draw = Callable[[object], str]
_draw: list[Draw] = []  # one at most


def draw_with(draw: Draw) -> None:
    """Let ``draw`` make the HTML of all shown objects. ``desim/__init__.py`` calls this."""
    _draw[:] = [draw]


class InNotebooks:
    """An object that a notebook shows as HTML."""

    def _repr_html_(self) -> str | None:
        return _draw[0](self) if _draw else None
