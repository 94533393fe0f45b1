"""The folder that a run leaves. Until it is complete it is called ``<run id>.partial``."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from itertools import chain, count
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from desim.advice.warnings import warnings
from desim.engine.trace import Names, RowSink
from desim.errors import InputError
from desim.files import refuse_link
from desim.monitor.coverage import states
from desim.monitor.monitor import Monitor
from desim.monitor.recorder import Recorder
from desim.monitor.summary import robots_table, samples_table, summarize
from desim.monitor.traffic import latency_table
from desim.operating_system.folders import synced
from desim.operating_system.locks import Lock, Taken
from desim.results import identity, maps, parquet
from desim.results.file_names import (
    EVENTS,
    LEDGER,
    LEDGER_TOPICS,
    LINKS,
    LOCK,
    MANIFEST,
    MAPS,
    MESSAGES,
    NAMES,
    ROBOTS,
    SAMPLES,
    SCENARIO,
    SUMMARY,
    TRACE,
    written_by,
)
from desim.results.latency_by_topic import as_json, by_topic
from desim.results.ledger import LedgerRecorder
from desim.results.message_log import MessageLog
from desim.results.recording_tables import recorded
from desim.results.seal import Json, damage, manifest_of, seal
from desim.results.status import RunStatus
from desim.scenario.resolved import resolved
from desim.scenario.schema.scenario import Scenario

_FULL = (errno.ENOSPC, errno.EDQUOT)


class RunFolder:
    """``out/<name>/<run id>/``, written beside it and renamed at the end. What somebody else has
    put into a run's folder stays in it when the run is made again.

    Give ``trace_sink``, ``on_fate``, ``recorder`` and ``ledger`` (None where nothing is kept) to
    the ``Simulation``, and call ``begin`` before the clock runs. What lies in ``partial`` at the
    end belongs to the results. Raises ``InputError`` where the folder cannot be written, or another
    process is writing it.
    """

    def __init__(self, out: str | Path, scenario: Scenario) -> None:
        self.scenario = scenario
        self._written = written_by(scenario)
        self._identity = identity.Identity(scenario)
        self.run_id = self._identity.run_id(scenario.seed)
        self.path = Path(out) / scenario.name / self.run_id
        self.partial = self.path.with_name(f"{self.run_id}.partial")
        keep = scenario.trace.keep
        self._trace: parquet.TraceTable | None = None
        self._events: parquet.EventTable | None = None
        self._messages: parquet.MessageTable | None = None
        self._log = MessageLog(self._add_messages) if keep != "none" else None
        self.recorder = Recorder(self._add_events) if keep in ("replay", "all") else None
        self._ledger = LedgerRecorder(self._log) if scenario.trace.ledger else None
        self.trace_sink: RowSink | None = (
            None if self.recorder is None and self._ledger is None else self._add_rows)
        self.on_fate = self._log
        # For those who watch the run: what goes into the tables of events and of messages.
        self.on_events: RowSink = _ignored
        self.on_messages: Callable[[np.ndarray, list[str]], object] = _ignored
        self.notes: Json = {}  # of those who watch, for the manifest
        self.ledger = None if self._ledger is None else self._ledger.messages
        with self._writing():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._lock = self._claim()
            (self.partial / SCENARIO).write_text(
                resolved(scenario, self.partial), "utf-8")

    def begin(self, names: Names, hosts: tuple[str, ...]) -> None:
        """Open the tables. ``names`` are those of the run's trace, ``hosts`` are in index order."""
        with self._writing():
            if self.recorder is not None:
                self._events = parquet.EventTable(self.partial / EVENTS, names)
            if self.scenario.trace.keep == "all":
                self._trace = parquet.TraceTable(self.partial / TRACE, names)
            if self._log is not None:
                self._messages = parquet.MessageTable(self.partial / MESSAGES, names,
                                                      hosts)

    def finish(self, monitor: Monitor, now_ns: int, manifest: Json) -> Path | None:
        """Write the results and move the folder to its place. Returns that place, or None if a
        finished run is there already and stays. ``manifest`` has ``status`` and ``digest`` and what
        the caller measured."""
        summary = {**summarize(monitor, now_ns), "warnings": warnings(monitor),
                   "digest": manifest["digest"]}
        with self._writing():
            self._close_tables()
            parquet.write(self.partial / SAMPLES, samples_table(monitor))
            parquet.write(self.partial / ROBOTS, robots_table(monitor))
            parquet.write(self.partial / "latency.parquet", latency_table(monitor.truth.graph))
            if monitor.links is not None and self.recorder is None:
                parquet.write(self.partial / LINKS, monitor.links.table())
            self._write_maps(monitor)
            _write_json(self.partial / SUMMARY, summary)
            if self.recorder is not None:
                self._write_recording(self.recorder)
            if self._ledger is not None:
                hosts = [host.name for host in monitor.truth.graph.hosts]
                ledger = self._ledger.table(monitor.truth.trace.names, hosts)
                pq.write_table(ledger, self.partial / LEDGER, compression="zstd")
                _write_json(self.partial / LEDGER_TOPICS, as_json(by_topic(ledger, hosts)))
            return self._publish(manifest)

    def abandon(self, manifest: Json) -> None:
        """Keep what there is of a failed run, with a manifest that says so."""
        with self._writing():
            self._close_tables()
            if self.recorder is not None and self.recorder.times_ns:
                self._write_recording(self.recorder)
            self._publish(manifest)

    def discard(self) -> None:
        """Remove what there is of the run: nothing of it is worth keeping."""
        with suppress(OSError):
            _clear(self.partial, self._written)
        self._release()

    def flush(self) -> None:
        """Pass on the messages that wait for a full batch."""
        if self._log is not None:
            self._log.flush()

    def active_links(self, since_ns: int) -> int:
        """The number of pairs of hosts with a message settled since then; 0 where none are kept."""
        return self._log.active_links(since_ns) if self._log is not None else 0

    def _add_rows(self, rows: np.ndarray) -> None:
        if self.recorder is not None:
            self.recorder.rows(rows)
        if self._ledger is not None:
            self._ledger.sink(rows)
        if self._trace is not None:  # it is open while the clock runs
            with self._writing():
                self._trace.add(rows)

    def _add_events(self, rows: np.ndarray) -> None:
        self.on_events(rows)
        if self._events is not None:
            with self._writing():
                self._events.add(rows)

    def _add_messages(self, rows: np.ndarray, reasons: list[str]) -> None:
        self.on_messages(rows, reasons)
        if self._messages is not None:
            with self._writing():
                self._messages.add(rows, reasons)

    def _close_tables(self) -> None:
        self.flush()
        for table in (self._trace, self._events, self._messages):
            if table is not None:
                table.close()

    def _write_maps(self, monitor: Monitor) -> None:
        folder, ground = self.partial / MAPS, monitor.truth.ground
        folder.mkdir(exist_ok=True)
        truth = np.where(ground.solid != 0, 100, np.where(ground.reachable, 0, -1))
        maps.save(folder, "truth", truth, ground.grid)
        maps.save(folder, "merged", states(monitor.judged_map()),
                  ground.grid)

    def _write_recording(self, recorder: Recorder) -> None:
        recorder.finish()
        for name, table in recorded(recorder).items():
            parquet.write_integers(self.partial / f"{name}.parquet", table)
        parquet.write(self.partial / LINKS, recorder.links.table())
        names = recorder.names.items()
        _write_json(self.partial / NAMES, {str(id_): names[id_] for id_ in sorted(names)})

    def _publish(self, manifest: Json) -> Path | None:
        complete = {"desim_version": identity.versions()["desim"], "run_id": self.run_id,
                    "name": self.scenario.name, "seed": self.scenario.seed, **manifest,
                    **self.notes, "versions": identity.versions(),
                    "plugins": self._identity.plugins, "source": self._identity.source,
                    "machine": identity.machine()}
        before = manifest_of(self.path)
        if before is not None and before["status"] == manifest["status"] == RunStatus.FINISHED \
                and before["digest"] != manifest["digest"]:
            complete["differs_from_earlier"] = before["digest"]
        if before is None and os.path.lexists(self.path):
            complete["healed"] = f"its {MANIFEST} was missing or damaged"
        elif before is not None and (wrong := damage(self.path, before)) is not None:
            complete["healed"] = wrong
        # A finished run is not replaced by part of the same run.
        if manifest["status"] != RunStatus.FINISHED and before is not None \
                and before["status"] == RunStatus.FINISHED:
            self.discard()
            return None
        written = [name for name in _files(self.partial)
                   if name not in (*self._kept, MANIFEST, LOCK)
                   and (self.partial / name).is_file()]
        seal(self.partial, complete, written)
        self._put_in_place([*written, MANIFEST])
        return self.path

    def _put_in_place(self, written: list[str]) -> None:
        """Move the folder to its place by one rename, after everything is on the disk, so that a
        folder with the run's name is always whole."""
        for name in written:
            synced(self.partial / name)
        self._lock.remove_file()
        synced(self.partial)
        if os.path.lexists(self.path):
            os.replace(self.path, _free(self.path.with_name(f"{self.run_id}.old")))
        os.replace(self.partial, self.path)
        synced(self.path.parent)
        self._release()
        for old in sorted(self.path.parent.glob(f"{self.run_id}.old*")):
            _hand_over(old, self.path, self._written)

    def _release(self) -> None:
        self._lock.release()

    def _claim(self) -> Lock:
        """Take over the partial folder, empty but for what desim has not written, unless a living
        process is at work in it."""
        lock = _locked(self.partial)
        refuse_link(self.partial / MAPS)
        _clear(self.partial, self._written - {LOCK})
        self._kept = tuple(_files(self.partial))
        return lock

    def _writing(self) -> AbstractContextManager[None]:
        return _writing(self.partial)


