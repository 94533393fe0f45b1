"""The index of a campaign: a line of JSON for each run that has ended, with a checksum at its end.

Lines are appended and never changed. The index is a copy of what the runs' folders say, and is made
again from these if it is damaged.
"""

from __future__ import annotations

import errno
import json
import os
import zlib
from collections.abc import Iterator
from pathlib import Path

from desim.campaign.folder.run_folders import Folders
from desim.errors import InputError
from desim.files import opened_below, refuse_link, replacing
from desim.results.row import Row, Rows
from desim.results.status import RunStatus

_FINISHED_HAS = {"digest", "cost", "metrics", "functions"}
_MOST_BYTES = 10**11  # 25 times what a campaign of 1,000,000 runs writes
_LONGEST_BYTES = 10_000_000  # of a line, which has some 4000
_CHECK = b', "check": "'


class Index:
    """The index file. ``rows`` are by run id; if a run has several lines, the last one counts.

    A line at the end that was ``cut_off`` (the process was killed, the disk was full) is taken
    away; ``damaged`` is the number of other lines that cannot be read: ``recover`` then writes the
    file anew. ``lost``: there was no line. Raises ``OSError``.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        refuse_link(path)
        self.rows, self.damaged, rest_bytes = read(path)
        self.cut_off = bool(rest_bytes)
        self.lost = not self.rows and not self.damaged
        # Unbuffered: a line is in the file, whole, or not at all, when add returns.
        self._file = open(path, "ab", buffering=0)  # noqa: SIM115
        if rest_bytes:
            os.truncate(path, path.stat().st_size - rest_bytes)

    def add(self, row: Row) -> None:
        """Append a run. Raises ``OSError``; the line is then not there."""
        line = line_of(row)
        end = self._file.seek(0, os.SEEK_END)
        try:
            if self._file.write(line) != len(line):
                raise OSError("the line was cut off")
        except OSError:
            os.truncate(self._file.fileno(), end)
            raise
        self.rows[row["run_id"]] = row

    def recover(self, folders: Folders) -> dict[str, str]:
        """Bring the index in line with the folders (see ``recovered``). A run that cannot be read
        is forgotten, and returned with the reason."""
        earlier = self.rows
        self.rows, wrong = recovered(earlier, folders)
        if self.damaged:
            self._rewrite()
        else:
            for row in [row for run_id, row in self.rows.items() if row != earlier.get(run_id)]:
                self.add(row)
        return wrong

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _rewrite(self) -> None:
        """Replace the damaged file by the lines that could be read, in one rename."""
        with replacing(self._path) as beside, open(beside, "wb") as file:
            file.writelines(map(line_of, self.rows.values()))
            file.flush()
        self._file.close()
        self._file = open(self._path, "ab", buffering=0)  # noqa: SIM115


def recovered(rows: Rows, folders: Folders) -> tuple[Rows, dict[str, str]]:
    """The rows brought in line with the ``folders`` of runs, and the reasons why some cannot be
    read. A finished run without a folder is left out. A run is read again if its folder has changed
    since, if its row lacks one of the functions, or if one of these raised, because that may have
    been mended."""
    known = dict.fromkeys(folders.present())
    found = {run_id: row for run_id, row in rows.items()
             if run_id in known or row["status"] != RunStatus.FINISHED}
    wrong: dict[str, str] = {}
    for run_id in known:
        if not _is_current(found.get(run_id), folders.likeness(run_id), folders.functions):
            try:
                found[run_id] = folders.row(run_id)
            except InputError as error:
                wrong[run_id] = str(error)
                found.pop(run_id, None)
    return found, wrong


def _is_current(row: Row | None, folder: str | None, functions: tuple[str, ...]) -> bool:
    """Whether a row is what reading a folder of this likeness again would give."""
    return (row is not None and row.get("folder") == folder and "raised" not in row
            and (row["status"] == RunStatus.FAILED
                 or all(name in row["functions"] for name in functions)))


def read(path: Path) -> tuple[dict[str, Row], int, int]:
    """The rows of an index by run id (none without a file), the number of unreadable lines, and the
    number of bytes of a last line that was cut off. Raises ``OSError``."""
    rows: dict[str, Row] = {}
    damaged, rest_bytes = 0, 0
    names: dict[tuple[str, ...], tuple[str, ...]] = {}
    for line in _lines(path):
        if not line.endswith(b"\n"):
            rest_bytes = len(line)
            break
        row = _row(line[:-1])
        if row is None:
            damaged += 1
            continue
        if "metrics" in row:  # thousands of rows share one set of names
            own = tuple(row["metrics"])
            row["metrics"] = dict(zip(names.setdefault(own, own), row["metrics"].values(),
                                      strict=True))
        rows[row["run_id"]] = row
    return rows, damaged, rest_bytes


def _lines(path: Path) -> Iterator[bytes]:
    if not os.path.lexists(path):
        return
    with opened_below(path.parent, path.name, _MOST_BYTES) as file:
        while line := file.readline(_LONGEST_BYTES):
            if len(line) == _LONGEST_BYTES:
                raise OSError(errno.EFBIG, f"a line of more than {_LONGEST_BYTES / 1e6:.0f} MB",
                              os.fspath(path))
            yield line


def line_of(row: Row) -> bytes:
    """A row as a line of the index: a JSON object whose last key is the checksum of the others."""
    text = json.dumps(row, allow_nan=False)[:-1].encode()
    return b'%s%s%s"}\n' % (text, _CHECK, _checked(text))


def _checked(text: bytes) -> bytes:
    return b"%08x" % zlib.crc32(text)


def _row(line: bytes) -> Row | None:
    """The row of a line; None for a line that is damaged or holds no row."""
    text, _, check = line.rpartition(_CHECK)
    if check != _checked(text) + b'"}':
        return None
    try:
        row = json.loads(text + b"}")
    except (ValueError, RecursionError):
        return None
    if not (isinstance(row, dict) and isinstance(row.get("run_id"), str)):
        return None
    whole = (row.get("status") == RunStatus.FAILED and "error" in row
             or row.get("status") == RunStatus.FINISHED and row.keys() >= _FINISHED_HAS
             and isinstance(row["metrics"], dict) and isinstance(row["functions"], dict))
    return row if whole else None
