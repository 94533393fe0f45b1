"""A run's log: typed rows of fixed size, and their digest.

Only what is a row counts as having happened. A row's hash covers all of its fields, its time
among them, and a digest is the sum of such hashes: so it does not depend on the order in which rows
are written, and parts of a run may write theirs late, many at once. Rows are always hashed, in
batches; they are kept only where somebody wants to read them. Names (of hosts, kinds, topics,
reasons) appear in rows as 32-bit ids derived from the name alone, so that one more robot changes
nobody else's rows.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Iterable

import numpy as np

from desim.engine import kernels
from desim.errors import InputError

ROW = np.dtype([("t_ns", "<i8"), ("kind", "<u4"), ("entity", "<u4"),
                ("a", "<i8"), ("b", "<i8"), ("c", "<i8")])
RowSink = Callable[[np.ndarray], object]  # takes rows in batches, arrays of ``ROW``
pack = struct.Struct("<qIIqqq").pack  # one ROW
_pack_head, pack_id, _pack_tail = (struct.Struct(part).pack for part in ("<qI", "<I", "<qqq"))
_BATCH = 1 << 12
_HALF = 64  # bits of each half of a digest; the halves are summed apart


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


def pack_each(t_ns: int, kind: int, entities: Iterable[bytes], a: int = 0, b: int = 0, c: int = 0
              ) -> bytes:
    """A row of each of ``entities`` (``pack_id`` of their ids), equal in all else."""
    head, tail = _pack_head(t_ns, kind), _pack_tail(a, b, c)
    return head + (tail + head).join(entities) + tail


class Trace:
    """Append-only rows, with the digest of each kind of each entity.

    ``sink`` receives every full batch as an array of ``ROW``; None keeps nothing.

    ``put(pack(t_ns, kind, entity, a, b, c))`` is ``row`` without ``flush_if_full``, which is called
    once after several rows; it takes the bytes of several rows, too. So does ``put_late``, for rows
    of phases before CONTROL, perhaps after their instant: the sink gets them before the instant's
    other rows.
    """

    def __init__(self, names: Names, sink: RowSink | None = None) -> None:
        self.names = names
        self._sink = sink
        self._buffer: list[bytes] = []
        self._late: list[bytes] = []
        self.put = self._buffer.append
        self.put_late = self._late.append
        self.before_flush: Callable[[], object] = _nothing  # writes rows that are late
        self._keys, self._sums = _table(1 << 8)

    def row(self, t_ns: int, kind: int, entity: int, a: int = 0, b: int = 0, c: int = 0) -> None:
        """Note that at ``t_ns`` a thing of ``kind`` happened to ``entity`` (both name ids).

        Raises ``struct.error`` for what is no int or does not fit; a float goes through ``bits``.
        """
        self.put(pack(t_ns, kind, entity, a, b, c))
        self.flush_if_full()

    def put_rows(self, rows: np.ndarray) -> None:
        """``put_late`` for rows of dtype ``ROW``."""
        self.put_late(rows.tobytes())

    def flush_if_full(self) -> None:
        """Flush if a batch is full."""
        if len(self._buffer) >= _BATCH:
            self.flush()

    def flush(self) -> None:
        """Hash the rows that have gathered, and hand them to the sink, sorted by time."""
        self.before_flush()
        if not self._buffer and not self._late:
            return
        words = np.frombuffer(bytearray().join(self._late + self._buffer), np.uint64).reshape(-1, 5)
        self._buffer.clear()
        self._late.clear()
        self._hash(words)
        if self._sink is not None:
            times = words[:, 0].view(np.int64)
            if (times[1:] < times[:-1]).any():
                words = words.take(np.argsort(times, kind="stable"), axis=0)
            self._sink(words.view(ROW).reshape(-1))

    def _hash(self, words: np.ndarray) -> None:
        """Add the hashes of rows to the sums. At most half of the table's places are taken."""
        while len(words):
            keys, sums = self._keys, self._sums
            free = len(keys) // 2 - int(np.count_nonzero(sums[:, 0]))
            words = words[kernels.add(words, keys, sums, free):]
            if len(words):
                self._keys, self._sums = _table(2 * len(keys))
                kernels.copy(keys, sums, self._keys, self._sums)

    def digests(self) -> dict[tuple[int, int], str]:
        """Ids of kind and entity to the digest of these rows: 32 hex digits. ``together`` makes one
        of several."""
        self.flush()
        taken = self._sums[:, 0] > 0
        return {(key & 0xFFFFFFFF, key >> 32): f"{first:016x}{second:016x}"
                for key, (_, first, second) in zip(self._keys[taken].tolist(),
                                                   self._sums[taken].tolist(), strict=True)}

    def digest(self) -> str:
        """The digest of all rows."""
        return together(self.digests().values())

    def digest_by_entity(self) -> dict[str, str]:
        """Entity name to the digest of its own rows, sorted by name."""
        return self._grouped(lambda kind, entity: self.names[entity])

    def digest_by_kind(self) -> dict[str, str]:
        """Kind to the digest of its rows, sorted by name."""
        return self._grouped(lambda kind, entity: self.names[kind])

    def _grouped(self, group: Callable[[int, int], str]) -> dict[str, str]:
        digests: dict[str, list[str]] = {}
        for key, digest in self.digests().items():
            digests.setdefault(group(*key), []).append(digest)
        return {name: together(digests[name]) for name in sorted(digests)}


def _nothing() -> None:
    pass


def together(digests: Iterable[str]) -> str:
    """The digest of all rows of which ``digests`` are: their sum."""
    first = second = 0
    for digest in digests:
        first += int(digest[:16], 16)
        second += int(digest[16:], 16)
    return f"{first % (1 << _HALF):016x}{second % (1 << _HALF):016x}"


def _table(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Keys and sums of an empty hash table (``kernels.add``)."""
    return np.zeros(size, np.uint64), np.zeros((size, 3), np.uint64)
