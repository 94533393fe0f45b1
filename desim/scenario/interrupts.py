"""Ctrl-C while pydantic serializes a scenario."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pydantic_core import PydanticSerializationError


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise the ``KeyboardInterrupt`` that met a serializer written in Python: pydantic reports it
    as an error of its own, of which only the text names it."""
    try:
        yield
    except PydanticSerializationError as error:
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from None
        raise
