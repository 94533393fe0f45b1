"""A campaign's memory: one line of JSON for each run that came to an end, appended and never
changed. It is a copy of what the runs' folders say, and is made again from these if it is damaged.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

from desim.campaign.work import Row


class Index:
    """``rows`` by run id; of several lines of one run the last one holds.

    A line that was cut off (the process was killed, the disk was full) is taken away; ``damaged``
    tells whether others could not be read.
    """

    def __init__(self, path: Path) -> None:
        self.rows: dict[str, Row] = {}
        self.damaged = False
        text = path.read_bytes() if path.exists() else b""
        *lines, rest = text.split(b"\n")
        for line in lines:
            row = _read(line)
            if row is None:
                self.damaged = True
            else:
                self.rows[row["run_id"]] = row
        if rest:
            os.truncate(path, len(text) - len(rest))
        # Unbuffered: a line is in the file, whole, or not at all, when add returns.
        self._file = open(path, "ab", buffering=0)  # noqa: SIM115

    def add(self, row: Row) -> None:
        """Remember a run. Raises ``OSError``; the line is then not there."""
        line = json.dumps(row, allow_nan=False).encode() + b"\n"
        end = self._file.seek(0, os.SEEK_END)
        try:
            if self._file.write(line) != len(line):
                raise OSError("the line was cut off")
        except OSError:
            os.truncate(self._file.fileno(), end)
            raise
        self.rows[row["run_id"]] = row

    def recover(self, present: set[str], read: Callable[[str], Row | None]) -> None:
        """Bring it in line with the folders that are ``present``: forget runs whose folder is gone
        and take in those that it has not heard of."""
        for run_id in [run_id for run_id, row in self.rows.items()
                       if run_id not in present and row["status"] == "finished"]:
            del self.rows[run_id]
        for run_id in sorted(present - self.rows.keys()):
            row = read(run_id)
            if row is not None:
                self.add(row)

    def close(self) -> None:
        """No more lines."""
        self._file.close()


def _read(line: bytes) -> Row | None:
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) and {"run_id", "status"} <= row.keys() else None
