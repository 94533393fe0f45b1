"""Signals: their names, and Ctrl-C, which a terminal sends to all of its processes."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Block SIGINT, in this thread and for ever in the threads and processes that it begins.
    Windows cannot; there a worker may print where Ctrl-C has met it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def cause_of_death(code: int) -> str:
    """The cause of a process's death, by its exit code as ``subprocess`` has it."""
    return f"exit code {code}" if code >= 0 else signal_name(-code)


def signal_name(number: int) -> str:
    """A signal's name; most of those for real time have none."""
    return signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
