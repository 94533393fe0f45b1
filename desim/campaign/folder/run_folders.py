"""The folders of a campaign's runs, and whether each is as it was when its row was made."""

from __future__ import annotations

import os
import re
from pathlib import Path

from desim.errors import InputError
from desim.results.row import Row, row_of
from desim.results.run import Run
from desim.results.seal import damage, likeness

_ID = re.compile(r"[0-9a-f]{12}")


def run_folders(campaign: Path) -> dict[str, Path]:
    """The folders of runs in that of a campaign, by run id; links are none."""
    return {run.name: run for scenario in _folders(campaign / "runs") for run in _folders(scenario)}


def _folders(place: Path) -> list[Path]:
    """The folders in a folder, none where it is a link."""
    if place.is_symlink() or not place.is_dir():
        return []
    with os.scandir(place) as entries:
        return [place / name for name in sorted(
            entry.name for entry in entries if entry.is_dir(follow_symlinks=False))]


class Folders:
    """The runs' folders in ``place``, which is ``runs/<scenario>``. ``functions`` are the paths of
    metrics that read a run's folder."""

    def __init__(self, place: Path, functions: tuple[str, ...]) -> None:
        self.place, self.functions = place, functions

    def present(self) -> list[str]:
        """The ids of runs that may be finished. Raises ``OSError``."""
        try:
            with os.scandir(self.place) as entries:
                return sorted(entry.name for entry in entries
                              if _ID.fullmatch(entry.name)
                              and entry.is_dir(follow_symlinks=False))
        except FileNotFoundError:  # nothing has been run yet
            return []

    def likeness(self, run_id: str) -> str | None:
        """The likeness of the run's folder, which is the ``folder`` of its row; None without a
        folder."""
        try:
            return likeness(self.place / run_id)
        except OSError:
            return None

    def row(self, run_id: str) -> Row:
        """The row of a run, read again from its folder. Raises ``InputError`` if the folder is not
        as desim wrote it, or holds another run."""
        run = Run(self.place / run_id)
        if run.manifest["run_id"] != run_id:
            raise InputError(f"{run.path}: damaged: holds the run {run.manifest['run_id']}")
        wrong = damage(run.path, run.manifest)
        if wrong is not None:
            raise InputError(f"{run.path}: damaged: {wrong}")
        return row_of(run, self.functions)
