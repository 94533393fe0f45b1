"""Campaigns on Dask: the same bytes as from this machine's processes, whatever dies."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from desim.campaign.design.design import load_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan
from desim.campaign.running import cluster_settings
from desim.campaign.running.cluster_settings import Local, Queue, Running, load_settings
from desim.campaign.running.crew import Crew
from desim.campaign.running.driver import CampaignDriver
from desim.campaign.running.sweep import Sweep
from desim.campaign.running.work import RunTask, Unwritable
from desim.errors import InputError
from desim.operating_system import locks

needs_dask = pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in ("distributed", "dask_jobqueue")),
    reason="Dask is not installed: pip install 'desim[cluster]'")

S = 10**9
DESIGN = """
name: clustered
base: {base}
set: {{stop.elapsed: 2 s}}
parameters:
  robots: {{key: fleet.size, values: [1, 2]}}
iterations: 2
"""
# Metrics that kill the process in which they are worked out: the first time, or every time; and one
# that presses Ctrl-C, if that is a worker's.
DEADLY = """
import os, signal, threading

def once(run):
    try:
        os.close(os.open("died", os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return 1.0
    os.kill(os.getpid(), signal.SIGKILL)

def always(run):
    os.kill(os.getpid(), signal.SIGKILL)

def interrupting(run):
    with open(f"/proc/{os.getppid()}/stat") as guard:
        worker = int(guard.read().rpartition(")")[2].split()[1])
    with open(f"/proc/{worker}/cmdline", encoding="latin-1") as command:
        is_of_worker = "multiprocessing" in command.read()
    if is_of_worker:
        os.killpg(os.getpgid(worker), signal.SIGINT)
        threading.Event().wait()
    return 1.0
"""


@pytest.fixture(scope="module")
def plan(repository, tmp_path_factory) -> Plan:
    file = tmp_path_factory.mktemp("design") / "design.yaml"
    file.write_text(DESIGN.format(base=repository / "scenarios" / "hello.yaml"))
    return Plan(load_design(file))


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """The current folder, where a campaign is started."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deadly.py").write_text(DEADLY)
    return tmp_path


@pytest.fixture(scope="module")
def client():
    from desim.campaign.running.schedulers import connected

    with connected(Local(kind="local", jobs=2)) as client:
        yield client


def task(plan: Plan, folder: Path, *functions: str) -> RunTask:
    """A campaign's first run, to be made in ``folder``."""
    (folder / "runs").mkdir()
    loaded = plan.scenario(plan.vectors[0], 0)
    return RunTask(plan.run_id(plan.vectors[0], 0), loaded, "runs", functions)


def outcome(client, task: RunTask):
    from desim.campaign.running.cluster import Cluster

    cluster = Cluster(client)
    cluster.begin(task)
    while cluster.is_busy:
        for _, row in cluster.finished():
            return row
    raise AssertionError("not reached")


def swept(plan: Plan, out: Path, workers) -> dict[str, str]:
    """Digests by run id."""
    with Sweep(plan, Metrics(plan), out) as sweep:
        sweep.run(workers)
        return {run_id: row["digest"] for run_id, row in sweep.agenda.rows.items()}


@needs_dask
def test_dask_gives_the_bytes_that_processes_give(plan, folder, client):
    from desim.campaign.running.cluster import Cluster
    from desim.campaign.running.schedulers import connected

    with Crew(2) as crew:
        digests = swept(plan, Path("crew"), crew)
    up: list[int] = []
    assert swept(plan, Path("dask"), Cluster(client, up.append)) == digests
    assert len(digests) == 4 and up == [2]
    running = Running(kind="dask", address=client.scheduler.address)
    with connected(running) as another:
        assert swept(plan, Path("address"), Cluster(another)) == digests
    tables = [Path(out, "runs.parquet").read_bytes() for out in ("crew", "dask", "address")]
    assert tables[0] == tables[1] == tables[2]


@needs_dask
def test_a_worker_that_does_not_see_the_folders_says_so(plan, folder, client, tmp_path):
    blind = task(plan, folder)._replace(out="elsewhere")
    error = outcome(client, blind)
    assert isinstance(error, Unwritable)
    assert f"does not see {tmp_path}/elsewhere: a campaign's folder must be on" in str(error)


@needs_dask
def test_a_worker_with_other_versions_runs_nothing(plan, folder, client):
    error = outcome(client, task(plan, folder)._replace(run_id="0123456789ab"))
    assert "has another version of Python, desim, a plug-in or a package" in str(error)
    assert not any(Path("runs").iterdir())


@needs_dask
def test_what_a_killed_campaign_still_writes_is_waited_for(plan, folder, monkeypatch):
    from desim.campaign.running import cluster

    run = task(plan, folder)
    row = cluster.carried_out(run, os.getcwd())
    finished = Path("runs", "hello", run.run_id)
    written_ns = finished.stat().st_mtime_ns
    orphan = finished.with_name(f"{run.run_id}.partial")
    orphan.mkdir()
    held, wait_for_lock = locks.Lock(orphan / ".lock"), locks._wait_for_lock

    def waiting(descriptor):
        held.release()  # while one waits, the orphan finishes
        wait_for_lock(descriptor)

    monkeypatch.setattr(locks, "_wait_for_lock", waiting)
    assert cluster.carried_out(run, os.getcwd()) == row
    assert finished.stat().st_mtime_ns == written_ns  # it was not run again
    assert cluster.carried_out(run, os.getcwd())["digest"] == row["digest"]
    assert finished.stat().st_mtime_ns > written_ns  # nobody held the lock: it was


@needs_dask
def test_a_run_that_takes_too_long_has_failed(plan, folder, monkeypatch):
    """On a worker, too; the next run has a process again."""
    from desim.campaign.running import cluster, crew

    run, now_s = task(plan, folder), [0.0]

    def late_when_begun(self):
        if any(job.begun_s == 0.0 for job in self._busy):
            now_s[0] = 601.0

    monkeypatch.setattr(crew, "monotonic", lambda: now_s[0])
    monkeypatch.setattr(Crew, "_mention", late_when_begun)
    with cluster._child(os.getcwd(), os.path.abspath(run.out), 600 * S):
        late, made = (cluster.carried_out(run, os.getcwd(), 600 * S) for _ in range(2))
    assert late["error"] == "ended after 600 s of clock time (limits.wall)"
    assert made["status"] == "finished"


@needs_dask
def test_ctrl_c_is_not_for_workers(client):
    for blocked in client.run(signal.pthread_sigmask, signal.SIG_BLOCK, ()).values():
        assert signal.SIGINT in blocked
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@needs_dask
def test_ctrl_c_ends_everybody(repository, folder):
    Path("design.yaml").write_text(DESIGN.format(base=repository / "scenarios" / "hello.yaml") +
                                   "metrics: {pressed: 'deadly:interrupting'}\n")
    command = [sys.executable, "-m", "desim.cli", "sweep", "design.yaml", "--cluster", "local",
               "--jobs", "1"]
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as sweep:
        # It returns when nobody is left who has the pipes.
        said, complained = sweep.communicate(timeout=120)
    assert (sweep.returncode, complained) == (130, (
        "interrupted; what there is until then: 0 of 4 runs in results/clustered; the same command "
        "goes on from there\n"))
    assert "1 worker up" in said


@needs_dask
def test_no_more_workers_start_than_there_are_runs_and_the_environment_stays_as_it_was(
        repository, folder):
    up: list[int] = []
    base = repository / "scenarios" / "hello.yaml"
    Path("two.yaml").write_text(
        f"name: two\nbase: {base}\nset: {{stop.elapsed: 2 s}}\niterations: 2\n")
    plan, before = Plan(load_design(Path("two.yaml"))), dict(os.environ)
    with Sweep(plan, Metrics(plan), Path("many")) as sweep:
        queue = CampaignDriver(sweep, None, Queue(kind="slurm", jobs=100_000))
        assert queue.where == "in 2 jobs of slurm"
        local = CampaignDriver(sweep, None, Local(kind="local", jobs=100_000))
        local.run(lambda _: None, up.append)
        assert sweep.agenda.progress[0] == 2
    assert max(up) <= 2
    assert dict(os.environ) == before


@needs_dask
def test_ctrl_c_while_workers_start_closes_the_cluster(monkeypatch):
    """Dask would otherwise try it at exit, and complain of workers that have not begun."""
    from desim.campaign.running import schedulers

    begun, made = schedulers._begun, []

    class Interrupted(schedulers.LocalCluster):
        def sync(self, call, *arguments, **options):
            if call is begun:
                made.append(self)
                raise KeyboardInterrupt
            return super().sync(call, *arguments, **options)

    monkeypatch.setattr(schedulers, "LocalCluster", Interrupted)
    with pytest.raises(KeyboardInterrupt), schedulers.connected(Local(kind="local", jobs=2)):
        raise AssertionError("not reached")
    assert not made[0].shutdown_on_close


@pytest.fixture
def silent():
    """An address at which a server listens that is no Dask scheduler."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=_refuse, args=(server,), daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture
def nobody():
    """A port that is taken, but at which nobody listens."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield f"tcp://127.0.0.1:{taken.getsockname()[1]}"


def _refuse(server: socket.socket) -> None:
    with suppress(OSError):
        while True:
            connection, _ = server.accept()
            with connection:
                connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")


def reached(address: str) -> None:
    from desim.campaign.running.schedulers import connected

    with connected(Running(kind="dask", address=address)):
        pass


@needs_dask
def test_somebody_else_answers(silent):
    with pytest.raises(InputError, match=f"^--cluster {silent}: no Dask scheduler answers there "
                                         "within 5 s$"):
        reached(silent)


@needs_dask
def test_nobody_answers(nobody):
    with pytest.raises(InputError, match=f"^--cluster {nobody}: cannot be reached: "
                                         "Connection refused$"):
        reached(nobody)


@needs_dask
def test_a_port_that_is_none():
    with pytest.raises(InputError, match="with a port of 1 to 65535$"):
        reached("tcp://127.0.0.1:70000")


@needs_dask
def test_what_cluster_may_say(folder):
    assert load_settings("local", 3) == Local(kind="local", jobs=3)
    assert load_settings("pbs") == Queue(kind="pbs")
    assert load_settings("tcp://head:8786") == Running(kind="dask", address="tcp://head:8786")
    Path("ours.yaml").write_text("kind: slurm\nqueue: main\nmemory: 2 GB\nwalltime: 4 h\njobs: 10")
    assert load_settings("ours.yaml", 4) == Queue(
        kind="slurm", queue="main", memory="2 GB", walltime="4 h", jobs=4)


@needs_dask
@pytest.mark.parametrize(("text", "says"), [
    ("kind: slrm", "ours.yaml:1:7: kind: 'slrm' is not allowed; allowed: local, dask, slurm, pbs"),
    ("queue: main", "ours.yaml:1:1: kind: is missing; allowed: local, dask, slurm, pbs"),
    ("kind: slurm\nqueu: main", "ours.yaml:2:1: queu: unknown key (did you mean 'queue'?); "
     "allowed: kind, jobs, queue, account, cores, memory, walltime, interface, resources, "
     "directives, prologue, logs"),
    ("kind: pbs\nmemory: 3", "ours.yaml:2:9: memory: 3 has no unit; allowed: B, kB, MB, GB, KiB, "
                             "MiB, e.g. '1500 B'"),
])
def test_wrong_files(folder, text, says):
    Path("ours.yaml").write_text(text)
    with pytest.raises(InputError) as raised:
        load_settings("ours.yaml")
    assert str(raised.value) == says


@needs_dask
@pytest.mark.parametrize("text", ["slrm", "tcp://head", "dask", "http://head:80"])
def test_wrong_words(text):
    with pytest.raises(InputError, match="must be local, slurm, pbs, the address of a Dask"):
        load_settings(text)


def test_without_dask(monkeypatch):
    monkeypatch.setattr(cluster_settings.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"^--cluster needs distributed, which is not installed: "
                                         r"pip install 'desim\[cluster\]'$"):
        load_settings("local")


@needs_dask
def test_jobs_in_the_words_of_dask_jobqueue():
    from desim.campaign.running.schedulers import _keywords

    assert _keywords(Queue(kind="slurm", cores=4, walltime="90 min", queue="main")) == {
        "cores": 4, "processes": 4, "memory": "8 GB", "walltime": "01:30:00", "queue": "main",
        "scheduler_options": {"dashboard_address": ":0"}}
    assert _keywords(Queue(kind="pbs", memory="500 MB", prologue=["module load python"],
                           resources="nodes=1:ppn=1")) == {
        "cores": 1, "processes": 1, "memory": "500000000 B", "resource_spec": "nodes=1:ppn=1",
        "job_script_prologue": ["module load python"],
        "scheduler_options": {"dashboard_address": ":0"}}


# Deaths come last: they leave the cluster with workers that have yet to import everything.


@needs_dask
def test_a_run_survives_the_death_of_its_worker(plan, folder, client):
    row = outcome(client, task(plan, folder, "deadly:once"))
    assert (row["status"], row["functions"]) == ("finished", {"deadly:once": 1.0})
    assert Path("died").exists()


@needs_dask
def test_a_run_that_kills_two_workers_has_failed(plan, folder, client):
    lost = task(plan, folder, "deadly:always")
    assert outcome(client, lost) == {"run_id": lost.run_id, "status": "failed",
                                     "error": "its process died 2 times (SIGKILL)"}
