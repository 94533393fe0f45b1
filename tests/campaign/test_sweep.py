"""A campaign goes on where it was, whatever happened to it, and ends in the same table."""

import json
import os
import shutil
from contextlib import contextmanager

import pyarrow.parquet as pq
import pytest
from designs import Here, loaded, planned

from desim.campaign.design.design import read_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.running.sweep import Sweep, foreseen
from desim.campaign.running.work import Unwritable, work
from desim.errors import InputError
from desim.results.row import failure

TEXT = """parameters:
  robots: {key: fleet.size, values: [1, 2]}
iterations: 3
metrics: {half: explored / 2}
"""
SMALL = "small"  # name of the scenario


@contextmanager
def swept(tmp_path, out, text=TEXT, **options):
    plan = planned(tmp_path, text)
    with Sweep(plan, Metrics(plan), out, **options) as sweep:
        yield sweep


def run(tmp_path, out, workers=None, text=TEXT, **options):
    """The sweep, and the ids of the runs that were begun."""
    workers = workers or Here()
    with swept(tmp_path, out, text, **options) as sweep:
        sweep.run(workers)
    return sweep, workers.begun


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The campaign without a disturbance."""
    folder = tmp_path_factory.mktemp("whole")
    run(folder, folder / "out")
    return folder / "out"


def table(out):
    return (out / "runs.parquet").read_bytes()


def test_a_campaigns_folder(whole):
    assert sorted(path.name for path in whole.iterdir()) == [
        ".lock", "design.yaml", "index.jsonl", "runs", "runs.parquet"]
    found = pq.read_table(whole / "runs.parquet").to_pydict()
    assert list(found)[:10] == ["run_id", "vector", "iteration", "seed", "status", "error",
                                "digest", "desim", "robots", "stop_reason"]
    assert found["vector"] == [0, 0, 0, 1, 1, 1] and found["iteration"] == [0, 1, 2] * 2
    assert found["seed"] == [1, 2, 3] * 2 and found["robots"] == [1, 1, 1, 2, 2, 2]
    assert found["half"] == [value / 2 for value in found["explored"]]
    assert found["run_id"] == [row["run_id"] for row in sorted(
        map(json.loads, (whole / "index.jsonl").read_text().splitlines()),
        key=lambda row: found["run_id"].index(row["run_id"]))]
    for run_id, digest in zip(found["run_id"], found["digest"], strict=True):
        manifest = json.loads((whole / "runs" / SMALL / run_id / "manifest.json").read_text())
        assert manifest["digest"] == digest


def test_it_does_nothing_twice(tmp_path, whole):
    shutil.copytree(whole, tmp_path / "out")
    (tmp_path / "out" / "runs.parquet").unlink()
    sweep, begun = run(tmp_path, tmp_path / "out")
    assert begun == [] and sweep.agenda.progress == (6, 0, 6)
    assert table(tmp_path / "out") == table(whole)


def test_two_at_once_in_another_order_give_the_same_table(tmp_path, whole):
    run(tmp_path, tmp_path / "out", Here(jobs=3, picked=lambda tasks: len(tasks) - 1))
    assert table(tmp_path / "out") == table(whole)


def lost_index(out):
    (out / "index.jsonl").unlink()


def cut_index(out):
    text = (out / "index.jsonl").read_bytes()
    (out / "index.jsonl").write_bytes(text[:-100])


def damaged_index(out):
    lines = (out / "index.jsonl").read_bytes().split(b"\n")
    lines[2] = b"\x00" * len(lines[2])
    (out / "index.jsonl").write_bytes(b"\n".join(lines))


def empty_index(out):
    (out / "index.jsonl").write_bytes(b"")


@pytest.mark.parametrize("damage", [lost_index, cut_index, damaged_index, empty_index])
def test_no_finished_run_is_lost_with_the_index(tmp_path, whole, damage):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    damage(out)
    sweep, begun = run(tmp_path, out)
    assert begun == [] and table(out) == table(whole)
    assert sweep.index.damaged == (damage is damaged_index)
    assert sweep.index_was_lost == (damage in (lost_index, empty_index))
    again, _ = run(tmp_path, out)
    assert not again.index.damaged and not again.index_was_lost


def test_a_folder_that_is_gone_or_damaged_is_run_again(tmp_path, whole):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    runs = sorted((out / "runs" / SMALL).iterdir())
    shutil.rmtree(runs[0])  # the index knows it
    (runs[1] / "manifest.json").write_text("{")
    lost_index(out)
    _, begun = run(tmp_path, out)
    assert sorted(begun) == [runs[0].name, runs[1].name]
    assert table(out) == table(whole)


def test_what_was_cut_off_is_not_taken_for_a_run(tmp_path, whole):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    run_id = sorted((out / "runs" / SMALL).iterdir())[0]
    run_id.rename(run_id.with_suffix(".partial"))
    _, begun = run(tmp_path, out)
    assert begun == [run_id.name] and table(out) == table(whole)
    assert not run_id.with_suffix(".partial").exists()


def test_two_processes_at_once(tmp_path):
    with swept(tmp_path, tmp_path / "out"), pytest.raises(
            InputError, match="another process is running this campaign"):
        swept(tmp_path, tmp_path / "out").__enter__()


def test_values_are_added_and_runs_taken_over(tmp_path, whole):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    more = TEXT.replace("[1, 2]", "[2, 3]")
    sweep, begun = run(tmp_path, out, text=more)
    assert len(begun) == 3 and sweep.others == 3
    assert pq.read_table(out / "runs.parquet")["robots"].to_pylist() == [2, 2, 2, 3, 3, 3]
    _, begun = run(tmp_path, out)
    assert begun == [] and table(out) == table(whole)


def test_another_campaign_is_not_laid_over_this_one(tmp_path, whole):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    other = loaded(tmp_path, TEXT)
    file = tmp_path / "design.yaml"
    file.write_text(file.read_text().replace("name: d\n", "name: e\n"))
    from desim.campaign.design.design import load_design
    from desim.campaign.design.plan import Plan

    plan = Plan(load_design(file))
    assert other.design.name == "d"
    with pytest.raises(InputError) as caught:
        Sweep(plan, Metrics(plan), out).__enter__()
    assert str(caught.value) == (f"{out}: holds the campaign 'd', the design's name is 'e'; choose "
                                 "another folder with --out")


class Failing(Here):
    """Workers for whom robots alone fail."""

    def __init__(self):
        super().__init__(work=lambda task: failure(task.run_id, "boom") if
                         task.loaded.scenario.fleet.size == 1 else work(task))


def test_a_failed_run_is_a_result_and_can_be_tried_again(tmp_path, whole):
    out = tmp_path / "out"
    sweep, begun = run(tmp_path, out, Failing())
    assert len(begun) == 6 and sweep.agenda.progress == (6, 3, 6)
    found = pq.read_table(out / "runs.parquet").to_pydict()
    assert found["status"] == ["failed"] * 3 + ["finished"] * 3
    assert found["error"] == ["boom"] * 3 + [None] * 3 and found["digest"][:3] == [None] * 3
    assert found["explored"][:3] == [None] * 3
    _, begun = run(tmp_path, out)
    assert begun == []
    sweep, begun = run(tmp_path, out, retry_failed=True)
    assert len(begun) == 3 and sweep.agenda.progress == (6, 0, 6)
    assert table(out) == table(whole)


def test_a_run_that_raises_is_a_failed_one_whatever_becomes_of_the_index(tmp_path):
    (tmp_path / "stops_of_mine.py").write_text(
        "def bad(quantities):\n    if quantities['time_s'] > 0.02:\n"
        "        raise ValueError('first\\nsecond line')\n    return False\n")
    text = TEXT + "stop: {when: 'stops_of_mine:bad'}\nmeasure: {every: 10 ms}\n"
    out = tmp_path / "out"
    sweep, _ = run(tmp_path, out, text=text)
    assert sweep.agenda.progress == (6, 6, 6)
    before = table(out)
    assert set(pq.read_table(out / "runs.parquet")["status"].to_pylist()) == {"failed"}
    lost_index(out)
    _, begun = run(tmp_path, out, text=text)
    assert begun == [] and table(out) == before


def test_results_that_cannot_be_written_end_the_campaign(tmp_path, whole):
    out, calls = tmp_path / "out", []

    def full(task):
        calls.append(task)
        if len(calls) == 3:
            return Unwritable("no space left")
        return work(task)

    with pytest.raises(Unwritable, match="no space left"):
        run(tmp_path, out, Here(work=full))
    assert pq.read_table(out / "runs.parquet").num_rows == 2
    _, begun = run(tmp_path, out)
    assert len(begun) == 4 and table(out) == table(whole)


def test_only_a_part(tmp_path, whole):
    out = tmp_path / "out"
    _, begun = run(tmp_path, out, only=("robots=2",))
    assert len(begun) == 3
    assert pq.read_table(out / "runs.parquet")["robots"].to_pylist() == [2, 2, 2]
    run(tmp_path, out)
    assert table(out) == table(whole)


def test_a_preview_writes_nothing(tmp_path, whole):
    plan = planned(tmp_path, TEXT)
    assert foreseen(plan, Metrics(plan), tmp_path / "out").progress == (0, 0, 6)
    assert not (tmp_path / "out").exists()
    assert foreseen(plan, Metrics(plan), whole).progress == (6, 0, 6)


def test_the_stored_design_repeats_the_campaign(tmp_path, whole):
    from desim.campaign.design.design import load_design
    from desim.campaign.design.plan import Plan

    plan = Plan(load_design(whole / "design.yaml"))
    with Sweep(plan, Metrics(plan), tmp_path / "again") as sweep:
        sweep.run(Here())
    assert table(tmp_path / "again") == table(whole)


def test_a_stored_design_finds_files_and_modules_where_they_were(tmp_path):
    from desim.campaign.design.design import load_design
    from desim.campaign.design.plan import Plan

    (tmp_path / "mine_again.py").write_text(
        "def one(run):\n    return 1.0\n\ndef never(quantities):\n    return False\n")
    text = TEXT + "metrics: {one: 'mine_again:one'}\nstop: {when: 'mine_again:never'}\n"
    text = text.replace("metrics: {half: explored / 2}\n", "")
    out = tmp_path / "deep" / "out"
    sweep, _ = run(tmp_path, out, text=text)
    plan = Plan(load_design(out / "design.yaml"))
    assert plan.design.metrics == {"one": "../../mine_again:one"}
    assert [run_id for _, _, run_id in foreseen(plan, Metrics(plan), out).runs] == [
        run_id for _, _, run_id in sweep.agenda.runs]
    assert pq.read_table(out / "runs.parquet")["one"].to_pylist() == [1.0] * 6


# -------------------------------------------------------- every row is checked against its folder


def no_table(folder):
    (folder / "samples.parquet").unlink()


def cut_table(folder):
    (folder / "robots.parquet").write_bytes((folder / "robots.parquet").read_bytes()[:-1])


def empty_manifest(folder):
    (folder / "manifest.json").write_text("")


def a_file(folder):
    shutil.rmtree(folder)
    folder.write_text("mine")


def another_summary(folder):
    """As large as before."""
    text = (folder / "summary.json").read_bytes()
    (folder / "summary.json").write_bytes(text.replace(b"0", b"1", 1))


def a_list(folder):
    (folder / "summary.json").write_text("[]")


def deep(folder):
    (folder / "manifest.json").write_text("[" * 100_000)


def another_run(folder):
    other = next(path for path in sorted(folder.parent.iterdir()) if path != folder)
    for name in ("manifest.json", "summary.json"):
        shutil.copy(other / name, folder / name)


def pipe(folder):
    (folder / "summary.json").unlink()
    os.mkfifo(folder / "summary.json")


@pytest.mark.parametrize("with_index", [True, False])
@pytest.mark.parametrize("damage", [no_table, cut_table, empty_manifest, a_file, another_summary,
                                    a_list, deep, another_run, pipe])
def test_damage_is_named_and_healed(tmp_path, whole, damage, with_index):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    one = sorted((out / "runs" / SMALL).iterdir())[2]
    damage(one)
    if not with_index:
        lost_index(out)
    plan = planned(tmp_path, TEXT)
    assert foreseen(plan, Metrics(plan), out).progress[0] == 5
    sweep, begun = run(tmp_path, out)
    assert begun == [one.name] and table(out) == table(whole)
    assert [*sweep.damaged_runs] == ([] if damage is a_file else [one.name])
    assert all(str(one) in text and "damaged" in text for text in sweep.damaged_runs.values())
    sweep, begun = run(tmp_path, out)
    assert begun == [] and not sweep.damaged_runs
    if damage is a_file:
        assert one.with_name(f"{one.name}.old").read_text() == "mine"


@pytest.mark.parametrize("name", [".lock", "index.jsonl", "runs", f"runs/{SMALL}"])
def test_nothing_is_written_through_links(tmp_path, whole, name):
    out, mine = tmp_path / "out", tmp_path / "mine"
    shutil.copytree(whole, out)
    (out / name).rename(mine)
    (out / name).symlink_to(mine)
    before = sorted(mine.rglob("*")) if mine.is_dir() else mine.read_bytes()
    with pytest.raises(InputError, match="link"):
        run(tmp_path, out, text=TEXT.replace("iterations: 3", "iterations: 4"))
    assert before == (sorted(mine.rglob("*")) if mine.is_dir() else mine.read_bytes())


def test_what_is_written_anew_replaces_a_link_of_its_own(tmp_path, whole):
    out, mine = tmp_path / "out", tmp_path / "mine"
    shutil.copytree(whole, out)
    mine.write_text("mine")
    for name in (".runs.parquet.new", ".design.yaml.new"):
        (out / name).symlink_to(mine)
    (out / "design.yaml").unlink()
    run(tmp_path, out)
    assert mine.read_text() == "mine" and table(out) == table(whole)


def test_a_table_is_not_written_through_a_link(tmp_path, whole):
    out, mine = tmp_path / "out", tmp_path / "mine"
    shutil.copytree(whole, out)
    (out / "runs.parquet").rename(mine)
    (out / "runs.parquet").symlink_to(mine)
    before = mine.read_bytes()
    with pytest.raises(InputError, match="runs.parquet: is a symbolic link"):
        run(tmp_path, out)
    assert mine.read_bytes() == before


def test_a_design_that_cannot_be_read_is_not_replaced(tmp_path, whole):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    (out / "design.yaml").write_text("{")
    with pytest.raises(InputError, match="if it is this one, remove the file"):
        run(tmp_path, out)


TEXTS = """parameters:
  robots: {key: fleet.size, values: [1, 2]}
  view: {levels: {near: {robot.laser.max_range: 5 m}, far: {robot.laser.max_range: 9 m}}}
