"""Worker processes: what their death costs, and that none of them stays."""

import errno
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from designs import planned, written

from desim.campaign.design.metrics import Metrics
from desim.campaign.running import crew
from desim.campaign.running.crew import Crew
from desim.campaign.running.process import WorkerProcess
from desim.campaign.running.sweep import Sweep
from desim.campaign.running.work import Changed, RunTask

TEXT = "parameters: {robots: {key: fleet.size, values: [1, 2]}}\niterations: 2\n"
ONE = "iterations: 2\n"
# A metric that kills the worker which computes it; in the rehearsal, and where ``spared`` says so,
# it does not.
DEADLY = """\
import os, signal
from pathlib import Path

def deadly(run):
    tried = Path({folder!r}) / run.path.name
    if run.metrics["simulated_s"] < 0.05:
        return 0
    if run.manifest["seed"] == 2 and len(tried.read_text() if tried.exists() else "") < {times}:
        with open(tried, "a") as file:
            file.write("x")
        os.kill(os.getpid(), signal.SIGKILL)
    return 1
"""
SLEEPER = """\
import time
from desim.ports import Params as P

class Sleeps:
    class Params(P): pass
    def __init__(self, params): time.sleep(6000)
    def choose(self, context): return None

class Prints:
    class Params(P): pass
    def __init__(self, params): print("made")
    def choose(self, context): return None
"""


def swept(folder, text, jobs):
    plan = planned(folder, text)
    with Sweep(plan, Metrics(plan), folder / "out") as sweep, Crew(jobs) as crew:
        sweep.run(crew)
    return sweep


def test_one_and_two_workers_write_the_same_table(tmp_path):
    tables = []
    for jobs in (1, 2):
        folder = tmp_path / str(jobs)
        folder.mkdir()
        swept(folder, TEXT, jobs)
        tables.append((folder / "out" / "runs.parquet").read_bytes())
    assert tables[0] == tables[1]


@pytest.mark.parametrize("times, error", [(1, None), (2, "its process died 2 times (SIGKILL)")])
def test_a_worker_that_dies_costs_one_retry_and_twice_a_failed_row(tmp_path, times, error):
    module = f"deadly_{times}_of_mine"
    (tmp_path / f"{module}.py").write_text(DEADLY.format(folder=str(tmp_path), times=times))
    sweep = swept(tmp_path, ONE + f"metrics: {{one: '{module}:deadly'}}\n", 1)
    errors = {row.get("error") for row in sweep.agenda.rows.values()}
    assert errors == {None, error}
    assert sweep.agenda.progress == (2, 1 if error else 0, 2)
    assert sorted(len(file.read_text()) for file in tmp_path.iterdir()
                  if len(file.name) == 12 and file.is_file()) == [times]


def test_a_worker_that_dies_while_idle_costs_nothing(tmp_path):
    plan = planned(tmp_path, TEXT)
    vector = plan.vectors[0]
    task = RunTask(plan.run_id(vector, 0), plan.scenario(vector, 0), str(tmp_path), ())
    with Crew(1) as crew:
        child = crew._idle[0]._child
        child._guard.kill()
        with pytest.raises(EOFError):
            child.connection.recv()
        assert crew.made(task)["status"] == "finished"


def test_a_run_that_takes_too_long_has_failed_and_its_worker_is_replaced(tmp_path, monkeypatch):
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    plan = planned(tmp_path, "limits: {wall: 10 min}\niterations: 1\n"
                             "parameters: {s: {key: coordination.strategy, "
                             "values: ['sleeper:Sleeps', random_frontier]}}\n")
    assert plan.design.limits.wall_ns == 600 * 10**9
    late, good = (RunTask(plan.run_id(vector, 0), plan.scenario(vector, 0), str(tmp_path), ())
                  for vector in plan.vectors)
    now_s = [0.0]
    monkeypatch.setattr(crew, "monotonic", lambda: now_s[0])
    with Crew(1, plan.design.limits.wall_ns) as workers:
        workers.begin(late)
        while not workers._busy[0].worker.is_ready:
            assert workers.finished() == []
        now_s[0] = 601.0
        (_, row), = workers.finished()
        assert row["error"] == "ended after 600 s of clock time (limits.wall)"
        assert workers.made(good)["status"] == "finished"


