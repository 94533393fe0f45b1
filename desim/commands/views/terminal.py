"""A terminal on which what somebody else wrote is text, and no command to the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from rich.console import Console
from rich.segment import Segment

from desim.errors import printable


class Terminal(Console):
    """A console whose words are printable, whoever wrote them; its own colours and movements of the
    cursor are not words."""

    def render(self, renderable: Any, options: Any = None) -> Iterator[Segment]:
        return _clean(super().render(renderable, options))


def _clean(segments: Iterable[Segment]) -> Iterator[Segment]:
    for segment in segments:
        yield segment if segment.control else segment._replace(text=printable(segment.text))
