"""Parquet files of rows: written batch by batch, with names in place of their ids, and read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from desim.engine.trace import Names
from desim.files import opened_below
from desim.results.message_log import DELIVERED, DROPPED
from desim.results.trace_words import values

_TEXT = pa.dictionary(pa.int32(), pa.string())
_INT = pa.int64()
_MOST_UNPACKED_BYTES, _MOST_TIMES, _MOST_TEXT_BYTES = 400_000_000, 400, 1_000_000

MESSAGE_SCHEMA = pa.schema([
    ("number", _INT), ("topic", _TEXT), ("source", _TEXT), ("destination", _TEXT),
    ("size_bytes", _INT), ("born_ns", _INT), ("first_ns", _INT), ("last_ns", _INT),
    ("fate", _TEXT), ("reason", _TEXT), ("end_ns", _INT), ("latency_ns", _INT)])
TRACE_SCHEMA = pa.schema([("t_ns", _INT), ("kind", _TEXT), ("entity", _TEXT),
                   ("a", _INT), ("b", _INT), ("c", _INT)])
EVENT_SCHEMA = TRACE_SCHEMA.append(pa.field("words", pa.string()))


@contextmanager
def opened(path: Path) -> Iterator[pq.ParquetFile]:
    """A Parquet file that somebody else may have made, to be read batch by batch. Raises
    ``OSError`` and ``pa.ArrowException``."""
    with opened_below(path.parent, path.name) as file, pq.ParquetFile(file) as table:
        yield table


def read_table(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """All of a Parquet file (of these ``columns``) that somebody else may have made. Raises
    ``OSError``, ``ValueError``, ``KeyError`` for a column that is not there, and
    ``pa.ArrowException``."""
    most_bytes = max(_MOST_UNPACKED_BYTES, _MOST_TIMES * path.stat().st_size)
    with opened_below(path.parent, path.name) as file:
        found = pq.ParquetFile(file)
        _refuse_bomb(_unpacked_bytes(found.metadata), most_bytes)
        # A text of many rows is in memory once, until it is known how long it is.
        table = pq.ParquetFile(file, metadata=found.metadata, read_dictionary=_texts(found.schema)
                               ).read(None if columns is None else list(columns))
    _refuse_bomb(sum(map(_text_bytes, table.columns)), most_bytes)
    fields = {field.name: field for field in found.schema_arrow}
    table = table.cast(pa.schema([fields[name] for name in table.column_names],
                                 table.schema.metadata))
    return table if columns is None else table.select(columns)


def _texts(schema: pq.ParquetSchema) -> list[str]:
    """The paths of the columns of texts."""
    columns = [schema.column(number) for number in range(len(schema))]
    return [column.path for column in columns if column.physical_type == "BYTE_ARRAY"]


def _unpacked_bytes(facts: pq.FileMetaData) -> int:
    """The memory that a file takes at least."""
    chunks = [facts.row_group(group).column(column) for group in range(facts.num_row_groups)
              for column in range(facts.num_columns)]
    return sum(max(8 * chunk.num_values, chunk.total_uncompressed_size) for chunk in chunks)


def _text_bytes(column: pa.ChunkedArray) -> int:
    """The bytes of a column's texts, once for each row. Raises ``ValueError`` for one that is
    longer than any of desim's."""
    found = 0
    for chunk in column.chunks:
        while pa.types.is_list(chunk.type):
            chunk = chunk.flatten()
        if isinstance(chunk, pa.DictionaryArray) and len(chunk):
            lengths = pc.binary_length(chunk.dictionary)
            if (longest := pc.max(lengths).as_py() or 0) > _MOST_TEXT_BYTES:
                raise ValueError(f"a text of {longest / 1e6:.0f} MB is none of desim's")
            found += pc.sum(lengths.take(chunk.indices)).as_py() or 0
    return found


def _refuse_bomb(memory_bytes: int, most_bytes: int) -> None:
    """Refuse a file that would take far more memory than any table of desim's, which are at most
    some 200 times as large in memory (``growth`` of 300 robots that stand)."""
    if memory_bytes > most_bytes:
        raise ValueError(f"it would take {memory_bytes / 1e6:.0f} MB of memory, as no table of "
                         "desim's does")


