"""A campaign through a real Slurm: the same bytes as from this machine's processes.

It takes a Slurm that is there already, or starts one of one machine with
``tools/slurm_one_machine.sh``; it installs nothing.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from desim.campaign.campaign import Sweep
from desim.campaign.clustersettings import Queue
from desim.campaign.crew import Crew
from desim.campaign.design import load_design
from desim.campaign.metrics import Metrics
from desim.campaign.plan import Plan

ANSWER_S = 20  # Slurm's commands wait for ever where its daemon is gone

DESIGN = """
name: queued
base: {base}
set: {{stop.elapsed: 2 s}}
parameters:
  robots: {{key: fleet.size, values: [1, 2]}}
iterations: 2
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
    script = [str(repository / "tools" / "slurm_one_machine.sh")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLURM_STATE", str(state))
        patch.setenv("SLURM_CONF", str(state / "slurm.conf"))
        with open(state / "started", "w") as said:  # a pipe would stay open in the daemons
            started = subprocess.run([*script, "start"], stdout=said, stderr=said,
                                     timeout=2 * ANSWER_S)
        try:
            if started.returncode != 0:
                pytest.skip(f"Slurm cannot be started here: {(state / 'started').read_text()}")
            yield
        finally:
            subprocess.run([*script, "stop"], timeout=ANSWER_S)


def swept(plan: Plan, out: Path, workers) -> dict[str, str]:
    """Digests by run id."""
    with Sweep(plan, Metrics(plan), out) as sweep:
        sweep.run(workers)
        return {run_id: row["digest"] for run_id, row in sweep.rows.items()}


def test_slurm_gives_the_bytes_that_processes_give(slurm, repository, tmp_path, monkeypatch):
    from desim.campaign.cluster import Cluster
    from desim.campaign.schedulers import connected

    monkeypatch.chdir(tmp_path)
    Path("design.yaml").write_text(
        DESIGN.format(base=repository / "scenarios" / "hello.yaml"))
    plan = Plan(load_design("design.yaml"))
    with Crew(2) as crew:
        digests = swept(plan, Path("crew"), crew)
    queue = Queue(kind="slurm", jobs=2, cores=1, memory="500 MB", interface="lo", logs="logs",
                  walltime="10 min")
    with connected(queue, cores=1) as client:
        assert swept(plan, Path("slurm"), Cluster(client)) == digests
    assert len(digests) == 4
    assert Path("slurm", "runs.parquet").read_bytes() == Path("crew", "runs.parquet").read_bytes()
    assert list(Path("logs").glob("*.err"))  # Slurm's jobs did it
