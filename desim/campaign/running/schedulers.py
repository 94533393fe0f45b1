"""Dask schedulers: starting one here, or connecting to one elsewhere."""

from __future__ import annotations

import asyncio
import importlib
import logging
import os
import shutil
import signal
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import resource_tracker
from urllib.parse import urlsplit

import dask
from distributed import Client, LocalCluster
from distributed.comm import connect
from distributed.deploy import SpecCluster

from desim.campaign.running.cluster_settings import Local, Queue, Running, Settings
from desim.errors import InputError
from desim.operating_system.signals import without_interrupts
from desim.units import NS_PER_S

_CONNECT_S = 5  # a scheduler that is there answers within a second, also over a wide network
_COMMANDS = {"slurm": ("sbatch", "SLURMCluster"), "pbs": ("qsub", "PBSCluster")}
_DASK = {
    "distributed.scheduler.allowed-failures": 1,  # a second death of its worker ends a run
    "distributed.scheduler.worker-saturation": 1.0,  # nobody dies with runs that have not begun
    "distributed.deploy.lost-worker-timeout": "5s",  # then its job is replaced (Dask: 15 s)
}


@contextmanager
def connected(settings: Settings) -> Iterator[Client]:
    """A client of the cluster; leaving it ends what was started for it. Raises ``InputError`` where
    there is no such cluster."""
    with dask.config.set(_DASK), ExitStack() as stack:
        stack.callback(logging.disable, logging.root.manager.disable)
        logging.disable()  # Dask logs a lot; desim prints what matters
        if isinstance(settings, Running):
            yield stack.enter_context(_reached(settings.address))
            return
        if isinstance(settings, Local):
            stack.enter_context(_workers_environment())
        cluster = stack.enter_context(_local(settings.jobs or 1) if isinstance(
            settings, Local) else _queued(settings))
        yield stack.enter_context(Client(cluster, set_as_default=False))


@contextmanager
def _workers_environment() -> Iterator[None]:
    """The variables of processes that start meanwhile, first workers and replacements: they look
    for no module in the current folder. Dask sets more of them, and leaves them set."""
    before = dict(os.environ)
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _reached(address: str) -> Client:
    where = urlsplit(address)
    try:
        with socket.create_connection((where.hostname or "", where.port or 0), _CONNECT_S):
            pass  # Dask tries again until the time is over where nobody listens
    except ValueError:  # a port that is none
        raise InputError(f"--cluster {address}: must be tcp://host:port, with a port of "
                         "1 to 65535") from None
    except OSError as error:
        raise InputError(f"--cluster {address}: cannot be reached: "
                         f"{error.strerror or error}") from error
    try:
        asyncio.run(_greeted(address))  # a Client that cannot connect is noisy when it goes
    except Exception as error:  # whatever somebody else's answer makes Dask do
        raise InputError(f"--cluster {address}: no Dask scheduler answers there within "
                         f"{_CONNECT_S} s") from error
    return Client(address, timeout=_CONNECT_S, set_as_default=False)


async def _greeted(address: str) -> None:
    connection = await connect(address, timeout=_CONNECT_S)
    await connection.close()


def _local(workers: int) -> LocalCluster:
    # Ctrl-C is for the campaign, which ends its workers. They would print where it has met them.
    # What the threads that begin now block is blocked in every process that these start, unless one
    # of them has to start multiprocessing's tracker, which unblocks it.
    resource_tracker.ensure_running()
    with without_interrupts():
        cluster = LocalCluster(n_workers=0, threads_per_worker=1, memory_limit=0,
                               dashboard_address=":0", silence_logs=logging.CRITICAL)
    try:
        cluster.scale(workers)
        cluster.sync(_begun, cluster)
    except BaseException:  # Ctrl-C, while they start
        _give_up(cluster)
        raise
    return cluster


def _give_up(cluster: SpecCluster) -> None:
    """Close a cluster some of whose workers have not begun."""
    with suppress(Exception):  # Dask does not expect any, and fails in several ways
        cluster.close()
    cluster.shutdown_on_close = False  # nor does it then know at exit that it is closed


def _queued(settings: Queue) -> SpecCluster:
    command, make = _COMMANDS[settings.kind]
    if shutil.which(command) is None:
        raise InputError(f"--cluster: there is no {command} here; start the campaign on a machine "
                         f"that can submit jobs")
    try:
        cluster = _jobqueue(make)(**_keywords(settings))
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"--cluster: {error}") from error
    try:
        cluster.scale(jobs=settings.jobs)  # type: ignore[call-arg]  # a keyword of dask-jobqueue
        cluster.sync(_begun, cluster)
    except (OSError, RuntimeError) as error:
        _give_up(cluster)
        raise InputError(f"--cluster: {command} refuses the job: {_reason(error)}") from error
    # Jobs that end (their time is over, their machine went down) are replaced.
    cluster.adapt(minimum_jobs=settings.jobs, maximum_jobs=settings.jobs)
    return cluster


def _jobqueue(name: str) -> type[SpecCluster]:
    """A class of dask-jobqueue. The import of version 0.9 makes Ctrl-C leave with exit code 0."""
    before = signal.getsignal(signal.SIGINT)
    try:
        return getattr(importlib.import_module("dask_jobqueue"), name)
    finally:
        signal.signal(signal.SIGINT, before)


async def _begun(cluster: SpecCluster) -> None:
    """Wait for the jobs, which Dask submits in the background. Waiting for one that was refused
    submits it again, and raises the error."""
    await cluster
    for job in cluster.workers.values():
        await job


def _reason(error: Exception) -> str:
    """The batch system's own words, in one line, out of dask-jobqueue's error."""
    said = str(error).rpartition("stderr:")[2]
    return "; ".join(line.strip() for line in said.splitlines() if line.strip())


def _keywords(settings: Queue) -> dict[str, object]:
    """The settings as dask-jobqueue's keywords. A process for each core, as Python runs one thread
    at a time."""
    ours = f"jobqueue.{settings.kind}"
    cores = settings.cores or dask.config.get(f"{ours}.cores", None) or 1
    memory = (f"{settings.memory_bytes} B" if settings.memory_bytes else
              dask.config.get(f"{ours}.memory", None) or f"{2 * cores} GB")
    walltime_ns = settings.walltime_ns
    given = {"queue": settings.queue, "account": settings.account,
             "interface": settings.interface, "resource_spec": settings.resources,
             "walltime": None if walltime_ns is None else _clock(-(-walltime_ns // NS_PER_S)),
             "job_extra_directives": settings.directives and list(settings.directives),
             "job_script_prologue": settings.prologue and list(settings.prologue),
             "log_directory": settings.logs}
    return {"cores": cores, "processes": cores, "memory": memory,
            "scheduler_options": {"dashboard_address": ":0",  # any free port
                                  **dask.config.get(f"{ours}.scheduler-options", {})},
            **{name: value for name, value in given.items() if value is not None}}


def _clock(seconds: int) -> str:
    minutes, seconds = divmod(seconds, 60)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{seconds:02d}"