def test_a_module_in_the_current_folder_is_not_the_workers(tmp_path, monkeypatch):
    """The folder in which a sweep is started may be anybody's."""
    plan = planned(tmp_path, ONE)
    task = RunTask(plan.run_id(plan.vectors[0], 0), plan.scenario(plan.vectors[0], 0),
                   str(tmp_path), ())
    (tmp_path / "foreign").mkdir()
    for name in ("desim", "numpy"):
        (tmp_path / "foreign" / f"{name}.py").write_text("open('mark', 'w')\n")
    monkeypatch.chdir(tmp_path / "foreign")
    with Crew(1) as workers:
        assert workers.made(task)["status"] == "finished"
    assert not (tmp_path / "foreign" / "mark").exists()


def test_the_clock_of_a_run_starts_when_its_worker_is_ready(tmp_path, monkeypatch):
    plan = planned(tmp_path, ONE)
    vector = plan.vectors[0]
    task = RunTask(plan.run_id(vector, 0), plan.scenario(vector, 0), str(tmp_path), ())
    with Crew(1, 600 * 10**9) as workers:
        now_s = [0.0]
        monkeypatch.setattr(crew, "monotonic", lambda: now_s[0])
        workers.begin(task)
        now_s[0] = 601.0  # it starts
        while not (done := workers.finished()):
            pass
    assert [row["status"] for _, row in done] == ["finished"]


def test_a_clean_sweep_replaces_no_worker(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(crew, "WorkerProcess", lambda: made.append(WorkerProcess()) or made[-1])
    assert swept(tmp_path, TEXT, 1).agenda.progress == (4, 0, 4)
    assert len(made) == 1


def test_a_log_that_cannot_be_written_costs_no_run(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    (tmp_path / "printer.py").write_text(SLEEPER)
    plan = planned(tmp_path, ONE + "set: {coordination.strategy: 'printer:Prints'}\n")
    vector = plan.vectors[0]
    task = RunTask(plan.run_id(vector, 0), plan.scenario(vector, 0), str(tmp_path), ())
    monkeypatch.setattr(Path, "write_bytes", full)
    with Crew(1, logs=tmp_path / "output") as workers:
        assert workers.made(task)["status"] == "finished"
        assert workers.made(task)["status"] == "finished"
    assert (tmp_path / "output").is_dir()


def test_code_that_changes_meanwhile_ends_the_campaign(tmp_path):
    """80 of 80 and a table with fewer rows."""
    plan = planned(tmp_path, TEXT)
    vector = plan.vectors[0]
    task = RunTask("another one", plan.scenario(vector, 0), str(tmp_path), ())
    with Crew(1) as workers, pytest.raises(Changed, match="has changed since the campaign began"):
        workers.made(task)


def children(pid: int) -> list[int]:
    """The processes that a process has begun."""
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def gone(pids: list[int]) -> bool:
    """Wait until none of these processes is alive."""
    for pid in pids:
        try:
            waited = os.pidfd_open(pid)
        except ProcessLookupError:
            continue
        import select

        poll = select.poll()
        poll.register(waited, select.POLLIN)
        if not poll.poll(10_000):
            return False
        os.close(waited)
    return True


@pytest.fixture
def campaign(tmp_path):
    """A campaign in a process of its own that has finished one run; its workers and their guards.
    """
    if not Path("/proc/self/task").exists():
        pytest.skip("children of a process are told by /proc of Linux")
    file = written(tmp_path, TEXT.replace("iterations: 2", "iterations: 2000"))
    process = subprocess.Popen(
        [sys.executable, "-m", "desim.cli", "sweep", str(file), "--out", str(tmp_path / "out"),
         "--jobs", "2"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    index = tmp_path / "out" / "index.jsonl"
    while process.poll() is None and not (index.exists() and index.stat().st_size):
        try:
            process.wait(0.05)
        except subprocess.TimeoutExpired:
            continue
    assert process.poll() is None, process.communicate()
    guards = children(process.pid)
    workers = [worker for guard in guards for worker in children(guard)]
    assert len(guards) == 2 and workers  # one may have to start yet
    yield process, [*guards, *workers], tmp_path / "out"
    process.kill()
    process.communicate()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_termination(campaign, number):
    process, workers, out = campaign
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    assert re.fullmatch(r"interrupted; what there is until then: \d+ of 4000 runs in .*/out; the "
                        r"same command goes on from there\n", errors)
    assert gone(workers)
    assert (out / "runs.parquet").exists()


def test_workers_leave_with_a_campaign_that_is_killed(campaign):
    process, workers, out = campaign
    process.kill()
    process.wait()
    assert gone(workers)
    assert not (out / "runs.parquet").exists()
