"""Runs on a Dask cluster: ``Cluster`` is for many machines what ``Crew`` is for one.

A worker does one run at a time and writes its folder itself, so that all machines must see the
campaign's folder, and the folder that the campaign was started in, under the same path.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from concurrent.futures import CancelledError
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock

from distributed import Client, Future, KilledWorker

from desim.campaign.running.crew import Crew
from desim.campaign.running.sweep import LOGS
from desim.campaign.running.work import RunTask, Unwritable
from desim.engine.garbage import freeze_present_objects
from desim.errors import InputError
from desim.operating_system.locks import waited_for
from desim.results.identity import Identity
from desim.results.row import Row, failure, row_of
from desim.results.run import Run
from desim.results.seal import manifest_of

_POLL_S = 1.0  # how often workers are counted while no run ends
_alone = Lock()


class Cluster:
    """The workers of ``client``'s cluster; when one dies its run is tried once more.
    ``workers_up`` is called with their number when it changes. A run may take ``wall_ns`` of clock
    time (None: without a limit)."""

    def __init__(self, client: Client, workers_up: Callable[[int], object] = lambda count: None,
                 wall_ns: int | None = None) -> None:
        self._client, self._wall_ns = client, wall_ns
        self._workers_up = workers_up
        self._folder = os.getcwd()
        self._done: SimpleQueue[Future] = SimpleQueue()
        self._tasks: dict[Future, RunTask] = {}
        self._count = -1
        self._ended = 0  # runs since workers were counted
        self._count_workers()

    @property
    def has_idle_worker(self) -> bool:
        """Whether a worker is idle; a first run waits for the first worker."""
        return len(self._tasks) < max(self._count, 1)

    @property
    def is_busy(self) -> bool:
        """Whether something is being run."""
        return bool(self._tasks)

    def begin(self, task: RunTask) -> None:
        """Send a run to the cluster."""
        future = self._client.submit(carried_out, task, self._folder, self._wall_ns,
                                     pure=False)
        self._tasks[future] = task
        future.add_done_callback(self._done.put)

    def finished(self) -> list[tuple[RunTask, Row | Exception]]:
        """Wait for runs to end, for a second at most. Returns their rows, or the error that makes
        all further work pointless."""
        try:
            done = [self._done.get(timeout=_POLL_S)]
        except Empty:
            self._count_workers()
            return []
        while not self._done.empty():
            done.append(self._done.get())
        self._ended += len(done)
        if self._ended >= self._count:  # each worker has done something since: often enough
            self._count_workers()
        return [(task := self._tasks.pop(future), _outcome(task, future)) for future in done]

    def _count_workers(self) -> None:
        self._ended = 0
        try:
            count = len(self._client.nthreads())
        except OSError as gone:
            raise InputError("the Dask scheduler is gone; what is finished stays, and the same "
                             "command goes on from there") from gone
        if count != self._count:
            self._count = count
            self._workers_up(count)


def _outcome(task: RunTask, future: Future) -> Row | Exception:
    try:
        return future.result()
    except KilledWorker as killed:
        return failure(task.run_id, f"its worker died {killed.allowed_failures + 1} times")
    except InputError as error:
        return error
    except CancelledError:
        return InputError("the Dask cluster has dropped a run, as it does when its scheduler goes; "
                          "the same command goes on from what is finished")
    except Exception as error:  # it could not even be begun
        return InputError(f"a worker of the cluster fails before it runs anything: "
                          f"{type(error).__name__}: {error}")


def carried_out(task: RunTask, folder: str, wall_ns: int | None = None) -> Row:
    """Make a run on a worker, as if it were made in ``folder``, where the campaign was started.

    Raises ``InputError`` where this worker's runs would not be those of the campaign.
    """
    with _alone:  # a process has one current folder, and a worker may have several threads
        machine = socket.gethostname()
        try:
            os.chdir(folder)
        except OSError as error:
            raise Unwritable(f"{machine} does not see {folder}: {error.strerror}") from None
        if not os.path.isdir(task.out):
            raise Unwritable(f"{machine} does not see {os.path.abspath(task.out)}: a campaign's "
                             "folder must be on a file system that all workers share")
        scenario = task.loaded.scenario
        if Identity(scenario).run_id(scenario.seed) != task.run_id:
            raise InputError(f"{machine} has another version of Python, desim, a plug-in or a "
                             "package than the machine that runs the campaign; its results would "
                             "be others")
        _freeze_modules()
        return _left_behind(task) or _child(folder, os.path.abspath(task.out), wall_ns).made(task)


@cache
def _child(_: str, runs: str, wall_ns: int | None) -> Crew[RunTask]:
    """A process in the current folder that the worker can kill, as it could not kill a thread, and
    that a plug-in may end. It stays for the next run, and ends with the worker."""
    return Crew(1, wall_ns, Path(runs).parent / LOGS)


# Once, for the modules: what Dask makes later is not ours to keep.
_freeze_modules = cache(freeze_present_objects)


def _left_behind(task: RunTask) -> Row | None:
    """The row of a run that another process is still writing, when that has ended; None if there is
    none. A killed campaign or a lost worker may have left such a process behind."""
    path = Path(task.out) / task.loaded.scenario.name / task.run_id
    try:
        if not waited_for(path.with_name(f"{path.name}.partial") / ".lock"):
            return None
    except OSError:  # nobody has begun it, or there are no locks here
        return None
    return None if manifest_of(path) is None else row_of(Run(path), task.functions)
