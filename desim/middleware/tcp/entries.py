"""What a sender remembers of the messages whose bytes it has in its stream."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

FIN = "fin"  # the kind of a FIN, which takes a byte of the stream as a message does

Entry = tuple[int, Callable[[Any], Any], Any, "str | None"]  # end, arrived, token, kind


def parts(entries: Iterable[Entry], begin: int, start: int,
          end: int) -> list[tuple[Any, str | None, int]]:
    """Token, kind and bytes of each message in bytes ``start`` to ``end`` of the stream; the first
    of ``entries`` begins (or is taken to begin) at ``begin``."""
    found = []
    for ends, _, token, kind in entries:
        if begin >= end:
            break
        if ends > start:
            found.append((token, kind, min(ends, end) - max(begin, start)))
        begin = ends
    return found
