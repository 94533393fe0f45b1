"""Columns of a page, read again as ``columns.js`` reads them."""

import base64
import zlib

import numpy as np

from desim.report.replay.columns import BITS


def unpacked(index, text):
    """The columns by name, each [rows, n]."""
    data = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8)
    return {name: _column(data[offset:], rows, count, planes)
            for name, (offset, rows, count, planes, _) in index.items()}


def _column(data, rows, count, planes):
    if planes == BITS:
        width = (count + 7) // 8
        bits = np.unpackbits(data[:rows * width].reshape(rows, width), axis=1, bitorder="little")
        return bits[:, :count].astype(bool)
    parts = data[:rows * count * planes].reshape(planes, rows, count).astype(np.uint64)
    zigzag = sum(parts[k] << np.uint64(8 * k) for k in range(planes))
    steps = (zigzag >> np.uint64(1)).astype(np.int64) ^ -(zigzag & np.uint64(1)).astype(np.int64)
    return np.cumsum(steps, axis=1)
