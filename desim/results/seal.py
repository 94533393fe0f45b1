"""The seal of a run's folder, which shows damage before anybody trusts a number.

The manifest holds the size and the digest of each file, and a digest of itself.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Never

from desim.files import content_below, opened_below, plain_parts
from desim.results.file_names import MANIFEST, MAPS, SUMMARY

MOST_BYTES = 100_000_000  # of a manifest, a summary, or another file of text
_MOST_TABLE_BYTES = 20_000_000_000
_MOST_S = 9e9  # what int64 nanoseconds can count
Json = dict[str, Any]  # an object of a JSON file
_SEAL = "seal"
_DIGITS = 16
_FACTS = {"bytes", "sha256"}


def seal(folder: Path, manifest: Json, names: Iterable[str]) -> None:
    """Write the manifest of ``folder``, with the sizes and digests of its files ``names``. Raises
    ``OSError``."""
    whole = {**manifest, "files": {name: _facts(folder, name) for name in sorted(names)}}
    text = json.dumps({**whole, _SEAL: _sealed(whole)}, indent=2, allow_nan=False)
    (folder / MANIFEST).write_text(text + "\n", "utf-8")


def manifest_of(folder: Path) -> Json | None:
    """The manifest of the run in ``folder``; None where there is none whose own digest is right."""
    try:
        found = parsed(content_below(folder, MANIFEST, MOST_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    if _SEAL not in found or found.pop(_SEAL) != _sealed(found):
        return None
    return found if _is_manifest(found) else None


def parsed(text: bytes) -> Json:
    """The object in a JSON file, without NaN and infinite numbers. Raises ``ValueError`` or
    ``RecursionError``."""
    found = json.loads(text, parse_constant=_refuse)
    if not isinstance(found, dict):
        raise ValueError("is no JSON object")
    return found


def _refuse(constant: str) -> Never:
    raise ValueError(f"{constant} is no number")


def _is_manifest(found: Json) -> bool:
    """Whether it has what a manifest has: anybody can make a seal."""
    seconds, files = found.get("simulated_s"), found.get("files")
    return (all(isinstance(found.get(name), str) for name in ("status", "name", "run_id",
                                                              "desim_version"))
            and isinstance(found.get("seed"), int | None)
            and isinstance(found.get("digest"), str | None)
            and isinstance(seconds, int | float) and 0 <= seconds <= _MOST_S
            and isinstance(files, dict) and all(map(_is_file, files, files.values())))


def _is_file(name: str, facts: object) -> bool:
    try:
        folders = plain_parts(name)[:-1]
    except OSError:
        return False
    return folders in ([], [MAPS]) and isinstance(facts, dict) and facts.keys() == _FACTS


def wrong_with(folder: Path, manifest: Json, name: str) -> str | None:
    """The damage of one of the manifest's files, in words; None if it is as it was written."""
    try:
        facts = manifest["files"][name]
        is_right = _size_bytes(folder, name) == facts["bytes"] and _facts(folder, name) == facts
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
            digest.update(content_below(folder, name, MOST_BYTES))
    return digest.hexdigest()[:_DIGITS]


def _sizes(folder: Path) -> Iterator[tuple[str, int]]:
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                yield entry.name, (-1 if entry.is_dir() else
                                   entry.stat(follow_symlinks=False).st_size)
    except (FileNotFoundError, NotADirectoryError):
        return


def _size_bytes(folder: Path, name: str) -> int:
    with opened_below(folder, name, _MOST_TABLE_BYTES) as file:
        return os.fstat(file.fileno()).st_size


def _facts(folder: Path, name: str) -> Json:
    with opened_below(folder, name, _MOST_TABLE_BYTES) as file:
        return {"bytes": os.fstat(file.fileno()).st_size,
                "sha256": hashlib.file_digest(file, "sha256").hexdigest()[:_DIGITS]}


def _sealed(manifest: Json) -> str:
    return hashlib.sha256(json.dumps(manifest, sort_keys=True).encode()).hexdigest()[:_DIGITS]
