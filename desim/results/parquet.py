"""Parquet files of rows, written batch by batch, with names in place of their ids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from desim.engine.trace import Names

_TEXT = pa.dictionary(pa.int32(), pa.string())
_INT = pa.int64()

MESSAGES = pa.schema([
    ("number", _INT), ("topic", _TEXT), ("source", _TEXT), ("destination", _TEXT),
    ("size_bytes", _INT), ("born_ns", _INT), ("first_ns", _INT), ("last_ns", _INT),
    ("fate", _TEXT), ("reason", _TEXT), ("end_ns", _INT), ("latency_ns", _INT)])
TRACE = pa.schema([("t_ns", _INT), ("kind", _TEXT), ("entity", _TEXT),
                   ("a", _INT), ("b", _INT), ("c", _INT)])


def write(path: Path, columns: Mapping[str, object]) -> None:
    """A whole table at once."""
    pq.write_table(pa.table(columns), path, compression="zstd")


class _Table:
    """A Parquet file that grows by a row group a batch; ``names`` has the words of ids."""

    def __init__(self, path: Path, schema: pa.Schema, names: Names) -> None:
        text = [field.name for field in schema if field.type == _TEXT]
        # Integers as differences: half the size in a quarter of the time of Parquet's defaults.
        self._writer = pq.ParquetWriter(
            path, schema, compression="zstd", write_statistics=False, use_dictionary=text,
            column_encoding={name: "DELTA_BINARY_PACKED" for name in schema.names
                             if name not in text})
        self._schema, self._names = schema, names

    def _append(self, columns: list[pa.Array]) -> None:
        self._writer.write_batch(pa.record_batch(columns, schema=self._schema))

    def _named(self, ids: np.ndarray) -> pa.Array:
        known, index = np.unique(ids, return_inverse=True)
        return _of(index, [self._names[id_] for id_ in known.tolist()])

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()


class TraceTable(_Table):
    """Trace rows with the names of kinds and entities; ``add`` is a trace's sink."""

    def __init__(self, path: Path, names: Names) -> None:
        super().__init__(path, TRACE, names)

    def add(self, rows: np.ndarray) -> None:
        self._append([pa.array(rows["t_ns"]), self._named(rows["kind"]),
                      self._named(rows["entity"]), *(pa.array(rows[column]) for column in "abc")])


class MessageTable(_Table):
    """One row a message and receiving host; ``add`` is a message log's sink."""

    def __init__(self, path: Path, names: Names, hosts: tuple[str, ...]) -> None:
        super().__init__(path, MESSAGES, names)
        self._hosts = hosts

    def add(self, rows: np.ndarray, reasons: list[str]) -> None:
        number, topic, source, to, size, born, first, last, reason, end = rows.T
        lost, never = reason != 0, first < 0
        self._append([
            pa.array(number), self._named(topic), _of(source, self._hosts), _of(to, self._hosts),
            pa.array(size), pa.array(born), pa.array(first, mask=never),
            pa.array(last, mask=never), _of(lost, ("delivered", "dropped")),
            _of(reason, reasons, mask=~lost), pa.array(end), pa.array(end - born, mask=lost)])


def _of(index: np.ndarray, words: Sequence[str], mask: np.ndarray | None = None) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(index.astype(np.int32), mask=mask),
                                          pa.array(words, pa.string()))
