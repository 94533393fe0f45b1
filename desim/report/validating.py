"""``desim validate``: published numbers beside measured ones, row by row as they come."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from desim import plugins
from desim.errors import InputError, did_you_mean
from desim.experiment.netcase import play
from desim.ports.cases import Check

HEADER = f"{'':4}  {'measured':>12}  {'published':>12}  {'tolerance':>12}"


class Row(NamedTuple):
    group: str
    source: str
    check: Check


def chosen(only: Iterable[str]) -> list[str]:
    """The names of the groups to run, all of them if none is named. Raises ``InputError``."""
    known = plugins.available("validation")
    for name in only:
        if name not in known and ":" not in name:
            raise InputError(f"--only: there is no group {name!r}{did_you_mean(name, known)}; "
                             f"known: {', '.join(known)}")
    return list(dict.fromkeys(only)) or list(known)


def rows(groups: Iterable[str]) -> Iterator[Row]:
    """Every comparison, measured when it is asked for."""
    for name in groups:
        group = plugins.load("validation", name)()
        for check in group.checks(play):
            yield Row(name, group.source, check)


def line(check: Check) -> str:
    """A row of the table under ``HEADER``."""
    digits = _digits(check)
    numbers = "  ".join(f"{value:12.{digits}f}" for value in (
        check.measured, check.published, check.tolerance))
    return f"{'ok' if check.holds else 'FAIL':4}  {numbers}  {check.unit:<4}  {check.what}".rstrip()


def _digits(check: Check) -> int:
    """Enough to see the tolerance."""
    if not 0 < check.tolerance < math.inf:
        return 6
    return min(max(2 - math.floor(math.log10(check.tolerance)), 0), 9)


def record(row: Row) -> dict[str, Any]:
    """For ``--json``."""
    return {"group": row.group, "source": row.source, **row.check._asdict(),
            "holds": row.check.holds}
