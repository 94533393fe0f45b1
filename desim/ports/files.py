"""Files that a scenario names: plug-ins read them with the limits that desim has for strangers'."""

from __future__ import annotations

import csv
import json
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TypeVar

from desim.errors import InputError, did_you_mean
from desim.unpacking import lines

T = TypeVar("T")
_MOST_COLUMNS = 12  # named in a complaint


class CsvTable:
    """A CSV that somebody else wrote: rows of cells by the names of the columns, or by those that
    we have for them; perhaps with a line of JSON above. One that is packed with gzip is unpacked
    while it is read.

    ``facts`` is what the JSON says, None if there is none; ``line`` the number of the line that was
    read last. Every complaint is an ``InputError`` that begins with the file, and with the line
    where there is one.
    """

    def __init__(self, path: str) -> None:
        self.path, self.line = path, 1
        self._lines = self._text()
        line = next(self._lines, "")
        self.facts: dict[str, object] | None = None
        if line.lstrip().startswith("{"):
            self.facts = self._json(line)
            self.line, line = 2, next(self._lines, "")
        try:
            self._columns = [column.strip() for column in next(csv.reader([line]), [])]
        except csv.Error as error:
            raise self.wrong(f"this is no CSV: {error}") from None
        self._names = self._columns

    def _text(self) -> Iterator[str]:
        try:
            for count, line in lines(self.path):
                yield line.decode("utf-8-sig" if count == 1 else "utf-8")
        except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{self.path}: cannot be read: {reason}") from None

    def _json(self, line: str) -> dict[str, object]:
        try:
            facts: dict[str, object] = json.loads(line)
        except ValueError as error:
            raise self.wrong(f"this is no JSON: {error}") from None
        except RecursionError:
            raise self.wrong("this JSON is nested too deeply") from None
        return facts

    def named(self, known: Mapping[str, str], needed: tuple[str, ...]) -> None:
        """Say what the columns are called here, and which must be there; there may be no others."""
        self._names = []
        for column in self._columns:
            if column not in known:
                raise self.wrong(f"unknown column {column!r}{did_you_mean(column, known)}; "
                                 f"allowed: {', '.join(known)}")
            self._names.append(known[column])
        for column, name in known.items():
            if name in needed and name not in self._names:
                raise self.wrong(f"the column {column!r} is missing; there are "
                                 f"{', '.join(self._columns)}")

    def about(self, *columns: str) -> bool:
        """Whether it has any of these columns."""
        return any(column in self._columns for column in columns)

    def has(self, name: str) -> bool:
        """Whether it has the column that we call so."""
        return name in self._names

    def first_of(self, names: Iterable[str]) -> str:
        """The first of ``names`` that it has. Raises ``InputError`` if it has none of them."""
        for name in names:
            if self.has(name):
                return name
        there = ", ".join(self._columns[:_MOST_COLUMNS])
        more = ", ..." * (len(self._columns) > _MOST_COLUMNS)
        raise self.wrong(f"there is no column of {' or '.join(names)}"
                         f"{f'; there are {there}{more}' if there else ''}")

    def rows(self) -> Iterator[dict[str, str]]:
        """A row may be too short: then its last cells are missing."""
        reader, above = csv.reader(self._lines), self.line
        try:
            for cells in reader:
                self.line = above + reader.line_num
                if len(cells) > len(self._names):
                    raise self.wrong(f"{len(cells)} cells; allowed: at most {len(self._names)}, "
                                     "one for each column")
                if cells:
                    yield dict(zip(self._names, map(str.strip, cells), strict=False))
        except csv.Error as error:
            raise self.wrong(f"this is no CSV: {error}") from None

    def value(self, row: dict[str, str], name: str, parse: Callable[[str], T], wanted: str
              ) -> T:
        """The cell as ``parse`` reads it, which raises ``ValueError`` for a cell that is not
        ``wanted``."""
        cell = row.get(name, "")
        try:
            return parse(cell)
        except ValueError:
            column = self._columns[self._names.index(name)]
            raise self.wrong(f"{column} is {cell!r}; allowed: {wanted}") from None

    def wrong(self, what: str) -> InputError:
        """A complaint about the line that was read last."""
        return InputError(f"{self.path}:{self.line}: {what}")


def number(cell: str, least: float, most: float) -> float:
    """The number in a cell. Raises ``ValueError`` for what is none, and for one out of bounds."""
    value = float(cell)
    if not least <= value <= most:  # NaN is not
        raise ValueError
    return value
