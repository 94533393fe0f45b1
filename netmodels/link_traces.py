"""Link traces in files: measurements between two nodes, with their times or places.

A plain CSV has the columns ``time_s``, ``source``, ``destination``, at least one of
``delivery_ratio`` (0 to 1), ``rssi_dbm`` and those of ``UNITS``, and perhaps ``channel``. One with
``x_m`` and ``y_m`` is a survey: what was measured there of ``node``, whatever the time. The K7
format (Brun-Laguna et al., github.com/keomabrun/k7) is a line of JSON with what is known of the
whole, and a CSV below it: ``datetime`` (ISO 8601), ``src``, ``dst``, ``channel``, ``mean_rssi``,
``pdr``, and more that does not matter here. A file that is packed with gzip is unpacked while it is
read.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from operator import attrgetter
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from desim.errors import InputError
from desim.ports.files import CsvTable, number
from desim.units import NS_PER_S

Quantity = Literal["delivery_ratio", "rssi_dbm"]
QUANTITIES: tuple[Quantity, ...] = ("delivery_ratio", "rssi_dbm")
# Columns of a chance, a time and a rate by their units, in a ratio, ns and bit/s. An empty cell of
# these says nothing new.
UNITS: dict[str, dict[str, float]] = {
    "loss": {"loss_ratio": 1.0, "loss_percent": 0.01},
    "delay": {"delay_s": 1e9, "delay_ms": 1e6, "delay_us": 1e3},
    "rate": {"rate_bps": 1.0, "rate_kbps": 1e3, "rate_mbps": 1e6}}
_MOST = {"loss": 1.0, "delay": 3.6e12, "rate": 1e12}  # an hour, 1 Tb/s: more is in another unit
_SCALES = {column: (scale, _MOST[what] / scale) for what, units in UNITS.items()
           for column, scale in units.items()}

# Column to what it is here.
_VALUES = {column: column for column in (*QUANTITIES, *_SCALES)}
_PLAIN = {"time_s": "time", "source": "source", "destination": "destination", "channel": "channel",
          **_VALUES}
_SURVEY = {"x_m": "x", "y_m": "y", "node": "node", "time_s": "", "channel": "channel", **_VALUES}
_K7 = {"datetime": "time", "src": "source", "dst": "destination", "channel": "channel",
       "mean_rssi": "rssi_dbm", "pdr": "delivery_ratio", "tx_count": "", "transaction_id": ""}

_LONGEST_S = 1e9  # 32 years: a larger number is no time in seconds
_FARTHEST_M = 1e6  # a larger number is no place of a robot
_LOUDEST_DBM = 1000.0  # either way: a larger number is no power
_SILENT_DBM = -300.0  # far below all noise: never received
_INSTANT = re.compile(r"(\d{4}-\d\d-\d\d[ T]\d\d:\d\d:\d\d(?:\.\d{1,9})?)Z?")


class MeasuredLink(NamedTuple):
    """A link's values: from ``times_ns[k]`` on ``values[k]``, the newest one of each channel."""

    times_ns: list[int]
    values: list[tuple[float, ...]]

    def at(self, time_ns: int) -> tuple[float, ...]:
        """The values at a time; none before the first row."""
        k = bisect_right(self.times_ns, time_ns)
        return self.values[k - 1] if k else ()


class LinkTraces(NamedTuple):
    """The values of a column: ``links`` by source and destination, as the file calls them."""

    column: str
    links: dict[tuple[str, str], MeasuredLink]


class Survey(NamedTuple):
    """The measurements of a node: ``values[k]`` at ``places_m[k]``, by x and then y."""

    places_m: np.ndarray
    values: list[tuple[float, ...]]

    def at(self, place_m: np.ndarray) -> tuple[float, ...]:
        """The values of the nearest place, the first of several; none where NaN is asked for."""
        if np.isnan(place_m).any():
            return ()
        return self.values[int(((self.places_m - place_m) ** 2).sum(axis=1).argmin())]


class Surveys(NamedTuple):
    """The values of a column: ``nodes`` as the file calls them."""

    column: str
    nodes: dict[str, Survey]


class _Row(NamedTuple):
    time_ns: int
    link: tuple[str, str]
    channel: int | None
    value: float


class _Point(NamedTuple):
    node: str
    place_m: tuple[float, float]
    channel: int | None
    value: float


R = TypeVar("R", _Row, _Point)


