"""Commands about campaigns: what they are asked for, what they call, what they print."""

import json
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
from designs import Here, written
from typer.testing import CliRunner

from desim.campaign.design.rehearsal import here as in_this_process
from desim.campaign.running import driver, failing, probes
from desim.campaign.running.prediction import Cost, Forecast
from desim.cli import app
from desim.commands import campaigns
from desim.report.campaign import campaign_report
from desim.results.row import failure


class Crew(Here):
    """Workers of this process, of which the test knows the number."""

    asked: list = []

    def __init__(self, jobs, *_):
        super().__init__(work=lambda task: failure(task.run_id, "boom"))
        self.asked.append(jobs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A design of two vectors; no process is started, and all runs fail."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(campaigns, "_worker", lambda plan, console: nullcontext(
        SimpleNamespace(made=in_this_process)))
    monkeypatch.setattr(driver, "Crew", Crew)
    monkeypatch.setattr(Crew, "asked", [])
    written(tmp_path, "parameters: {robots: {key: fleet.size, values: [1, 2]}}\niterations: 1\n")
    return tmp_path


def desim(*words, code=0):
    done = CliRunner().invoke(app, list(map(str, words)))
    assert done.exit_code == code, done.output
    return done.output.splitlines()


def test_runs_that_failed_are_code_1():
    said = desim("sweep", "design.yaml", "--jobs", 1, code=1)
    assert said[0] == "2 runs, 0 done already; 1 at a time, in results/d"
    assert said[-1] == "--retry-failed runs them again" and Crew.asked == [1]


def test_what_failed_is_run_again_where_that_is_wanted():
    desim("sweep", "design.yaml", "--jobs", 1, code=1)
    for words, done in (((), 2), (("--retry-failed",), 0)):
        assert desim("sweep", "design.yaml", "--jobs", 1, *words, code=1)[0] == (
            f"2 runs, {done} done already; 1 at a time, in results/d")


def test_one_level_alone_in_a_folder_of_ones_own():
    said = desim("sweep", "design.yaml", "--jobs", 1, "--only", "robots=2", "--out", "mine", code=1)
    assert said[0] == "1 runs, 0 done already; 1 at a time, in mine"
    assert len(list(Path("mine").glob("runs.parquet"))) == 1


def test_quiet_prints_nothing_and_leaves_the_same():
    assert desim("sweep", "design.yaml", "--jobs", 1, "--quiet", code=1) == []
    assert desim("sweep", "small.yaml", "--vary", "fleet.size=1,2", "--seeds", 1, "--jobs", 1,
                 "--quiet", code=1) == []
    assert Path("results/small_size/design.yaml").is_file()


def test_a_varied_scenario_leaves_its_design_where_it_says():
    said = desim("sweep", "small.yaml", "--vary", "fleet.size=1,2", "--jobs", 1, "--out", "a b",
                 "--until", "50 ms", "--set", "robot.laser.beams=10", code=1)
    assert said[0] == "20 runs, 0 done already; 1 at a time, in a b"
    assert said[-2:] == ["its design, to keep or edit: a b/design.yaml",
                         "its report: desim report 'a b'"]
    text = Path("a b/design.yaml").read_text()
    assert "50 ms" in text and "beams" in text


@pytest.mark.parametrize(("words", "says"), [
    (["--seeds", 3], "--seeds: it belongs to --vary; a design has the key iterations"),
    (["--set", "a=1"], "--set: it belongs to --vary; a design has the key set"),
    (["--until", "1 s"], "--until: it belongs to --vary; a design has the key stop"),
    (["--only", "robots=3"], "--only robots=3: ")])
def test_options_that_do_not_belong_to_a_design(words, says):
    said, = desim("sweep", "design.yaml", *words, code=2)
    assert said.startswith(says) and not Path("results").exists()


def test_a_dry_run_lists_the_runs_and_their_cost(monkeypatch):
    monkeypatch.setattr(driver, "predicted", lambda plan, agenda, probing, tried, made: (
        Forecast(16.0, 34.0), [Cost(1, 10, True)], True))
    found = {}
    monkeypatch.setattr(failing, "failing", lambda *_: found)
    said = desim("sweep", "design.yaml", "--dry-run", "--jobs", 2)
    assert [line.partition("  ")[2] for line in said[:2]] == [
        "to run    robots=1, iteration 0", "to run    robots=2, iteration 0"]
    assert said[2:] == [
        "2 runs, 0 done, 0 of them failed",
        "16 s of CPU are to be expected (from 1 probe of 1.0 s, 1 of them to the end); 8 s with 2 "
        "jobs on cores of their own, at most 17 s, every run to its time limit"]
    assert not Path("results").exists() and probes.BUDGET_S > 0
    monkeypatch.setattr(campaigns, "cores", lambda: 4)
    assert "4 s with 4 jobs" in desim("sweep", "design.yaml", "--dry-run")[-1]
    found["robots=2"] = "boom"
    assert desim("sweep", "design.yaml", "--dry-run", code=1)[-1] == "robots=2: fails: boom"


