"""A terminal on which foreign text cannot be a command to the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from desim.errors import printable

_NARROW = 64  # columns


class Terminal(Console):
    """A console that prints printable text only, besides its own colours and cursor movements."""

    @property
    def is_narrow(self) -> bool:
        """Whether tables of numbers would be cut or folded."""
        return self.is_terminal and self.width < _NARROW

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None,
               ) -> Iterator[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))
