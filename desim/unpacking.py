"""Limits of what packed files of strangers unpack to: a small file may hold much more than memory.

A file may unpack to some megabytes, or to a multiple of its own size, far above what real logs and
recordings do. One that is not packed has no such limit: a user who trusts a file unpacks it first.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from desim.errors import InputError
from desim.files import opened

# Logs of lasers pack to a quarter or a tenth of their size, recordings with maps to a thirtieth.
_TEXT, _RECORDING = (20, 10_000_000), (50, 100_000_000)  # times the file's size, and bytes
_LONGEST_LINE_BYTES = 2_000_000
_LARGEST_PART_BYTES = 64_000_000  # a part of a recording, which is in memory as a whole
_GZIP = b"\x1f\x8b"


class Decompressor(Protocol):
    """A decompressor of bz2, lz4 or zstd: they have this in common."""

    @property
    def eof(self) -> bool: ...

    @property
    def unused_data(self) -> bytes | None: ...

    def decompress(self, data: bytes, max_length: int = ...) -> bytes: ...


class Unpacking:
    """The bytes that the packed file ``path`` has unpacked to so far; more than ``limit`` are
    refused: times its ``packed_bytes``, and bytes."""

    def __init__(self, path: str | Path, packed_bytes: int, limit: tuple[int, int] = _RECORDING
                 ) -> None:
        self._path = path
        self._most_bytes = limit[0] * packed_bytes + limit[1]
        self._bytes = 0

    def add(self, unpacked_bytes: int) -> None:
        """Count a part. Raises ``InputError``."""
        self._bytes += unpacked_bytes
        if self._bytes > self._most_bytes:
            raise InputError(f"{self._path}: it unpacks to more than {self._most_bytes / 1e6:.0f} "
                             "MB, far more than its size; if that is right, unpack it first")

    def whole(self, data: bytes, make: Callable[[], Decompressor]) -> bytes:
        """A packed part, unpacked. Raises ``InputError``, ``EOFError``, and what ``make``'s kind
        raises for damage."""
        parts: list[bytes] = []
        while data:
            one = make()
            part = one.decompress(data, max_length=_LARGEST_PART_BYTES + 1)
            if len(part) > _LARGEST_PART_BYTES:
                raise InputError(f"{self._path}: a part of it unpacks to more than "
                                 f"{_LARGEST_PART_BYTES / 1e6:.0f} MB; if that is right, unpack it "
                                 "first")
            self.add(len(part))
            if not one.eof:
                raise EOFError("packed data ends early")
            parts.append(part)
            data = one.unused_data or b""
        return b"".join(parts)


def lines(path: str | Path) -> Iterator[tuple[int, bytes]]:
    """The lines of a text file, numbered from 1, unpacked if it is packed with gzip. Raises
    ``InputError`` for what is too large, ``OSError``, and for damage ``EOFError``,
    ``zlib.error``."""
    with opened(path) as file:
        packed = file.peek(2)[:2] == _GZIP
        size = Unpacking(path, file.seek(0, 2), _TEXT)
        file.seek(0)
        text = gzip.GzipFile(fileobj=file) if packed else file
        number = 0
        while line := text.readline(_LONGEST_LINE_BYTES + 1):
            number += 1
            if len(line) > _LONGEST_LINE_BYTES:
                raise InputError(f"{path}:{number}: a line of more than "
                                 f"{_LONGEST_LINE_BYTES / 1e6:.0f} MB")
            if packed:
                size.add(len(line))
            yield number, line
