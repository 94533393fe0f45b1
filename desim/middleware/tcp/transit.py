"""The messages in transit in one direction of a connection; sender and receiver share them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

FIN = "fin"  # the kind of a FIN, which takes a byte of the stream as a message does

Token: TypeAlias = Any  # its user's: a ``Cargo`` where the kind is None, else anything
Entry = tuple[int, Callable[..., object], Token, "str | None"]  # end, arrived, token, kind


class Transit:
    """The messages between a sender and its receiver, which share this object: the sender appends
    ``messages`` and removes acknowledged ones; the receiver counts how many of them, from the
    first, it has ``delivered``."""

    __slots__ = ("messages", "delivered")

    def __init__(self) -> None:
        self.messages: deque[Entry] = deque()
        self.delivered = 0

    def clear(self) -> None:
        """Forget all messages."""
        self.messages.clear()
        self.delivered = 0


def parts(entries: Iterable[Entry], begin: int, start: int,
          end: int) -> list[tuple[Token, str | None, int]]:
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
