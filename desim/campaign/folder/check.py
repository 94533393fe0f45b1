"""``desim check``: what of a run's or a campaign's folder is whole, was healed, or is missing."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from desim.campaign.folder import index
from desim.campaign.folder.campaign import Campaign
from desim.campaign.folder.design_copy import DESIGN
from desim.campaign.folder.run_folders import run_folders
from desim.errors import InputError
from desim.results.file_names import MANIFEST, WRITTEN
from desim.results.run import Run
from desim.results.seal import wrong_with
from desim.results.status import RunStatus


class FolderCheck(NamedTuple):
    """The state of a folder in words: ``lines``; and all that is ``wrong`` with it."""

    lines: list[str]
    wrong: list[str]


def checked(folder: Path) -> FolderCheck:
    """Look at all files of a run or of a campaign; nothing is changed. Raises ``InputError`` for a
    folder that is neither."""
    return _campaign(Campaign(folder)) if os.path.lexists(folder / DESIGN) else _run(Run(folder))


def _run(run: Run) -> FolderCheck:
    files = run.manifest["files"]
    wrong = list(filter(None, (wrong_with(run.path, run.manifest, name) for name in files)))
    with os.scandir(run.path) as entries:
        others = sorted(entry.name for entry in entries
                        if entry.name not in (*files, *WRITTEN, "map"))
    lines = [f"a run, {run.manifest['status']}: {len(files) - len(wrong)} of {len(files)} files "
             f"are as desim wrote them; its {MANIFEST} is whole"]
    if others:
        lines.append(f"not part of the run, and never removed: {', '.join(others)}")
    if "healed" in run.manifest:
        lines.append(f"healed: it was made again, for the one before was damaged: "
                     f"{run.manifest['healed']}")
    return FolderCheck(lines, [f"{line}; running its scenario again mends it" for line in wrong])


def _campaign(campaign: Campaign) -> FolderCheck:
    path = campaign.path
    wrong, failed, table = list(_index_damage(path)), {}, {}
    try:
        table = campaign.runs
        failed = {run_id: error for run_id, status, error in zip(
            table["run_id"], table["status"], table["error"], strict=True)
            if status == RunStatus.FAILED}
    except InputError as error:
        wrong.append(str(error).removeprefix(f"{path}/"))
    leftovers = {f"{run_id}.partial" for run_id in failed}  # which the next try empties
    folders = {name: folder for name, folder in run_folders(path).items() if name not in leftovers}
    whole = 0
    for name, folder in folders.items():
        try:
            if name.endswith(".partial"):
                raise InputError(f"{folder}: a run that is being written, or was cut off")
            damaged = _run(Run(folder)).wrong
        except InputError as error:
            damaged = [str(error).removeprefix(f"{folder}: ")]
        whole += not damaged
        wrong += [f"{folder.relative_to(path)}: {line}" for line in damaged]
    lines = [f"a campaign, {campaign.design.name}: {whole} of {len(folders)} folders of runs are "
             "whole"]
    sweep = shlex.join(["desim", "sweep", str(path / DESIGN), "--out", str(path)])
    if wrong:
        lines.append(f"{sweep} mends what is damaged and makes what is missing")
    if failed:
        first, cause = next(iter(failed.items()))
        lines += [f"{len(failed)} of {len(table['run_id'])} runs failed, the first ({first}): "
                  f"{cause}", f"{sweep} --retry-failed makes them again"]
    return FolderCheck(lines, wrong)


def _index_damage(folder: Path) -> Iterator[str]:
    try:
        rows, damaged, rest_bytes = index.read(folder / "index.jsonl")
    except OSError as error:
        yield f"index.jsonl: {error.strerror}"
        return
    if damaged or rest_bytes:
        yield f"index.jsonl: {damaged + bool(rest_bytes)} lines are damaged"
    there = run_folders(folder)
    gone = [run_id for run_id, row in rows.items()
            if row["status"] == RunStatus.FINISHED and run_id not in there]
    yield from (f"{run_id}: the run has finished, and its folder is gone" for run_id in gone)
