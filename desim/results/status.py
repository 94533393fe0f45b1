"""The status of a run, one word of its manifest."""

from __future__ import annotations

from enum import StrEnum


class RunStatus(StrEnum):
    """A run's ``status``. Interrupted: by Ctrl-C or a termination signal, its results end there."""

    FINISHED = "finished"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
