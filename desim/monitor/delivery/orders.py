"""Orders that arrive: at random, by a list, or from a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np

from desim.errors import InputError, did_you_mean
from desim.ports.delivery import TransportOrder
from desim.ports.files import CsvTable
from desim.units import DURATION

Arrival = tuple[int, str, str]  # the time in ns, the stations of pick and drop
_COLUMNS = {"time": "time", "pick": "pick", "drop": "drop"}
_MOST = 1_000_000


class OrderRecord:
    """An order, from its arrival on."""

    def __init__(self, order: TransportOrder, arrived_ns: int) -> None:
        self.order, self.arrived_ns = order, arrived_ns
        self.done_ns: int | None = None
        self.is_picked = False


def poisson(picks: Sequence[str], drops: Sequence[str], every_ns: int,
            generator: np.random.Generator) -> Iterator[Arrival]:
    """Orders at exponential intervals with the mean ``every_ns``, without end, each from one of
    ``picks`` to one of ``drops``, which are equally likely."""
    time_ns = 0
    while True:
        time_ns += round(generator.exponential(every_ns))
        yield (time_ns, picks[int(generator.integers(len(picks)))],
               drops[int(generator.integers(len(drops)))])


def listed(orders: Sequence[Arrival], picks: Sequence[str], drops: Sequence[str]) -> list[Arrival]:
    """``orders`` by time. Raises ``InputError`` for stations that are not there."""
    for i, (_, *names) in enumerate(orders):
        for name, kind, known in zip(names, ("pick", "drop"), (picks, drops), strict=True):
            if name not in known:
                raise InputError(f".orders.{i}: {_unknown(name, kind, known)}")
    return sorted(orders)


def from_file(path: str, picks: Sequence[str], drops: Sequence[str]) -> list[Arrival]:
    """The orders of a CSV with the columns time (of the run, in s, or with a unit), pick and drop.
    Raises ``InputError`` with the line that is wrong."""
    table = CsvTable(path)
    table.named(_COLUMNS, tuple(_COLUMNS))
    found: list[Arrival] = []
    for row in table.rows():
        if len(found) == _MOST:
            raise table.wrong(f"too many orders; allowed: {_MOST:,}")
        time_ns = table.value(row, "time", _time_ns, "a time such as 12.5 or 3 min")
        pick, drop = row.get("pick", ""), row.get("drop", "")
        for name, kind, known in ((pick, "pick", picks), (drop, "drop", drops)):
            if name not in known:
                raise table.wrong(_unknown(name, kind, known))
        found.append((time_ns, pick, drop))
    return sorted(found)


def _unknown(name: str, kind: str, known: Sequence[str]) -> str:
    return (f"no station {name!r} of the kind {kind}{did_you_mean(name, known)}; allowed: "
            f"{', '.join(known)}")


def _time_ns(cell: str) -> int:
    with suppress(ValueError):  # it has a unit
        cell = f"{float(cell)!r} s"
    time_ns: int = DURATION.parse(cell)
    return time_ns
