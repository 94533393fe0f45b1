"""Columns of integers in little space, as text; ``assets/data/columns.js`` reads them."""

from __future__ import annotations

import base64
import zlib

import numpy as np

_LEVEL = 7  # maze_30: 9 takes six times as long (2.2 s) for 8 % less
BITS = 0  # as the number of planes: a column of booleans, eight in a byte


class Columns:
    """Named columns of integers or booleans, in one block of bytes.

    A row of integers is kept as differences from one value to the next, in zigzag (0, -1, 1, -2 as
    0, 1, 2, 3), and the lowest bytes of all values come first, then the second lowest: neighbours
    are alike then, and deflate finds it. ``index`` has for each name: offset, rows, values in a
    row, bytes of a value (0: bits), and whether 32 bits hold the values."""

    def __init__(self) -> None:
        self.index: dict[str, tuple[int, int, int, int, bool]] = {}
        self._parts: list[bytes] = []
        self._length = 0

    def add(self, name: str, values: np.ndarray) -> None:
        """Take ``values``, integers [n] or [rows, n], below 2**52 in size."""
        rows = np.atleast_2d(np.asarray(values, np.int64))
        steps = np.diff(rows, axis=1, prepend=0)
        zigzag = ((steps << 1) ^ (steps >> 63)).astype("<u8")
        largest = int(zigzag.max(initial=0))
        planes = max(1, (largest.bit_length() + 7) // 8)
        data = zigzag.reshape(-1, 1).view(np.uint8)[:, :planes]
        narrow = bool(np.abs(rows).max(initial=0) < 1 << 31 and planes <= 4)
        self._append(name, rows.shape, planes, narrow, np.ascontiguousarray(data.T).tobytes())

    def add_bits(self, name: str, values: np.ndarray) -> None:
        """Take ``values``, booleans [n] or [rows, n]; each row begins at a byte."""
        rows = np.atleast_2d(np.asarray(values, bool))
        self._append(name, rows.shape, BITS, True,
                     np.packbits(rows, axis=1, bitorder="little").tobytes())

    def text(self, level: int = _LEVEL) -> str:
        """All columns, deflated (zlib, 1: fast to 9: small), in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts), level)).decode()

    def _append(self, name: str, shape: tuple[int, ...], planes: int, narrow: bool,
                data: bytes) -> None:
        self.index[name] = self._length, shape[0], shape[1], planes, narrow
        self._parts.append(data)
        self._length += len(data)