@contextmanager
def reserved(out: str | Path, scenario: Scenario) -> Iterator[None]:
    """Keep other processes from the run's folder while a guest of this one writes it, whose locks
    are its own. Raises ``InputError`` where another process is writing it."""
    run_id = identity.Identity(scenario).run_id(scenario.seed)
    partial = Path(out) / scenario.name / f"{run_id}.partial"
    with _writing(partial):
        partial.parent.mkdir(parents=True, exist_ok=True)
        lock = _locked(partial)
    try:
        yield
    finally:
        with suppress(OSError):
            _clear(partial, (LOCK,))
        lock.release()


@contextmanager
def _writing(partial: Path) -> Iterator[None]:
    """Turn the errors of writing there into ``InputError``."""
    try:
        yield
    except OSError as error:
        space = "free some space, or " if error.errno in _FULL else ""
        raise InputError(f"cannot write results to {partial}: {error.strerror or error}; {space}"
                         "choose another folder with --out") from error


def _locked(partial: Path) -> Lock:
    """The lock of a partial folder, which is made if need be."""
    refuse_link(partial)
    partial.mkdir(exist_ok=True)
    try:
        return Lock(partial / LOCK)
    except Taken:
        raise InputError(f"{partial}: another process is writing this run; wait for it, or choose "
                         "another folder with --out") from None


