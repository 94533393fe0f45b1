"""Python's search for garbage in cycles: rarely, and not among what stays."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_RARELY = 50_000, 20, 50


def keep_what_there_is() -> None:
    """Never search again among the objects that there are now. For a process of many runs: its
    modules stay, and a search through them takes longer than a small run."""
    gc.freeze()
    gc.set_threshold(*_RARELY)


@contextmanager
def rare_collections() -> Iterator[None]:
    """Search rarely inside. The objects of a run go when nobody refers to them any more; a search
    for cycles among all that stay would find nothing, again and again."""
    before = gc.get_threshold()
    if before == _RARELY:  # asking gc itself what is frozen counts it, which takes 10 ms
        yield
        return
    gc.freeze()
    gc.set_threshold(*_RARELY)
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()