vectors: all
question: hello
iterations: 1
metrics: {half: explored / 2, same: explored}
report: {metrics: [explored], against: robots}
"""


def test_text_that_is_also_the_name_of_a_file_stays_text(tmp_path):
    """Every text that stands in the design is the name of a file beside it."""
    plan = planned(tmp_path, TEXTS)
    data = plan.design.model_dump(mode="json", by_alias=True)
    for name in ("d", "hello", "all", "explored", "robots", "near", "common", "5 m", "fleet.size"):
        (tmp_path / name).write_text("")
    out = tmp_path / "out"
    run(tmp_path, out, text=TEXTS)
    stored = read_design(str(out / "design.yaml"))[0]
    assert stored.model_dump(mode="json", by_alias=True) == {**data, "base": "../small.yaml"}
    _, begun = run(tmp_path, out, text=TEXTS)
    assert begun == []


PATHS = """parameters:
  map: {key: environment.terrain, values: [maze, plan.yaml]}
  start: {levels: {a: {fleet.start.file: here.csv}, b: {fleet.start: {file: there.csv}}}}
  when: {values: ['stops_of_mine:one']}
  net: {key: network.media.lan, values: [{model: replay, file: net.csv}]}
vectors: [{map: plan.yaml, start: a, when: 'stops_of_mine:one', net: {model: replay, file: x.csv}}]
set: {network.media.lan.rules: [{rule: 'rules_of_mine:Rule'}], coordination.strategy: maze}
stop: {when: $when}
metrics: {own: 'stops_of_mine:one', maze: explored}
report: {metrics: [explored]}
"""


def test_what_the_scenario_takes_for_a_path_is_one(tmp_path):
    for name in ("maze", "plan.yaml", "here.csv", "there.csv", "net.csv", "x.csv", "explored",
                 "stops_of_mine.py", "rules_of_mine.py"):
        (tmp_path / name).write_text("")
    from desim.campaign.folder.design_copy import store

    design = loaded(tmp_path, PATHS)
    (tmp_path / "out").mkdir()
    store(design, tmp_path / "out")
    stored = read_design(str(tmp_path / "out" / "design.yaml"))[0].model_dump(by_alias=True)
    own = stored["parameters"]
    assert own["map"]["values"] == ("maze", "../plan.yaml")
    assert own["start"]["levels"] == {"a": {"fleet.start.file": "../here.csv"},
                                      "b": {"fleet.start": {"file": "../there.csv"}}}
    assert own["when"]["values"] == ("../stops_of_mine:one",)
    assert own["net"]["values"] == ({"model": "replay", "file": "../net.csv"},)
    assert stored["vectors"] == ({"map": "../plan.yaml", "start": "a",
                                  "when": "../stops_of_mine:one",
                                  "net": {"model": "replay", "file": "../x.csv"}},)
    assert stored["set"]["network.media.lan.rules"] == [{"rule": "../rules_of_mine:Rule"}]
    assert stored["metrics"] == {"own": "../stops_of_mine:one", "maze": "explored"}
