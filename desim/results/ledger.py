"""The ledger of a run as a table: recorded while the run lasts, read again, or made again."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import pyarrow as pa

from desim.engine.trace import Names, RowSink
from desim.errors import InputError
from desim.middleware.busy.timed_executor import PublishingCallback
from desim.middleware.fates import OnFate
from desim.middleware.message_ledger import PARTS, ROW, STAMP, MessageLedger
from desim.network.passages import KnownMedium, Passages
from desim.results.association_waits import association_waits
from desim.results.file_names import LEDGER, TRACE
from desim.results.frames_lost import frames_lost
from desim.results.message_log import DELIVERED, DROPPED
from desim.results.parquet import read_table
from desim.results.run import Run, readable
from desim.results.status import RunStatus
from desim.results.tables import full
from desim.results.traces import Rows, Spool, refuse_failed, repeatable, trace_of
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

_INT, _TEXT = pa.int64(), pa.dictionary(pa.int32(), pa.string())
SCHEMA = pa.schema([
    ("number", _INT), ("topic", _TEXT), ("source", _TEXT), ("destination", _TEXT),
    ("size_bytes", _INT), ("born_ns", _INT), ("fate", _TEXT), ("reason", _TEXT), ("place", _TEXT),
    ("end_ns", _INT), ("latency_ns", _INT), ("read_ns", _INT),
    ("node", _TEXT), ("called_ns", _INT), ("node_queue_ns", _INT), ("run_queue_ns", _INT),
    ("computing_ns", _INT), ("by_callback", pa.bool_()),
    ("frames_lost", _INT), ("frames_lost_for", _TEXT), ("frames_lost_from_ns", _INT),
    ("frames_lost_until_ns", _INT), ("frames_lost_at", _TEXT), ("frames_lost_behind_people", _INT),
    ("joining", _TEXT), ("joined", _TEXT), ("joining_from_ns", _INT), ("joined_ns", _INT),
    ("parts", pa.list_(_TEXT)), ("places", pa.list_(_TEXT)), ("times_ns", pa.list_(_INT))])

_FULL = full(SCHEMA, "reason", "place", "latency_ns", "read_ns", "node", "called_ns",
             "node_queue_ns", "run_queue_ns", "computing_ns", "by_callback", "frames_lost",
             "frames_lost_for", "frames_lost_from_ns", "frames_lost_until_ns", "frames_lost_at",
             "frames_lost_behind_people",
             "joining", "joined", "joining_from_ns", "joined_ns")


class LedgerRecorder:
    """Collects the ledger of a run in memory. Give ``messages`` to the ``Simulation``, which then
    notifies ``on_fate`` of fates, too, and ``sink`` as its trace's sink."""

    def __init__(self, on_fate: OnFate | None = None) -> None:
        self.messages = MessageLedger(Passages(), on_fate)
        self._reads: list[np.ndarray] = []
        self._kinds = [Names().id(kind) for kind in ("callback", "read")]

    def sink(self, rows: np.ndarray) -> None:
        """Keep the trace rows that say when messages were read."""
        self._reads.append(rows[np.isin(rows["kind"], self._kinds)].copy())

    def table(self, names: Names, hosts: Sequence[str]) -> pa.Table:
        """The table, of schema ``SCHEMA``; ``hosts`` in index order."""
        ledger = self.messages
        rows = np.frombuffer(b"".join(ledger.rows), ROW)
        stamps = np.frombuffer(b"".join(ledger.stamps), STAMP)
        topics, topic = np.unique(rows["topic"], return_inverse=True)
        lost = rows["fate"] != 0
        places = _Places(ledger.passages.media, hosts)
        offsets = pa.array(np.concatenate([[0], np.cumsum(ledger.counts)]).astype(np.int32))
        read_ns, by_callback = self._read(rows, names, hosts)
        return pa.table([
            pa.array(rows["number"]), _words(topic, [names[id_] for id_ in topics.tolist()]),
            _words(rows["source"], hosts), _words(rows["destination"], hosts),
            pa.array(rows["size_bytes"]), pa.array(rows["born_ns"]),
            _words(lost, (DELIVERED, DROPPED)),
            _words(rows["fate"], ledger.reasons, mask=~lost),
            places.words(rows["medium"], rows["host"], mask=~lost),
            pa.array(rows["end_ns"]), pa.array(rows["end_ns"] - rows["born_ns"], mask=lost),
            pa.array(read_ns, mask=read_ns < 0),
            *_births(rows["number"], ledger.callbacks),
            pa.array(by_callback, mask=read_ns < 0),
            *frames_lost(rows, ledger.passages.losses, places.word),
            *association_waits(rows, ledger.passages.media, stamps, ledger.counts),
            pa.ListArray.from_arrays(offsets, _words(stamps["part"], PARTS)),
            pa.ListArray.from_arrays(offsets, places.words(stamps["medium"], stamps["host"])),
            pa.ListArray.from_arrays(offsets, pa.array(stamps["time_ns"])),
        ], schema=SCHEMA)

    def _read(self, rows: np.ndarray, names: Names, hosts: Sequence[str]
              ) -> tuple[np.ndarray, np.ndarray]:
        """[rows] the time when each message was first read at its destination; -1: never. Whether
        a callback did so."""
        reads = np.concatenate([np.empty(0, self._reads[0].dtype), *self._reads]) \
            if self._reads else None
        if reads is None or not len(reads) or not len(rows):
            return np.full(len(rows), -1), np.zeros(len(rows), bool)
        ids = np.array([names.id(host) for host in hosts])
        order = np.argsort(ids)
        index = {column: order[np.searchsorted(ids[order], reads[column])]
                 for column in ("entity", "a")}
        keys = _key(index["entity"], index["a"], reads["b"], len(hosts))
        known, first = np.unique(keys, return_index=True)
        wanted = _key(rows["destination"], rows["source"], rows["seq"], len(hosts))
        at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
        return (np.where(known[at] == wanted, reads["t_ns"][first[at]], -1),
                reads["kind"][first[at]] == self._kinds[0])


