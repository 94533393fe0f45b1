"""Completions for shells: folders of results, YAML files, names. They load no plug-in."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from desim.results.file_names import MANIFEST

_DEEPEST = 4  # folders below the one that was typed
_MOST = 500  # completions: a shell shows no more


def run_folders(incomplete: str) -> list[str]:
    """The folders of runs that begin like this; those of a campaign when its folder is typed."""
    return _found(incomplete, (MANIFEST,))


def campaign_folders(incomplete: str) -> list[str]:
    """The folders of campaigns."""
    return _found(incomplete, ("design.yaml",))


def result_folders(incomplete: str) -> list[str]:
    """The folders of runs and of campaigns."""
    return _found(incomplete, (MANIFEST, "design.yaml"))


def yaml_files(incomplete: str) -> list[str]:
    """YAML files, and folders on the way to one."""
    head, _, tail = incomplete.rpartition("/")
    folder = f"{head}/" if head or incomplete.startswith("/") else ""
    try:
        with os.scandir(folder or ".") as entries:
            found = sorted(f"{folder}{entry.name}{'/' * entry.is_dir()}" for entry in entries
                           if entry.name.startswith(tail) and not entry.name.startswith(".")
                           and (entry.is_dir() or entry.name.endswith((".yaml", ".yml"))))
    except OSError:
        return []
    return found[:_MOST]


def plugin_names(incomplete: str) -> list[str]:
    """The names of the installed plug-ins."""
    from desim.plugins import GROUPS, available

    names = dict.fromkeys(name for kind in GROUPS for name in available(kind))
    return [name for name in sorted(names) if name.startswith(incomplete)]


def localization_names(incomplete: str) -> list[str]:
    """The names of the installed kinds of localization."""
    from desim.plugins import available

    return [name for name in available("localization") if name.startswith(incomplete)]


def case_names(incomplete: str) -> list[str]:
    """The names of network cases."""
    from desim.plugins import available

    return [name for name in available("case") if name.startswith(incomplete)]


def shipped_names(incomplete: str) -> list[tuple[str, str]]:
    """The names of the shipped scenarios, with their questions."""
    from desim.scenario.shipped import shipped

    return [(one.name, one.question) for one in shipped() if one.name.startswith(incomplete)]


def _found(incomplete: str, marks: tuple[str, ...]) -> list[str]:
    typed = incomplete.rpartition("/")[0]
    start = typed if typed and os.path.isdir(typed) else "results"
    found = []
    for folder in _marked(Path(start), marks, 0):
        if str(folder).startswith(incomplete):
            found.append(str(folder))
        if len(found) == _MOST:
            break
    return found


def _marked(folder: Path, marks: tuple[str, ...], depth: int) -> Iterator[Path]:
    """The folders with one of these files; what is inside of a run or a campaign is not looked at,
    unless the search starts there."""
    if depth and any((folder / mark).exists() for mark in marks):
        yield folder
    if depth and (folder / "design.yaml").exists() or depth == _DEEPEST:
        return
    try:
        with os.scandir(folder) as entries:
            below = sorted(entry.path for entry in entries if entry.is_dir(follow_symlinks=False))
    except OSError:
        return
    for path in below:
        yield from _marked(Path(path), marks, depth + 1)
