"""Runs for exporters: a usual one, an odd one each, and progress that nobody looks at."""

from __future__ import annotations

import desim
from desim.results.run import Run


def quiet(part: int, whole: int) -> None:
    """Progress that nobody looks at."""


def made(repository, out, *overrides: str, file: str = "hello.yaml") -> Run:
    """A run of a scenario of the checkout."""
    return desim.run(repository / "scenarios" / file, overrides=overrides, out=out)
