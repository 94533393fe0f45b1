"""Worker processes on this machine: each takes a run, gives back its row, and takes the next.

They are started once, so that importing and loading compiled kernels is paid once. One that dies
(out of memory, killed) is replaced, and its run is tried once more.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from multiprocessing.connection import Connection, wait
from time import monotonic

from desim.campaign.running.work import RunTask
from desim.results.row import Row, failure
from desim.units import DURATION, NS_PER_S

_TRIES = 2  # one death may be the machine's fault (memory, a kill); a second is the run's


class Crew:
    """``jobs`` worker processes. Use it as a context; leaving it ends them, at work or not. A run
    may take ``wall_ns`` of clock time (None: without a limit)."""

    def __init__(self, jobs: int, wall_ns: int | None = None) -> None:
        self._idle = [_Worker() for _ in range(jobs)]
        # Task, its number of tries, and its beginning; in the order in which they are due.
        self._busy: dict[Connection, tuple[_Worker, RunTask, int, float]] = {}
        self._wall_ns = wall_ns

    def __enter__(self) -> Crew:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in (*self._idle, *(worker for worker, *_ in self._busy.values())):
            worker.end()

    @property
    def has_idle_worker(self) -> bool:
        """Whether a worker is idle."""
        return bool(self._idle)

    @property
    def is_busy(self) -> bool:
        """Whether a worker is at work."""
        return bool(self._busy)

    def begin(self, task: RunTask, tries: int = 1) -> None:
        """Give an idle worker something to do."""
        worker = self._idle.pop()
        try:
            worker.connection.send(task)
        except OSError:  # it died while it was idle, which costs nobody a try
            worker.end()
            worker = _Worker()
            worker.connection.send(task)
        self._busy[worker.connection] = worker, task, tries, monotonic()

    def finished(self) -> list[tuple[RunTask, Row | Exception]]:
        """Wait for runs to end. Returns their rows, or the error that makes all further work
        pointless."""
        done: list[tuple[RunTask, Row | Exception]] = []
        ready = wait(list(self._busy), self._left_s())
        for connection in [connection for connection in self._busy if connection in ready]:
            worker, task, tries, _ = self._busy.pop(connection)
            try:
                done.append((task, connection.recv()))
                self._idle.append(worker)
            except (EOFError, OSError):
                cause = worker.end()
                self._idle.append(_Worker())
                if tries < _TRIES:
                    self.begin(task, tries + 1)
                else:
                    done.append((task, failure(task.run_id, f"its process died {tries} times "
                                                            f"({cause})")))
        return done + self._overdue()

    def _left_s(self) -> float | None:
        """Seconds until the first run is due; None without a limit."""
        if self._wall_ns is None:
            return None
        *_, begun_s = next(iter(self._busy.values()))
        return max(begun_s + self._wall_ns / NS_PER_S - monotonic(), 0.0)

    def _overdue(self) -> list[tuple[RunTask, Row | Exception]]:
        """Kill the workers whose runs take too long: one that computes answers nobody."""
        done: list[tuple[RunTask, Row | Exception]] = []
        while self._wall_ns is not None and self._busy and self._left_s() == 0.0:
            worker, task, *_ = self._busy.pop(next(iter(self._busy)))
            worker.end()
            self._idle.append(_Worker())
            done.append((task, failure(task.run_id, "ended after "
                         f"{DURATION.format(self._wall_ns)} of clock time (limits.wall)")))
        return done


class _Worker:
    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "desim.campaign.running.worker", str(theirs.fileno())],
                pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL,
                start_new_session=True)  # Ctrl-C is for the campaign, which ends its workers
        self.connection = Connection(ours.detach())

    def end(self) -> str:
        """Kill the process if it lives; returns the cause of its death."""
        if self._process.poll() is None:
            # What it is writing stays a .partial folder, which the next try empties.
            os.killpg(self._process.pid, signal.SIGKILL)
        code = self._process.wait()
        self.connection.close()
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
