"""The output of ``desim validate``: published numbers beside measured ones, row by row."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from desim import plugins
from desim.errors import InputError, did_you_mean
from desim.netcases.case import play
from desim.ports.cases import Check, Validation

HEADER = f"{'':4}  {'measured':>12}  {'published':>12}  {'tolerance':>12}"


def chosen(only: Iterable[str]) -> dict[str, Validation]:
    """The groups to run by name, all of them if none is named. Raises ``InputError``."""
    known = plugins.available("validation")
    for name in only:
        if name not in known and ":" not in name:
            raise InputError(f"--only: there is no group {name!r}{did_you_mean(name, known)}; "
                             f"known: {', '.join(known)}")
    names = list(dict.fromkeys(only)) or list(known)
    return {name: plugins.load("validation", name)() for name in names}


def compared(groups: dict[str, Validation], say: Callable[[str], object],
             ) -> list[dict[str, object]]:
    """Make all comparisons and ``say`` each line at once. Returns the records for ``--json``."""
    records = []
    for name, group in groups.items():
        say(f"{name}: {group.source}\n{HEADER}")
        for check in group.checks(play):
            say(line(check))
            records.append({"group": name, "source": group.source, **check._asdict(),
                            "holds": check.holds})
    return records


def line(check: Check) -> str:
    """A row of the table under ``HEADER``."""
    digits = 6  # where no tolerance tells how many are needed
    if 0 < check.tolerance < math.inf:
        digits = min(max(2 - math.floor(math.log10(check.tolerance)), 0), 9)
    numbers = "  ".join(f"{value:12.{digits}f}" for value in (
        check.measured, check.published, check.tolerance))
    return f"{'ok' if check.holds else 'FAIL':4}  {numbers}  {check.unit:<4}  {check.what}".rstrip()