def write(path: Path, columns: Mapping[str, object]) -> None:
    """A whole table at once."""
    pq.write_table(pa.table(columns), path, compression="zstd")


def write_integers(path: Path, table: pa.Table) -> None:
    """A whole table of integers and text at once."""
    with pq.ParquetWriter(path, table.schema, **_encoded(table.schema)) as writer:
        writer.write_table(table)


def _encoded(schema: pa.Schema) -> dict[str, object]:
    """The options for a file: integers as differences, at half the size and in a quarter of the
    time of Parquet's defaults."""
    text = [field.name for field in schema if field.type == _TEXT]
    return {"compression": "zstd", "write_statistics": False, "use_dictionary": text,
            "column_encoding": {field.name: "DELTA_BINARY_PACKED" for field in schema
                                if pa.types.is_integer(field.type)}}


class _Table:
    """A Parquet file that grows by a row group a batch; ``names`` has the words of ids."""

    def __init__(self, path: Path, schema: pa.Schema, names: Names) -> None:
        self._writer = pq.ParquetWriter(path, schema, **_encoded(schema))
        self._names = names

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()


class TraceTable(_Table):
    """Trace rows with the names of kinds and entities; ``add`` is a trace's sink."""

    def __init__(self, path: Path, names: Names) -> None:
        super().__init__(path, TRACE_SCHEMA, names)

    def add(self, rows: np.ndarray) -> None:
        self._writer.write_batch(trace_batch(rows, self._names))


class EventTable(_Table):
    """Rare rows of a trace, with their values in words, too."""

    def __init__(self, path: Path, names: Names) -> None:
        super().__init__(path, EVENT_SCHEMA, names)

    def add(self, rows: np.ndarray) -> None:
        columns = trace_batch(rows, self._names).columns
        known = self._names.items()
        said = [values(row, known.get(int(row["kind"]), ""), known) for row in rows]
        self._writer.write_batch(pa.record_batch([*columns, pa.array(said, pa.string())],
                                                 schema=EVENT_SCHEMA))


class MessageTable(_Table):
    """One row a message and receiving host; ``add`` is a message log's sink."""

    def __init__(self, path: Path, names: Names, hosts: tuple[str, ...]) -> None:
        super().__init__(path, MESSAGE_SCHEMA, names)
        self._hosts = hosts

    def add(self, rows: np.ndarray, reasons: list[str]) -> None:
        self._writer.write_batch(message_batch(rows, reasons, self._names, self._hosts))


def trace_batch(rows: np.ndarray, names: Names) -> pa.RecordBatch:
    """Rows of a trace as ``trace.parquet`` has them."""
    return pa.record_batch([
        pa.array(rows["t_ns"]), _named(rows["kind"], names), _named(rows["entity"], names),
        *(pa.array(rows[column]) for column in "abc")], schema=TRACE_SCHEMA)


def message_batch(rows: np.ndarray, reasons: list[str], names: Names, hosts: tuple[str, ...],
                  ) -> pa.RecordBatch:
    """Rows of a message log as ``messages.parquet`` has them."""
    number, topic, source, to, size, born, first, last, reason, end = rows.T
    lost, never = reason != 0, first < 0
    return pa.record_batch([
        pa.array(number), _named(topic, names), _of(source, hosts), _of(to, hosts),
        pa.array(size), pa.array(born), pa.array(first, mask=never),
        pa.array(last, mask=never), _of(lost, (DELIVERED, DROPPED)),
        _of(reason, reasons, mask=~lost), pa.array(end), pa.array(end - born, mask=lost)],
        schema=MESSAGE_SCHEMA)


def _named(ids: np.ndarray, names: Names) -> pa.Array:
    known, index = np.unique(ids, return_inverse=True)
    return _of(index, [names[id_] for id_ in known.tolist()])


def _of(index: np.ndarray, words: Sequence[str], mask: np.ndarray | None = None) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(index.astype(np.int32), mask=mask),
                                          pa.array(words, pa.string()))
