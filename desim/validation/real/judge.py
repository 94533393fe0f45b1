"""The judge: rows that real programs and our models play, one beside the other."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from desim.errors import InputError
from desim.validation.real.cell import Cell, Played
from desim.validation.real.figures import Figure, JudgedQuantity, figures
from desim.validation.real.sides import modelled, really

_IN_ONE_GUEST = 18  # programs, so that its memory suffices


class JudgedRow(NamedTuple):
    """A row: the same network several times (``cells``), and what is compared."""

    what: str
    cells: Sequence[Cell]
    quantities: Sequence[JudgedQuantity]


class Need(NamedTuple):
    """A thing that the real side needs. ``test``: a command that succeeds where it is there."""

    what: str
    test: Sequence[str]
    remedy: str


def require(needs: Sequence[Need]) -> None:
    """Raise ``InputError`` for the first of ``needs`` that is not met."""
    for need in needs:
        try:
            done = subprocess.run(need.test, capture_output=True, check=False)
        except FileNotFoundError:
            done = None
        if done is None or done.returncode:
            raise InputError(f"--real: there is no {need.what}; {need.remedy}")


def judged(rows: Sequence[JudgedRow], seed: int, out: Path | None,
           on_progress: Callable[[int, int], object]) -> Iterator[Figure]:
    """The figures of ``rows``, by whose ``seed`` the networks draw. ``out``: where the runs with
    real programs stay. ``on_progress`` hears how many cells of how many are played."""
    cells = [cell for row in rows for cell in row.cells]
    real: dict[str, Played] = {}
    left = list(rows)
    for some in _guests(cells):
        on_progress(len(real), len(cells))
        real |= really(some, seed, out)
        while left and all(cell.name in real for cell in left[0].cells):
            row = left.pop(0)
            yield from figures(row.what, row.quantities, [real[cell.name] for cell in row.cells],
                               [modelled(cell, seed) for cell in row.cells])


def _guests(cells: Sequence[Cell]) -> Iterator[list[Cell]]:
    """``cells``, in order, in groups that one guest plays."""
    some: list[Cell] = []
    for cell in cells:
        if some and sum(len(one.acts) for one in [*some, cell]) > _IN_ONE_GUEST:
            yield some
            some = []
        some.append(cell)
    if some:
        yield some
