"""The file or folder that an export writes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from desim.errors import InputError
from desim.files import replacing


@contextmanager
def writing(path: Path, option: str) -> Iterator[None]:
    """Turn errors of writing ``path``, which ``option`` has named, into an ``InputError``."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{option}: {path} cannot be written: {error.strerror or error}"
                         ) from error


@contextmanager
def target(path: Path, option: str) -> Iterator[Path]:
    """A file to write in place of ``path``, which it replaces when it is complete; if something
    goes wrong ``path`` stays as it was. Raises ``InputError`` where it cannot be written."""
    with writing(path, option), replacing(path) as beside:
        beside.touch()  # what cannot be written is said before the work is done
        beside.unlink()
        yield beside
