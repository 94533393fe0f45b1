"""A run's log: typed rows of fixed size, and their digest.

Anything that is not in the digest did not happen. Rows are always hashed, in batches; they are kept
only where somebody wants to read them. Names (of hosts, kinds, topics, reasons) appear in rows as
32-bit ids derived from the name alone, so that one more robot changes nobody else's rows.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from desim.errors import InputError

ROW = np.dtype([("t_ns", "<i8"), ("kind", "<u4"), ("entity", "<u4"),
                ("a", "<i8"), ("b", "<i8"), ("c", "<i8")])
pack = struct.Struct("<qIIqqq").pack  # one ROW
_BATCH = 1 << 12
_DIGITS = 32


class Names:
    """Names and their ids: 32 bits of blake2b of the name, the same in every run."""

    def __init__(self) -> None:
        self._id: dict[str, int] = {}
        self._name: dict[int, str] = {}

    def id(self, name: str) -> int:
        """The id of ``name``. Raises ``InputError`` in the rare case that two names share one."""
        known = self._id.get(name)
        if known is None:
            known = int.from_bytes(hashlib.blake2b(name.encode(), digest_size=4).digest(), "little")
            other = self._name.setdefault(known, name)
            if other != name:
                raise InputError(f"the names {other!r} and {name!r} have the same 32-bit id; "
                                 "rename one of them")
            self._id[name] = known
        return known

    def __getitem__(self, id_: int) -> str:
        return self._name[id_]

    def items(self) -> dict[int, str]:
        """All ids met so far and their names."""
        return dict(self._name)


def bits(value: float) -> int:
    """A float as the int64 of its bit pattern, to be put into a row without loss."""
    return int(struct.unpack("<q", struct.pack("<d", value))[0])


def real(value: int) -> float:
    """The inverse of ``bits``."""
    return float(struct.unpack("<d", struct.pack("<q", value))[0])


class Trace:
    """Append-only rows with two digests: of the whole log, and of each entity's own rows.

    ``sink`` receives every full batch as an array of ``ROW``; None keeps nothing.

    ``put(pack(t_ns, kind, entity, a, b, c))`` is ``row`` without ``flush_if_full``, which is called
    once after several rows.
    """

    def __init__(self, names: Names, sink: Callable[[np.ndarray], None] | None = None) -> None:
        self.names = names
        self.rows_written = 0
        self._sink = sink
        self._buffer: list[bytes] = []
        self.put = self._buffer.append
        self._whole = hashlib.sha256()
        self._by_entity: dict[int, hashlib._Hash] = {}

    def row(self, t_ns: int, kind: int, entity: int, a: int = 0, b: int = 0, c: int = 0) -> None:
        """Note that at ``t_ns`` a thing of ``kind`` happened to ``entity`` (both name ids).

        Raises ``struct.error`` for what is no int or does not fit; a float goes through ``bits``.
        """
        self.put(pack(t_ns, kind, entity, a, b, c))
        self.flush_if_full()

    def flush_if_full(self) -> None:
        """Flush if a batch is full."""
        if len(self._buffer) >= _BATCH:
            self.flush()

    def flush(self) -> None:
        """Hash the rows that have gathered, and hand them to the sink."""
        if not self._buffer:
            return
        packed = b"".join(self._buffer)
        self._buffer.clear()
        self._whole.update(packed)
        rows = np.frombuffer(packed, dtype=ROW)
        self.rows_written += len(rows)
        entities = rows["entity"]
        order = np.argsort(entities, kind="stable")
        own = rows.view(np.int64).reshape(-1, 5).take(order, axis=0)  # plain ints move faster
        entities = entities[order]
        starts = [0, *(np.flatnonzero(entities[1:] != entities[:-1]) + 1).tolist(), len(rows)]
        for start, end in pairwise(starts):
            entity = int(entities[start])
            hasher = self._by_entity.get(entity)
            if hasher is None:
                hasher = self._by_entity[entity] = hashlib.sha256()
            hasher.update(own[start:end].data)
        if self._sink is not None:
            self._sink(rows)

    def digest(self) -> str:
        """32 hex digits over all rows in order: half of their SHA-256, for which processors have
        instructions."""
        self.flush()
        return self._whole.hexdigest()[:_DIGITS]

    def digest_by_entity(self) -> dict[str, str]:
        """Entity name to the digest of its own rows, sorted by name."""
        self.flush()
        return dict(sorted((self.names[entity], hasher.hexdigest()[:_DIGITS])
                           for entity, hasher in self._by_entity.items()))
