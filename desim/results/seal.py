"""The seal of a run's folder. The manifest says how large each file is and what its digest is, and
what its own digest is, so that damage shows whatever it is, before anybody trusts a number.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from desim.files import content, opened

MANIFEST, SUMMARY = "manifest.json", "summary.json"
MAPS = "map"  # the one folder in a run's folder
_MOST_BYTES = 100_000_000  # of a manifest or a summary
_SEAL = "seal"
_DIGITS = 16


def seal(folder: Path, manifest: dict[str, Any], names: Iterable[str]) -> None:
    """Write the manifest of ``folder``, with the facts of the files in it that are so called.
    Raises ``OSError``."""
    whole = {**manifest, "files": {name: _facts(folder / name) for name in sorted(names)}}
    text = json.dumps({**whole, _SEAL: _sealed(whole)}, indent=2, allow_nan=False)
    (folder / MANIFEST).write_text(text + "\n")


def manifest_of(folder: Path) -> dict[str, Any] | None:
    """The manifest of the run in ``folder``; None where there is none, or one that desim has not
    written so."""
    try:
        found = json.loads(content(folder / MANIFEST, _MOST_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or _SEAL not in found:
        return None
    own = found.pop(_SEAL)
    return found if own == _sealed(found) else None


def wrong_with(folder: Path, manifest: dict[str, Any], name: str) -> str | None:
    """In words, what is wrong with a file that the manifest knows; None if nothing is."""
    try:
        right = _facts(folder / name) == manifest["files"][name]
    except FileNotFoundError:
        return f"{name} is missing"
    except OSError as error:
        return f"{name} {error.strerror or error}"
    return None if right else f"{name} is not what desim wrote"


def damage(folder: Path, manifest: dict[str, Any]) -> str | None:
    """In words, the first file of all that is not as it was written; None if there is none."""
    return next(filter(None, (wrong_with(folder, manifest, name)
                              for name in manifest["files"])), None)


def likeness(folder: Path) -> str:
    """A digest that is cheap: of the names and sizes of all files, and of the content of the
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


def _facts(path: Path) -> dict[str, Any]:
    with opened(path) as file:
        return {"bytes": os.fstat(file.fileno()).st_size,
                "sha256": hashlib.file_digest(file, "sha256").hexdigest()[:_DIGITS]}


def _sealed(manifest: dict[str, Any]) -> str:
    text = json.dumps(manifest, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
