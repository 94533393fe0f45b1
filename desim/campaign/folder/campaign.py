"""A campaign's folder as an object for analyses."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from desim.campaign.design.design import Design, read_design
from desim.campaign.folder import table
from desim.campaign.folder.design_copy import kept_design
from desim.campaign.folder.run_folders import run_folders
from desim.errors import InputError
from desim.results.frames import data_frame
from desim.results.run import Run, arrays
from desim.results.shown import InNotebooks
from desim.results.status import RunStatus

if TYPE_CHECKING:
    import pandas


class Campaign(InNotebooks):
    """A campaign's folder, as ``desim sweep`` leaves it. Everything is read on demand. Iterating
    gives its finished runs, by vector and iteration."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not kept_design(self.path).is_file():
            raise InputError(f"{self.path}: not the folder of a campaign; that has a design.yaml, "
                             "see desim sweep")

    @cached_property
    def design(self) -> Design:
        """The design, every default spelled out."""
        return read_design(str(kept_design(self.path)))[0]

    @cached_property
    def runs(self) -> dict[str, np.ndarray]:
        """The table of all runs that are done, failed ones too, by column."""
        return arrays(table.read(self.path / "runs.parquet"))

    def to_pandas(self) -> pandas.DataFrame:
        """The same table as a data frame. Raises ``InputError`` where pandas is not installed."""
        return data_frame(self.runs)

    def run(self, run_id: str) -> Run:
        """One of its runs. Raises ``InputError`` where there is no folder of it."""
        folder = run_folders(self.path).get(run_id)
        if folder is not None:
            return Run(folder)
        errors = dict(zip(self.runs["run_id"], self.runs["error"], strict=True))
        raise InputError(f"{self.path}: " + (f"run {run_id!r} has left no folder: {errors[run_id]}"
                                             if run_id in errors else f"has no run {run_id!r}"))

    def __iter__(self) -> Iterator[Run]:
        for run_id, status in zip(self.runs["run_id"], self.runs["status"], strict=True):
            if status == RunStatus.FINISHED:
                yield self.run(run_id)

    def __repr__(self) -> str:
        return f"Campaign({str(self.path)!r})"
