"""The status of a run, one word of its manifest."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path

from desim.errors import InputError
from desim.results.file_names import SCENARIO
from desim.results.seal import Json, manifest_of


class RunStatus(StrEnum):
    """A run's ``status``. Interrupted: by Ctrl-C or a termination signal, its results end there.
    Imported: it was not simulated, but made of a recording of other software."""

    FINISHED = "finished"
    INTERRUPTED = "interrupted"
    FAILED = "failed"
    IMPORTED = "imported"


def is_imported(manifest: Mapping[str, object]) -> bool:
    """Whether a run with this manifest is a recording of somebody else's robots."""
    return manifest["status"] == RunStatus.IMPORTED


def refuse_imported(path: Path, manifest: Json, missing: str) -> None:
    """Raise ``InputError`` for the run in ``path`` if it was imported: it has no ``missing``."""
    if is_imported(manifest):
        raise InputError(f"{path}: it was imported from {manifest['source']}: it has no {missing}, "
                         "and cannot be repeated")


def refuse_imported_scenario(scenario: Path) -> None:
    """Raise ``InputError`` for the ``scenario.resolved.yaml`` of a run that was imported: it names
    the robots, and there is nothing to run."""
    if scenario.name == SCENARIO:
        manifest = manifest_of(scenario.parent)
        if manifest is not None:
            refuse_imported(scenario.parent, manifest, "scenario to run")
