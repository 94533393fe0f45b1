"""The output while a campaign runs."""

from contextlib import nullcontext
from types import SimpleNamespace

import pytest
from designs import Here, written
from typer.testing import CliRunner

from desim.campaign.design.rehearsal import here
from desim.campaign.running import driver
from desim.campaign.running.prediction import Cost, Forecast
from desim.campaign.running.work import work
from desim.cli import app
from desim.commands import campaigns
from desim.commands.views.sweep import show_prediction
from desim.commands.views.terminal import Terminal
from desim.results.row import failure


@pytest.fixture(autouse=True)
def rehearsed_here(monkeypatch):
    """The trials before a campaign are made in this process."""
    monkeypatch.setattr(campaigns, "_worker",
                        lambda plan, console: nullcontext(SimpleNamespace(made=here)))


@pytest.fixture
def sweep(tmp_path, monkeypatch):
    """The exit code and the output of a sweep whose runs are worked on by ``work``."""
    monkeypatch.chdir(tmp_path)
    design = written(tmp_path, "parameters: {robots: {key: fleet.size, values: [1, 2]}}\n"
                               "iterations: 2\n")

    class Crew(Here):
        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

    def done(work):
        monkeypatch.setattr(driver, "Crew", lambda jobs, *_: Crew(work=work))
        result = CliRunner().invoke(app, ["sweep", design.name, "--jobs", "1"])
        return result.exit_code, result.output.splitlines()

    return done


def test_ctrl_c_says_how_far_it_came(sweep):
    asked = []

    def work(task):
        asked.append(task.run_id)
        if len(asked) == 3:
            raise KeyboardInterrupt
        return failure(task.run_id, "boom")

    assert sweep(work) == (130, [
        "4 runs, 0 done already; 1 at a time, in results/d", f"{asked[0]} failed: boom",
        "interrupted; what there is until then: 2 of 4 runs in results/d; the same command goes on "
        "from there"])


def test_brackets_in_labels_are_text(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    design = written(tmp_path, "parameters:\n  robots:\n    levels:\n"
                               "      '[/x] few': {fleet.size: 1}\n"
                               "      '[red]many': {fleet.size: 2}\niterations: 2\n")
    done = CliRunner().invoke(app, ["sweep", design.name, "--dry-run"])
    assert done.exit_code == 0, done.output
    assert "robots=[/x] few, iteration 0" in done.output
    assert "robots=[red]many, iteration 1" in done.output


def test_a_cause_is_printed_once_and_runs_that_failed_are_no_success(sweep):
    """Equal causes at other times and hosts are one."""
    asked = []

    def work(task):
        asked.append(task.run_id)
        return failure(task.run_id, f"boom at bad.py:7 (robot_1, {len(asked)} s)"
                       if len(asked) < 4 else "bang")

    code, lines = sweep(work)
    assert code == 1 and lines[1:] == [
        f"{asked[0]} failed: boom at bad.py:7 (robot_1, 1 s)", f"{asked[3]} failed: bang",
        "4 of 4 runs, 4 failed; table: results/d/runs.parquet",
        f"3 runs failed ({asked[0]}, ...): boom at bad.py:7", f"1 run failed ({asked[3]}): bang",
        "--retry-failed runs them again"]


def test_damage_is_printed(sweep, tmp_path):
    code, _ = sweep(work)
    folders = sorted((tmp_path / "results" / "d" / "runs" / "small").iterdir())
    (folders[0] / "summary.json").unlink()
    again, lines = sweep(work)
    assert (code, again) == (0, 0) and lines[:4] == [
        f"{folders[0].relative_to(tmp_path)}: damaged: summary.json is missing",
        "1 run is damaged; what is missing is made again",
        "4 runs, 3 done already; 1 at a time, in results/d",
        "4 of 4 runs; table: results/d/runs.parquet"]


@pytest.mark.parametrize(("costs", "said"), [
    ([Cost(1, 10, False, 0, 50.0)],
     "16 s of CPU are to be expected (from 1 probe of 1.0 s, 0 of them to the end), if exploring "
     "goes on as it began in these; 8 s with 2 jobs on cores of their own, at most 17 s, every run "
     "to its time limit\n"),
    ([Cost(1, 10, True)],
     "16 s of CPU are to be expected (from 1 probe of 1.0 s, 1 of them to the end); 8 s with 2 "
     "jobs on cores of their own, at most 17 s, every run to its time limit\n"),
    ([Cost(1, 10, False)],
     "34 s of CPU at most (from 1 probe of 1.0 s, 0 of them to the end, and none far enough to "
     "tell how long runs last); with 2 jobs on cores of their own at most 17 s, every run to its "
     "time limit\n")])
def test_a_prediction_says_what_it_rests_on(capsys, costs, said):
    show_prediction(Terminal(soft_wrap=True, highlight=False), Forecast(16.0, 34.0), costs, True, 2)
    assert capsys.readouterr().out == said
