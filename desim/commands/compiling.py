"""Messages about kernels that are compiled before a command can begin."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from desim.commands.output import say
from desim.errors import InputError


def compiling_inside(quiet: bool) -> AbstractContextManager[None]:
    """Announce kernels that are compiled while a simulation is built, as those of a radio are."""
    from desim.compiler.store import announced

    return announced(lambda: None if quiet else say(
        "compiling numerical kernels (first run with these models only)...", err=True))


@contextmanager
def compiling(quiet: bool) -> Iterator[None]:
    """Announce kernels that are compiled inside, and the time that it took."""
    from desim.compiler.store import announced
    from desim.engine.garbage import rare_collections

    begin_s = None

    def begin() -> None:
        nonlocal begin_s
        begin_s = time.perf_counter()
        if not quiet:
            say("compiling numerical kernels (first run only)...", err=True)

    try:
        with rare_collections(), announced(begin):
            yield
    except RuntimeError as error:
        if "cannot cache function" not in str(error):
            raise
        raise InputError("a plug-in's compiled kernels cannot be kept; set NUMBA_CACHE_DIR to a "
                         "folder that can be written") from error
    if begin_s is not None and not quiet:
        say(f"compiled in {time.perf_counter() - begin_s:.1f} s", err=True)
