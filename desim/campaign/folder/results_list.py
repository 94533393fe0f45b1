"""``desim ls``: the runs and campaigns below a folder, damaged ones too."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from desim.campaign.folder import index
from desim.campaign.folder.design_copy import DESIGN, kept_design
from desim.errors import InputError
from desim.results.file_names import MANIFEST, SUMMARY
from desim.results.run import Run
from desim.results.seal import Json
from desim.results.status import RunStatus
from desim.scenario import yaml12

_DEEPEST = 4  # folders below the one that is listed; a campaign's runs are three below it
_RUN_ID = re.compile(r"[0-9a-f]{12}")


class ListedResult(NamedTuple):
    """A folder of a run or a campaign. ``status``: a run's, ``campaign``, ``damaged``, or
    ``partial`` (being written, or cut off); None where a thing is not known."""

    path: Path
    status: str
    ended_s: float  # since 1970: when its manifest or its index was written
    size_bytes: int
    name: str | None = None
    run_id: str | None = None
    seed: int | None = None
    simulated_s: float | None = None
    exploration_time_s: float | None = None
    digest: str | None = None
    note: str = ""

    def json_object(self) -> Json:
        """The entry as an object for ``--json``."""
        return {**self._asdict(), "path": str(self.path)}


def listed(folder: Path) -> list[ListedResult]:
    """The runs and campaigns below ``folder``, newest first: of a campaign one row, unless
    ``folder`` is it. The sizes of a run's files are looked at, not their content. Raises
    ``InputError`` where there is no such folder."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; desim run and desim sweep leave one, results")
    found = list(_below(folder, 0))
    return sorted(found, key=lambda entry: (-entry.ended_s, str(entry.path)))


def _below(folder: Path, depth: int) -> Iterator[ListedResult]:
    if os.path.lexists(folder / MANIFEST) or _RUN_ID.fullmatch(folder.name):
        yield _run(folder)
    elif folder.name.endswith(".partial"):
        yield ListedResult(folder, "partial", folder.stat().st_mtime, _size_bytes(folder),
                           run_id=folder.name.removesuffix(".partial"),
                           note="being written, or cut off")
    elif depth and os.path.lexists(folder / DESIGN):
        yield _campaign(folder)
    elif depth < _DEEPEST:
        with os.scandir(folder) as entries:
            folders = sorted(entry.path for entry in entries if entry.is_dir(follow_symlinks=False))
        for path in folders:
            yield from _below(Path(path), depth + 1)


def _run(folder: Path) -> ListedResult:
    size_bytes = _size_bytes(folder)
    try:
        run = Run(folder)
        manifest = run.manifest
        wrong = next(filter(None, (_missized(folder / name, facts)
                                   for name, facts in manifest["files"].items())), None)
        if wrong is not None:
            raise InputError(wrong)
        explored_s = (run.metrics if run.has(SUMMARY) else {}).get("exploration_time_s")
    except InputError as error:
        file = folder / MANIFEST
        ended_s = (file if os.path.lexists(file) else folder).lstat().st_mtime
        return ListedResult(folder, "damaged", ended_s, size_bytes, name=folder.parent.name,
                            run_id=folder.name,
                            note=str(error).removeprefix(f"{folder}: ").removeprefix("damaged: "))
    return ListedResult(
        folder, manifest["status"], (folder / MANIFEST).stat().st_mtime, size_bytes,
        name=manifest["name"], run_id=manifest["run_id"], seed=manifest["seed"],
        simulated_s=manifest["simulated_s"],
        exploration_time_s=explored_s if isinstance(explored_s, int | float) else None,
        digest=manifest["digest"], note=str(manifest.get("error") or ""))


def _missized(path: Path, facts: Json) -> str | None:
    try:
        size_bytes = path.lstat().st_size
    except OSError:
        return f"{path.name} is missing"
    return None if size_bytes == facts["bytes"] else f"{path.name} is not what desim wrote"


def _campaign(folder: Path) -> ListedResult:
    file = folder / "index.jsonl"
    ended_s = (file if os.path.lexists(file) else folder).lstat().st_mtime
    try:
        design = yaml12.read(str(kept_design(folder)))[0]
        rows, damaged, _ = index.read(file)
    except (InputError, OSError) as error:
        return ListedResult(folder, "damaged", ended_s, _size_bytes(folder), name=folder.name,
                            note=str(error).removeprefix(f"{folder}/"))
    failed = sum(row["status"] == RunStatus.FAILED for row in rows.values())
    parts = [f"{len(rows) - failed} runs", *([f"{failed} failed"] if failed else []),
             *([f"{damaged} damaged lines in {file.name}"] if damaged else [])]
    return ListedResult(folder, "campaign", ended_s, _size_bytes(folder),
                        name=str(design.get("name", folder.name)), note=", ".join(parts))


def _size_bytes(folder: Path) -> int:
    """The bytes of all files below ``folder``, links not followed."""
    total = 0
    with os.scandir(folder) as entries:
        for entry in entries:
            total += _size_bytes(Path(entry.path)) if entry.is_dir(follow_symlinks=False) else \
                entry.stat(follow_symlinks=False).st_size
    return total