def _files(folder: Path) -> Iterator[str]:
    """The names of the files of a run's folder."""
    for entry in folder.iterdir():
        if entry.name == MAPS and entry.is_dir() and not entry.is_symlink():
            yield from (f"{MAPS}/{below.name}" for below in entry.iterdir())
        else:
            yield entry.name


def _clear(folder: Path, written: Collection[str]) -> None:
    """Remove what desim has written, and the folder if nothing else is in it. Raises ``OSError``.
    """
    elsewhere = f"{MAPS}/" if (folder / MAPS).is_symlink() else None
    for name in written:
        if elsewhere is None or not name.startswith(elsewhere):
            (folder / name).unlink(missing_ok=True)
    for empty in (folder / MAPS, folder):
        with suppress(OSError):
            empty.rmdir()


def _hand_over(old: Path, new: Path, written: Collection[str]) -> None:
    """Move the files that are none of those ``written`` by desim from the folder of a run to that
    of the same run, made again; one whose name is taken there stays in ``old``."""
    if old.is_symlink() or not old.is_dir():
        return
    for name in _files(old):
        if name not in written and not os.path.lexists(new / name):
            os.replace(old / name, new / name)
    with suppress(OSError):
        _clear(old, written)


def _free(path: Path) -> Path:
    """``path``, or the first of ``path2``, ``path3``, ... that is not there."""
    names = chain([path], (path.with_name(f"{path.name}{number}") for number in count(2)))
    return next(name for name in names if not os.path.lexists(name))


def _write_json(path: Path, content: Json) -> None:
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", "utf-8")


def _ignored(*_: object) -> None:
    pass
