"""The types of checks: their findings, and the paths that they read."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path

Found = Iterator[tuple[Path, str]]  # what is wrong, each with its path
# The paths that a check reads, and the check; a path stands for all below it.
Checks = tuple[tuple[tuple[Path, ...], Callable[[Scenario, Folder], Found]], ...]
