"""Garbage collection, made rarer, and not applied to long-lived objects."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

# Thresholds of gc's three generations. With Python's own (700, 10, 10) the first 20 s of
# scenarios/maze_30.yaml have 14 collections, which take 4 ms of 1.2 s; with these, none.
_RARELY = 50_000, 20, 50


def freeze_present_objects() -> None:
    """Exclude all present objects from garbage collection (``gc.freeze``). For a process of many
    runs: its modules stay, and a search through them takes longer than a small run."""
    gc.freeze()
    gc.set_threshold(*_RARELY)


@contextmanager
def rare_collections() -> Iterator[None]:
    """Collect garbage rarely inside of the block. A run's objects are freed by their reference
    counts; repeated searches for cycles among long-lived objects would find nothing."""
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
