"""The place that a command writes to: the given one, or one beside what it shows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from desim.errors import InputError


@contextmanager
def writing_to(given: Path | None, default: Path, option: str = "--to FILE") -> Iterator[Path]:
    """The place that was ``given`` by ``option``, or ``default``. A complaint about the default
    then says how to choose another place."""
    try:
        yield given or default
    except InputError as error:
        name, complaint = f"{option.split()[0]}: ", str(error)
        if given is not None or not complaint.startswith(name):
            raise
        raise InputError(f"{complaint.removeprefix(name)}; another place: {option}") from error
