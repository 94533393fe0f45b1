"""Packages that desim needs for some options only."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from desim.errors import InputError


@contextmanager
def extra(name: str, option: str) -> Iterator[None]:
    """For imports: raises ``InputError`` that names the extra ``name`` where a package of it is not
    installed, and the ``option`` that needs it."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        raise InputError(f"{option}: {package} is not installed; "
                         f"pip install 'desim[{name}]'") from error
