"""A CSV that somebody else wrote; every complaint names its line."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from typing import TextIO, TypeVar

from desim.errors import InputError, did_you_mean

T = TypeVar("T")


class CsvTable:
    """Rows of cells by the names that we have for the columns; perhaps with a line of JSON above.

    ``facts`` is what the JSON says, None if there is none. Every complaint is an ``InputError``
    that begins with ``file:line``.
    """

    def __init__(self, path: str, file: TextIO) -> None:
        self.path, self._file, self._line = path, file, 1
        line = file.readline()
        self.facts: dict[str, object] | None = None
        if line.lstrip().startswith("{"):
            self.facts = self._json(line)
            self._line, line = 2, file.readline()
        self._columns = [column.strip() for column in next(csv.reader([line]), [])]

    def _json(self, line: str) -> dict[str, object]:
        try:
            return json.loads(line)
        except ValueError as error:
            raise self.wrong(f"this is no JSON: {error}") from None

    def named(self, known: dict[str, str], needed: tuple[str, ...]) -> None:
        """Say what the columns are called here, and which must be there."""
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

    def has(self, name: str) -> bool:
        return name in self._names

    def rows(self) -> Iterator[dict[str, str]]:
        """A row may be too short: then its last cells are missing."""
        reader, above = csv.reader(self._file), self._line
        try:
            for cells in reader:
                self._line = above + reader.line_num
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
        return InputError(f"{self.path}:{self._line}: {what}")