def ledger_of(run: Run) -> pa.Table:
    """The ledger of a run, of schema ``SCHEMA``, a row for each message between hosts and receiver
    in the order of their fates: the kept one, or that of running its scenario again. Raises
    ``InputError`` where it was not kept and the run cannot be repeated."""
    if run.keeps(LEDGER):
        return _kept(run)
    refuse_failed(run)
    return _made_again(run, repeatable(run, "messages' parts of time", "trace.ledger=true"))[0]


def read_ledger(file: Path) -> pa.Table:
    """A ledger's file, of schema ``SCHEMA``. Columns that older ones have not are null."""
    kept = read_table(file)
    return pa.concat_tables([SCHEMA.empty_table(), kept], promote_options="permissive").cast(_FULL)


def trace_and_ledger(run: Run, spool: Path, until_ns: int | None,
                     ) -> tuple[Rows, pa.Table | None]:
    """The trace of a run (in the file ``spool``) and its ledger. Where it has not kept its trace,
    both come from running its scenario again until ``until_ns``; a run is not repeated for its
    ledger alone (None). Raises ``InputError`` as ``trace_of`` does."""
    if run.keeps(LEDGER):
        return trace_of(run, spool, until_ns), _kept(run)
    if run.keeps(TRACE):
        return trace_of(run, spool, until_ns), None
    if until_ns is None:
        refuse_failed(run)
    sink = Spool(spool)
    ledger, names = _made_again(run, repeatable(run, "trace rows", "trace.keep=all"), until_ns,
                                sink.add)
    return Rows(sink.rows(), names.items()), ledger


def _kept(run: Run) -> pa.Table:
    with readable(run.file(LEDGER)) as file:
        return read_ledger(file)


def _made_again(run: Run, scenario: Scenario, until_ns: int | None = None,
                sink: RowSink = lambda _: None) -> tuple[pa.Table, Names]:
    """The ledger of repeating a run (until ``until_ns``), and the names in its trace; ``sink`` gets
    the trace's rows."""
    recorder = LedgerRecorder()

    def rows(batch: np.ndarray) -> None:
        recorder.sink(batch)
        sink(batch)

    simulation = Simulation(scenario, trace_sink=rows, ledger=recorder.messages)
    whole_ns = round(run.manifest["simulated_s"] * NS_PER_S)
    end_ns = whole_ns if until_ns is None else min(until_ns, whole_ns)
    outcome = simulation.run(end_ns)
    if end_ns == whole_ns and run.manifest["status"] == RunStatus.FINISHED \
            and outcome.digest != run.manifest["digest"]:
        raise InputError(f"{run.path}: the run does not repeat itself: its digest is "
                         f"{run.manifest['digest']}, now {outcome.digest}; desim diff tells more")
    return recorder.table(simulation.names,
                          [host.name for host in simulation.graph.hosts]), simulation.names


def _key(to: np.ndarray, source: np.ndarray, seq: np.ndarray, hosts: int) -> np.ndarray:
    return ((to.astype(np.int64) * hosts + source) << 40) | seq


_NO_CALLBACK = PublishingCallback(0, 0, "", 0, 0, 0, 0)


def _births(numbers: np.ndarray, callbacks: Sequence[PublishingCallback]) -> list[pa.Array]:
    """The columns ``node`` to ``computing_ns`` of the messages with these ``numbers``."""
    callbacks = [_NO_CALLBACK, *callbacks]
    nodes = list(dict.fromkeys(callback.node for callback in callbacks))
    table = np.array([(first, last, nodes.index(node), *times_ns)
                      for first, last, node, *times_ns in callbacks], np.int64)
    own = table[np.searchsorted(table[:, 0], numbers, side="right") - 1]
    mask = numbers > own[:, 1]
    return [_words(own[:, 2], nodes, mask),
            *(pa.array(times_ns, mask=mask) for times_ns in own[:, 3:].T)]


class _Places:
    """Places in words: ``lan at robot_3``, or ``robot_3`` above all media."""

    def __init__(self, media: Sequence[KnownMedium], hosts: Sequence[str]) -> None:
        places = [hosts, *([f"{medium.name} at {place}" for place in medium.places]
                           for medium in media)]
        self._words = list(chain.from_iterable(places))
        self._first = np.cumsum([0, *map(len, places[:-1])])  # above all media, then of each

    def word(self, medium: int, host: int) -> str:
        """One place, by the numbers of medium (-1: above all) and host."""
        return self._words[self._first[medium + 1] + host]

    def words(self, medium: np.ndarray, host: np.ndarray, mask: np.ndarray | None = None
              ) -> pa.Array:
        """The places as a column."""
        return _words(self._first[medium + 1] + host, self._words, mask)


def _words(index: np.ndarray, words: Sequence[str], mask: np.ndarray | None = None) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(index.astype(np.int32), mask=mask),
                                          pa.array(list(map(str, words)), pa.string()))