def read(path: str, columns: Sequence[str], channel: int | None) -> LinkTraces | Surveys:
    """The trace or survey in a file: of the first of ``columns`` that it has, of one ``channel``
    (None: of all). Rows may stand in any order. Raises ``InputError`` for whatever is wrong with
    the file."""
    table = CsvTable(path)
    if table.facts is None and table.about("x_m", "y_m"):
        table.named(_SURVEY, ("x", "y", "node"))
        column = table.first_of(columns)
        return Surveys(column, _surveys(
            _on(channel, _points(table, column), f"{path}: no row of a place")))
    table.named(_PLAIN if table.facts is None else _K7, ("time", "source", "destination"))
    column = table.first_of(columns)
    rows = _on(channel, _rows(table, column), f"{path}: no row of a link")
    begin_ns = 0 if table.facts is None else _begin_ns(table, rows)
    return LinkTraces(column, _links(rows, begin_ns))


def _on(channel: int | None, rows: Iterable[R], none: str) -> list[R]:
    """The rows of a channel; raises ``InputError`` if there are none."""
    chosen = [row for row in rows if channel in (None, row.channel)]
    if not chosen:
        raise InputError(none + ("" if channel is None else f" on channel {channel}"))
    return chosen


def _rows(table: CsvTable, column: str) -> Iterator[_Row]:
    """K7 has rows without a source or a destination, which are means over several links; they are
    passed over."""
    time, when = ((_elapsed_ns, "seconds, at least 0") if table.facts is None else
                  (_instant_ns, "a date and time as 2018-01-11 16:33:07"))
    for row in table.rows():
        ends = row.get("source", ""), row.get("destination", "")
        if all(ends):
            at_ns = table.value(row, "time", time, when)
            for measured in _measured(table, row, column):
                yield _Row(at_ns, ends, *measured)
        elif table.facts is None:
            raise table.wrong("source or destination is missing")


def _points(table: CsvTable, column: str) -> Iterator[_Point]:
    for row in table.rows():
        if not row.get("node"):
            raise table.wrong("node is missing")
        x_m, y_m = (table.value(row, axis, lambda cell: number(cell, -_FARTHEST_M, _FARTHEST_M),
                                "metres") for axis in ("x", "y"))
        for measured in _measured(table, row, column):
            yield _Point(row["node"], (x_m, y_m), *measured)


def _measured(table: CsvTable, row: dict[str, str], column: str
              ) -> Iterator[tuple[int | None, float]]:
    """The channel and the value of a row, if it has a value."""
    channel = table.value(row, "channel", lambda cell: int(cell) if cell else None,
                          "a number, or nothing")
    if column == "rssi_dbm":
        yield channel, table.value(row, column, _rssi_dbm,
                                   "dBm, or nothing where nothing was heard")
    elif row.get(column) or column not in _SCALES:
        scale, most = _SCALES.get(column, (1.0, 1.0))
        yield channel, scale * table.value(row, column, lambda cell: number(cell, 0.0, most),
                                           f"0 to {most:.12g}")


def _begin_ns(table: CsvTable, rows: list[_Row]) -> int:
    """The beginning of a K7 trace: its ``start_date``, or its first row."""
    start = (table.facts or {}).get("start_date")
    try:
        return _instant_ns(start) if isinstance(start, str) else min(row.time_ns for row in rows)
    except ValueError:
        raise InputError(f"{table.path}:1: start_date is {start!r}; allowed: a date and time as "
                         "2018-01-11 16:32:22") from None


def _links(rows: list[_Row], begin_ns: int) -> dict[tuple[str, str], MeasuredLink]:
    links: dict[tuple[str, str], MeasuredLink] = {}
    newest: dict[tuple[str, str], dict[int | None, float]] = {}
    for row in sorted(rows, key=attrgetter("time_ns")):  # of two at a time the later line counts
        times_ns, values = links.setdefault(row.link, MeasuredLink([], []))
        by_channel = newest.setdefault(row.link, {})
        by_channel[row.channel] = row.value
        times_ns.append(row.time_ns - begin_ns)
        values.append(tuple(by_channel.values()))
    return links


def _surveys(rows: list[_Point]) -> dict[str, Survey]:
    by_node: dict[str, dict[tuple[float, float], tuple[float, ...]]] = {}
    for row in rows:
        values = by_node.setdefault(row.node, {})
        values[row.place_m] = (*values.get(row.place_m, ()), row.value)
    return {node: Survey(np.array(sorted(values)), [values[place] for place in sorted(values)])
            for node, values in by_node.items()}


def _elapsed_ns(cell: str) -> int:
    return round(number(cell, 0.0, _LONGEST_S) * NS_PER_S)


def _instant_ns(cell: str) -> int:
    match = _INSTANT.fullmatch(cell)
    if match is None:
        raise ValueError
    return int(np.datetime64(match[1], "ns").astype(np.int64))


def _rssi_dbm(cell: str) -> float:
    return number(cell, -_LOUDEST_DBM, _LOUDEST_DBM) if cell else _SILENT_DBM
