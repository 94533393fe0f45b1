"""Columns of ``messages.parquet`` as numbers, and their sums by group."""

from __future__ import annotations

import numpy as np
import pyarrow as pa


def words_of(column: pa.ChunkedArray) -> tuple[list[str], np.ndarray]:
    """The different words of a column, and int64 [n] which of them each value is; -1: none."""
    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    column = column.unify_dictionaries().combine_chunks()
    if isinstance(column, pa.ChunkedArray):  # of an empty table
        return [], np.empty(0, np.int64)
    indices = column.indices.fill_null(-1).to_numpy(zero_copy_only=False)
    return column.dictionary.to_pylist(), indices.astype(np.int64)


class Groups:
    """The rows of a table by their values in ``columns``, integers from 0 on, [n] each; the groups
    are in the order of these values. ``group`` [n] is the number of each row's group, ``columns``
    has the values of each group, [groups] each."""

    def __init__(self, *columns: np.ndarray) -> None:
        sizes = [1 + int(column.max(initial=0)) for column in columns]
        key = columns[0].astype(np.int64)
        for column, size in zip(columns[1:], sizes[1:], strict=True):
            key = key * size + column
        keys, self.group = np.unique(key, return_inverse=True)
        self._count = len(keys)
        parts = []
        for size in reversed(sizes[1:]):
            keys, part = np.divmod(keys, size)
            parts.append(part)
        self.columns = [keys, *reversed(parts)]

    def __len__(self) -> int:
        return self._count

    def sums(self, values: np.ndarray) -> np.ndarray:
        """[groups] float64 sums of ``values`` [n]; exact below 2**53."""
        return np.bincount(self.group, values, self._count)
