"""The ledger of a run while it runs, as a table at its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from desim.engine.trace import Names
from desim.middleware.graph import OnFate
from desim.middleware.ledger import PARTS, ROW, STAMP, MessageLedger
from desim.network.passages import Passages

LEDGER = "ledger.parquet"
_INT, _TEXT = pa.int64(), pa.dictionary(pa.int32(), pa.string())
SCHEMA = pa.schema([
    ("number", _INT), ("topic", _TEXT), ("source", _TEXT), ("destination", _TEXT),
    ("size_bytes", _INT), ("born_ns", _INT), ("fate", _TEXT), ("reason", _TEXT), ("place", _TEXT),
    ("end_ns", _INT), ("latency_ns", _INT), ("read_ns", _INT),
    ("parts", pa.list_(_TEXT)), ("places", pa.list_(_TEXT)), ("times_ns", pa.list_(_INT))])


class LedgerRecorder:
    """Keeps the ledger of a run in memory. Give ``messages`` to the ``Simulation``, and ``sink`` as
    its trace's; what they get goes on to ``on_fate`` and ``further``."""

    def __init__(self, on_fate: OnFate | None = None) -> None:
        self.messages = MessageLedger(Passages(), on_fate)
        self._reads: list[np.ndarray] = []
        self._kinds = [Names().id(kind) for kind in ("callback", "read")]

    def sink(self, rows: np.ndarray) -> None:
        """Take trace rows: when messages were read."""
        self._reads.append(rows[np.isin(rows["kind"], self._kinds)].copy())

    def table(self, names: Names, hosts: Sequence[str]) -> pa.Table:
        """All of it, of schema ``SCHEMA``; ``hosts`` in index order."""
        ledger = self.messages
        rows = np.frombuffer(b"".join(ledger.rows), ROW)
        stamps = np.frombuffer(b"".join(ledger.stamps), STAMP)
        topics, topic = np.unique(rows["topic"], return_inverse=True)
        lost = rows["fate"] != 0
        places = _Places(ledger.passages.media, hosts)
        offsets = pa.array(np.concatenate([[0], np.cumsum(ledger.counts)]).astype(np.int32))
        read_ns = self._read_ns(rows, names, hosts)
        return pa.table([
            pa.array(rows["number"]), _words(topic, [names[id_] for id_ in topics.tolist()]),
            _words(rows["source"], hosts), _words(rows["destination"], hosts),
            pa.array(rows["size_bytes"]), pa.array(rows["born_ns"]),
            _words(lost, ("delivered", "dropped")),
            _words(rows["fate"], ledger.reasons, mask=~lost),
            places.words(rows["medium"], rows["host"], mask=~lost),
            pa.array(rows["end_ns"]), pa.array(rows["end_ns"] - rows["born_ns"], mask=lost),
            pa.array(read_ns, mask=read_ns < 0),
            pa.ListArray.from_arrays(offsets, _words(stamps["part"], PARTS)),
            pa.ListArray.from_arrays(offsets, places.words(stamps["medium"], stamps["host"])),
            pa.ListArray.from_arrays(offsets, pa.array(stamps["time_ns"])),
        ], schema=SCHEMA)

    def _read_ns(self, rows: np.ndarray, names: Names, hosts: Sequence[str]) -> np.ndarray:
        """[rows] the time when each message was first read at its destination; -1: never."""
        reads = np.concatenate([np.empty(0, self._reads[0].dtype), *self._reads]) \
            if self._reads else None
        if reads is None or not len(reads) or not len(rows):
            return np.full(len(rows), -1)
        ids = np.array([names.id(host) for host in hosts])
        order = np.argsort(ids)
        index = {column: order[np.searchsorted(ids[order], reads[column])]
                 for column in ("entity", "a")}
        keys = _key(index["entity"], index["a"], reads["b"], len(hosts))
        known, first = np.unique(keys, return_index=True)
        wanted = _key(rows["destination"], rows["source"], rows["seq"], len(hosts))
        at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        return np.where(known[at] == wanted, reads["t_ns"][first[at]], -1)


def _key(to: np.ndarray, source: np.ndarray, seq: np.ndarray, hosts: int) -> np.ndarray:
    return ((to.astype(np.int64) * hosts + source) << 40) | seq


class _Places:
    """Places in words: ``lan at robot_3``, or ``robot_3`` above all media."""

    def __init__(self, media: Sequence[str], hosts: Sequence[str]) -> None:
        self._hosts = len(hosts)
        self._words = [*hosts, *(f"{medium} at {host}" for medium in media for host in hosts)]

    def words(self, medium: np.ndarray, host: np.ndarray, mask: np.ndarray | None = None
              ) -> pa.Array:
        return _words((medium + 1) * self._hosts + host, self._words, mask)


def _words(index: np.ndarray, words: Sequence[str], mask: np.ndarray | None = None) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(index.astype(np.int32), mask=mask),
                                          pa.array(list(map(str, words)), pa.string()))
