"""The decompressors of recordings, with limits: the libraries' own have none."""

from __future__ import annotations

import bz2
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any

import lz4.frame
from rosbags.rosbag1 import reader as bags
from rosbags.rosbag2 import reader as folders
from rosbags.rosbag2 import storage_mcap as mcaps

from desim.unpacking import Decompressor, Unpacking

_ZSTD: Any = folders.zstd  # Python's own from 3.14 on
DECOMPRESSORS: dict[str, Callable[[], Decompressor]] = {
    "bz2": bz2.BZ2Decompressor, "lz4": lz4.frame.LZ4FrameDecompressor,
    "zstd": _ZSTD.ZstdDecompressor}


@contextmanager
def limited(unpacking: Unpacking) -> Iterator[None]:
    """While this goes on, rosbags unpacks no more than ``unpacking`` allows."""

    class ZstdFile(_ZSTD.ZstdFile):
        def read(self, size: int = -1) -> bytes:
            part: bytes = super().read(size)
            unpacking.add(len(part))
            return part

    def whole(kind: str, data: bytes, _: int = 0) -> bytes:
        return unpacking.whole(data, DECOMPRESSORS[kind])

    parts = {kind: partial(whole, kind) for kind in DECOMPRESSORS}
    before = dict(bags.decompressors), dict(mcaps.DECOMPRESSORS)
    bags.decompressors.update(bz2=parts["bz2"], lz4=parts["lz4"])
    mcaps.DECOMPRESSORS.update(lz4=parts["lz4"], zstd=parts["zstd"])
    folders.zstd = SimpleNamespace(open=ZstdFile, decompress=parts["zstd"])
    try:
        yield
    finally:
        bags.decompressors.update(before[0])
        mcaps.DECOMPRESSORS.update(before[1])
        folders.zstd = _ZSTD
