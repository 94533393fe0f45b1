"""A campaign through a real Slurm: the same bytes as from this machine's processes.

It takes a Slurm that is there already, or starts one of one machine with
``tools/slurm_one_machine.sh``; it installs nothing.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from desim.campaign.design.design import load_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan
from desim.campaign.running.cluster_settings import Queue
from desim.campaign.running.crew import Crew
from desim.campaign.running.sweep import Sweep

ANSWER_S = 20  # Slurm's commands wait for ever where its daemon is gone

DESIGN = """
name: queued
base: {base}
set: {{stop.elapsed: 2 s}}
parameters:
  robots: {{key: fleet.size, values: [1, 2]}}
iterations: 2
"""
# A metric that ends the whole job in which it is worked out, the first time, if that is Slurm's.
FATAL = """
import os, subprocess, threading

def lost(run):
    if "SLURM_JOB_ID" in os.environ and not os.path.exists("lost"):
        os.close(os.open("lost", os.O_CREAT | os.O_EXCL))
        subprocess.run(["scancel", "--signal=KILL", "--full", os.environ["SLURM_JOB_ID"]])
        threading.Event().wait()
    return 1.0
"""


def idle() -> bool:
    """Whether a Slurm answers and has a node for us."""
    states = subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True,
                            timeout=ANSWER_S)
    return states.stdout.strip() in ("idle", "mixed")


@pytest.fixture(scope="module")
def slurm(repository, tmp_path_factory):
    """``slurm.conf`` of a Slurm that answers is where its commands find it."""
    for package in ("distributed", "dask_jobqueue"):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed: pip install 'desim[cluster]'")
    for program in ("sbatch", "slurmctld", "slurmd", "munged"):
        if shutil.which(program) is None:
            pytest.skip(f"there is no {program}: tools/slurm_one_machine.sh install")
    if idle():
        yield
        return
    if os.geteuid() != 0:
        pytest.skip("no Slurm answers, and only root can start one")
    state = tmp_path_factory.mktemp("slurm")
    controller, node = free_ports()
    script = [str(repository / "tools" / "slurm_one_machine.sh")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLURM_STATE", str(state))
        patch.setenv("SLURM_CONF", str(state / "slurm.conf"))
        patch.setenv("SLURMCTLD_PORT", controller)
        patch.setenv("SLURMD_PORT", node)
        with open(state / "started", "w") as said:  # a pipe would stay open in the daemons
            started = subprocess.run([*script, "start"], stdout=said, stderr=said,
                                     timeout=2 * ANSWER_S)
        try:
            if started.returncode != 0:
                pytest.skip(f"Slurm cannot be started here: {(state / 'started').read_text()}")
            yield
        finally:
            subprocess.run([*script, "stop"], timeout=3 * ANSWER_S)


def free_ports() -> tuple[str, str]:
    """Not Slurm's own: another one may be running."""
    with socket.create_server(("", 0)) as one, socket.create_server(("", 0)) as another:
        return str(one.getsockname()[1]), str(another.getsockname()[1])


@pytest.fixture
def design(repository, tmp_path, monkeypatch) -> Path:
    """In the current folder."""
    monkeypatch.chdir(tmp_path)
    file = Path("design.yaml")
    file.write_text(DESIGN.format(base=repository / "scenarios" / "hello.yaml"))
    return file


def queue(jobs: int) -> Queue:
    return Queue(kind="slurm", jobs=jobs, cores=1, memory="500 MB", interface="lo", logs="logs",
                 walltime="10 min")


def swept(plan: Plan, out: Path, workers) -> dict[str, str]:
    """Digests by run id."""
    with Sweep(plan, Metrics(plan), out) as sweep:
        sweep.run(workers)
        return {run_id: row["digest"] for run_id, row in sweep.agenda.rows.items()}


def test_slurm_gives_the_bytes_that_processes_give(slurm, design):
    from desim.campaign.running.cluster import Cluster
    from desim.campaign.running.schedulers import connected

    plan = Plan(load_design(design))
    with Crew(2) as crew:
        digests = swept(plan, Path("crew"), crew)
    with connected(queue(jobs=2)) as client:
        assert swept(plan, Path("slurm"), Cluster(client)) == digests
    assert len(digests) == 4
    assert Path("slurm", "runs.parquet").read_bytes() == Path("crew", "runs.parquet").read_bytes()
    assert list(Path("logs").glob("*.err"))  # Slurm's jobs did it


def test_a_job_that_is_lost_is_replaced_and_its_run_tried_again(slurm, design):
    from desim.campaign.running.cluster import Cluster
    from desim.campaign.running.schedulers import connected

    Path("fatal.py").write_text(FATAL)
    design.write_text(design.read_text() + "metrics: {lost: 'fatal:lost'}\n")
    plan = Plan(load_design(design))
    with connected(queue(jobs=1)) as client:
        swept(plan, Path("slurm"), Cluster(client))
    with Crew(1) as crew:
        swept(plan, Path("crew"), crew)
    assert Path("lost").exists() and len(list(Path("logs").glob("*.err"))) > 1  # one for each job
    assert Path("slurm", "runs.parquet").read_bytes() == Path("crew", "runs.parquet").read_bytes()
