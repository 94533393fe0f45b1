"""Python's search for garbage in cycles: rarely, and not among what stays."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_RARELY = 50_000, 20, 50


def keep_what_there_is() -> None:
    """For a process of many runs: its modules stay, and looking through them takes longer than a
    small run. What is there now is never looked at again."""
    gc.freeze()
    gc.set_threshold(*_RARELY)


@contextmanager
def rare_collections() -> Iterator[None]:
    """What a run makes goes when nobody refers to it any more; Python's search for cycles among all
    that stays would find nothing, again and again."""
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
