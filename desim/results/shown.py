"""Objects that a notebook shows as HTML: the rooms below say which, a room above draws them."""

from __future__ import annotations

from collections.abc import Callable

Draw = Callable[[object], str]
_draw: list[Draw] = []  # one at most


def draw_with(draw: Draw) -> None:
    """Let ``draw`` make the HTML of all shown objects; ``desim`` itself says so when imported."""
    _draw[:] = [draw]


class InNotebooks:
    """An object that a notebook shows as HTML."""

    def _repr_html_(self) -> str | None:
        return _draw[0](self) if _draw else None