def test_of_a_campaign_that_is_done_there_is_nothing_to_predict(monkeypatch):
    desim("sweep", "design.yaml", "--jobs", 1, code=1)
    monkeypatch.setattr(driver, "predicted", None)
    assert desim("sweep", "design.yaml", "--dry-run")[-1] == "2 runs, 2 done, 2 of them failed"


def test_jobs_and_cluster_reach_the_settings(monkeypatch):
    monkeypatch.setattr("desim.campaign.running.cluster_settings.load_settings",
                        lambda cluster, jobs: 1 / 0 if (cluster, jobs) == ("slurm", 5) else None)
    assert "ZeroDivisionError: division by zero" in desim(
        "sweep", "design.yaml", "--cluster", "slurm", "--jobs", 5, code=1)


@pytest.fixture
def reports(monkeypatch):
    """The arguments of the reports that were written."""
    made = []

    def write(folder, design, *out):
        made.append((str(folder), design.name, *map(str, out)))
        return (out or (Path(folder),))[0] / "index.html"

    monkeypatch.setattr(campaign_report, "write", write)
    return made


def test_a_report_is_in_the_campaigns_folder_or_where_it_is_wanted(reports):
    desim("sweep", "design.yaml", "--jobs", 1, code=1)
    assert desim("report", "results/d") == ["report: results/d/report/index.html"]
    assert desim("report", "results/d", "--out", "mine", "--quiet") == []
    Path("other.yaml").write_text(Path("design.yaml").read_text().replace("name: d", "name: e"))
    assert desim("report", "results/d", "--design", "other.yaml", "--out", "mine") == [
        "report: mine/index.html"]
    assert reports == [("results/d", "d", "results/d/report"), ("results/d", "d", "mine"),
                       ("results/d", "e", "mine")]


def test_a_leaderboard_is_no_report(reports, monkeypatch):
    desim("sweep", "design.yaml", "--jobs", 1, code=1)
    monkeypatch.setattr("desim.report.leaderboard.page.enter",
                        lambda study, page: f"entered {study.design.name}")
    assert desim("report", "results/d", "--leaderboard", "page.md", "--out", "x", code=2) == [
        "--out is the folder of a report, and with --leaderboard there is none"]
    assert desim("report", "results/d", "--leaderboard", "page.md") == [
        "leaderboard: page.md: entered d"]
    assert desim("report", "results/d", "--leaderboard", "page.md", "--quiet") == []
    assert reports == []


def test_a_ladder_is_swept_and_reported(reports, monkeypatch):
    shown = []
    monkeypatch.setattr("desim.commands.views.ladder.show",
                        lambda folder, design: shown.append((folder, design.name)))
    words = ("ladder", "small.yaml", "--compare", "robot.laser.beams=10,20", "--seeds", 1,
             "--set", "deployment=field", "--jobs", 2)
    said = desim(*words, code=1)
    assert said[0] == "10 runs, 0 done already; 2 at a time, in results/ladder_small_beams"
    assert said[-1] == "report: results/ladder_small_beams/index.html"
    assert shown == [(Path("results/ladder_small_beams"), "ladder_small_beams")]
    assert desim(*words, "--quiet", "--out", "mine", code=1) == [] and len(shown) == 1
    assert [folder for folder, *_ in reports] == ["results/ladder_small_beams", "mine"]


def test_a_deployment_is_asked_for_by_its_options(monkeypatch):
    asked = []

    def deployment_of(plan, chosen):
        asked.append((plan.design.name, chosen.robots_per_node, chosen.image_bytes, chosen.model,
                      chosen.rate_bps))

    monkeypatch.setattr("desim.commands.views.deployment.deployment_of", deployment_of)
    monkeypatch.setattr("desim.commands.views.deployment.json_object", lambda found: {"x": found})
    monkeypatch.setattr("desim.commands.views.deployment.show",
                        lambda found, console: console.print(found, console.quiet))
    assert json.loads("\n".join(desim("deploy", "design.yaml", "--json"))) == {"x": None}
    assert desim("deploy", "design.yaml", "--robots-per-node", 3, "--image", "2 MB", "--model",
                 "link", "--rate", "3 Mb/s") == ["None False"]
    assert asked == [("d", None, 6_800_000_000, "switch", 10**9),
                     ("d", 3, 2_000_000, "link", 3_000_000)]
