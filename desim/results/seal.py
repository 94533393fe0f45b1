"""The seal of a run's folder, which shows damage before anybody trusts a number.

The manifest holds the size and the digest of each file, and a digest of itself.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from desim.files import content, opened
from desim.results.file_names import MANIFEST, SUMMARY

MAPS = "map"  # the one folder in a run's folder
_MOST_BYTES = 100_000_000  # of a manifest or a summary
Json = dict[str, Any]  # an object of a JSON file
_SEAL = "seal"
_DIGITS = 16


def seal(folder: Path, manifest: Json, names: Iterable[str]) -> None:
    """Write the manifest of ``folder``, with the sizes and digests of its files ``names``. Raises
    ``OSError``."""
    whole = {**manifest, "files": {name: _facts(folder / name) for name in sorted(names)}}
    text = json.dumps({**whole, _SEAL: _sealed(whole)}, indent=2, allow_nan=False)
    (folder / MANIFEST).write_text(text + "\n")


def manifest_of(folder: Path) -> Json | None:
    """The manifest of the run in ``folder``; None where there is none whose own digest is right."""
    try:
        found = json.loads(content(folder / MANIFEST, _MOST_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or _SEAL not in found:
        return None
    return found if found.pop(_SEAL) == _sealed(found) else None


def wrong_with(folder: Path, manifest: Json, name: str) -> str | None:
    """The damage of one of the manifest's files, in words; None if it is as it was written."""
    try:
        is_right = _facts(folder / name) == manifest["files"][name]
        return None if is_right else f"{name} is not what desim wrote"
    except FileNotFoundError:
        return f"{name} is missing"
    except OSError as error:
        return f"{name} {error.strerror or error}"


def damage(folder: Path, manifest: Json) -> str | None:
    """The damage of the first file that is not as it was written, in words; None if all are."""
    return next(filter(None, (wrong_with(folder, manifest, name)
                              for name in manifest["files"])), None)


def likeness(folder: Path) -> str:
    """A cheap digest: of the names and sizes of all files, and of the content of the
    manifest and the summary. Raises ``OSError``."""
    digest = hashlib.sha256()
    for name, size_bytes in sorted([*_sizes(folder), *_sizes(folder / MAPS)]):
        digest.update(f"{name}\0{size_bytes}\n".encode(errors="surrogateescape"))
    for name in (MANIFEST, SUMMARY):
        if os.path.lexists(folder / name):
            digest.update(content(folder / name, _MOST_BYTES))
    return digest.hexdigest()[:_DIGITS]


def _sizes(folder: Path) -> Iterator[tuple[str, int]]:
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                yield entry.name, (-1 if entry.is_dir() else
                                   entry.stat(follow_symlinks=False).st_size)
    except (FileNotFoundError, NotADirectoryError):
        return


def _facts(path: Path) -> Json:
    with opened(path) as file:
        return {"bytes": os.fstat(file.fileno()).st_size,
                "sha256": hashlib.file_digest(file, "sha256").hexdigest()[:_DIGITS]}


def _sealed(manifest: Json) -> str:
    return hashlib.sha256(json.dumps(manifest, sort_keys=True).encode()).hexdigest()[:_DIGITS]
