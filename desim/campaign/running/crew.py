"""Worker processes on this machine: each takes a task, gives back its row, and takes the next.

They are started once, so that importing and loading compiled kernels is paid once. One that dies
(out of memory, killed) is replaced, and its run is tried once more. One that a run has left in
another state than it found (directory, environment, signals, children) is replaced, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from multiprocessing.connection import wait
from pathlib import Path
from time import monotonic
from typing import Generic, NamedTuple, TypeVar

from desim.campaign.design.rehearsal import Errand
from desim.campaign.running.process import WorkerProcess
from desim.results.row import Row, failure
from desim.units import DURATION, NS_PER_S

_TRIES = 2  # one death may be the machine's fault (memory, a kill); a second is the run's
_SLOW_S = 60.0  # a run that takes longer is mentioned, as often as that
T = TypeVar("T", bound=Errand)


class _Job(NamedTuple, Generic[T]):
    worker: WorkerProcess
    task: T
    tries: int
    begun_s: float  # infinity while its worker starts


class Crew(Generic[T]):
    """``jobs`` worker processes. Use it as a context; leaving it ends them, at work or not. A task
    may take ``wall_ns`` of clock time once its worker is ready (None: without a limit). What a run
    prints is kept, cut, in the folder ``logs``. ``slow`` is called with a run's id and its seconds,
    once a minute."""

    def __init__(self, jobs: int, wall_ns: int | None = None, logs: Path | None = None,
                 slow: Callable[[str, float], object] = lambda run_id, seconds: None) -> None:
        self._idle = [WorkerProcess() for _ in range(jobs)]
        self._busy: list[_Job[T]] = []
        self._wall_ns, self._logs, self._slow = wall_ns, logs, slow
        self._mentioned_s = monotonic()

    def __enter__(self) -> Crew[T]:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in (*self._idle, *(job.worker for job in self._busy)):
            worker.end()

    @property
    def has_idle_worker(self) -> bool:
        """Whether a worker is idle."""
        return bool(self._idle)

    @property
    def is_busy(self) -> bool:
        """Whether a worker is at work."""
        return bool(self._busy)

    def begin(self, task: T, tries: int = 1) -> None:
        """Give an idle worker something to do."""
        worker = self._idle.pop()
        try:
            worker.connection.send(task)
        except OSError:  # it died while it was idle, which costs nobody a try
            worker.end()
            worker = WorkerProcess()
            worker.connection.send(task)
        self._busy.append(_Job(worker, task, tries, monotonic() if worker.is_ready else math.inf))

    def made(self, task: T) -> Row:
        """Have a task done, and nothing beside. Raises the error that makes more of it pointless.
        """
        self.begin(task)
        while not (done := self.finished()):
            pass
        (_, outcome), = done
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def finished(self) -> list[tuple[T, Row | Exception]]:
        """Wait for tasks to end, for a minute at most. Returns their rows, or the error that makes
        all further work pointless."""
        done: list[tuple[T, Row | Exception]] = []
        wait([sign for job in self._busy for sign in job.worker.signs], self._left_s())
        for job in list(self._busy):
            job.worker.drain()
            life = wait(job.worker.signs[:2], 0)
            if not life:
                continue
            self._busy.remove(job)
            try:
                if job.worker.connection not in life:
                    raise EOFError
                answer = job.worker.connection.recv()
                if answer is None:
                    job.worker.is_ready = True
                    self._busy.append(job._replace(begun_s=monotonic()))
                    continue
                outcome, is_clean = answer
                done.append((job.task, outcome))
                self._free(job, is_clean)
            except Exception:  # dead, or no answer: a plug-in has closed or used the connection
                cause = self._free(job, False)
                if job.tries < _TRIES:
                    self.begin(job.task, job.tries + 1)
                else:
                    done.append((job.task, failure(
                        job.task.run_id, f"its process died {job.tries} times ({cause})")))
        self._mention()
        return done + self._overdue()

    def _free(self, job: _Job[T], is_clean: bool) -> str:
        """Make the worker idle, or another one in its place; returns the cause of its death."""
        job.worker.keep_output(self._logs and self._logs / f"{job.task.run_id}.log")
        if is_clean:
            self._idle.append(job.worker)
            return ""
        cause = job.worker.end()
        self._idle.append(WorkerProcess())
        return cause

    def _left_s(self) -> float:
        """Seconds until the first run is due, or is to be mentioned."""
        if self._wall_ns is None or not self._busy:
            return _SLOW_S
        due_s = min(job.begun_s for job in self._busy) + self._wall_ns / NS_PER_S
        return min(max(due_s - monotonic(), 0.0), _SLOW_S)

    def _mention(self) -> None:
        now_s = monotonic()
        if now_s < self._mentioned_s + _SLOW_S:
            return
        self._mentioned_s = now_s
        for job in self._busy:
            if now_s >= job.begun_s + _SLOW_S:
                self._slow(job.task.run_id, now_s - job.begun_s)

    def _overdue(self) -> list[tuple[T, Row | Exception]]:
        """Kill the workers whose runs take too long: one that computes answers nobody."""
        done: list[tuple[T, Row | Exception]] = []
        while self._wall_ns is not None and self._busy and self._left_s() == 0.0:
            job = min(self._busy, key=lambda job: job.begun_s)
            self._busy.remove(job)
            self._free(job, False)
            done.append((job.task, failure(job.task.run_id, "ended after "
                         f"{DURATION.format(self._wall_ns)} of clock time (limits.wall)")))
        return done
