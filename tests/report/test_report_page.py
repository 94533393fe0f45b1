"""The text of the page, which needs nothing but itself."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from scipy import stats
from synthetic import LIMIT_S, campaign, design, timed
from synthetic import write as table

from desim.campaign.design.design import Design
from desim.errors import InputError
from desim.report.campaign import formatting
from desim.report.campaign.campaign_report import write
from desim.report.campaign.tables import overview
from desim.statistics.intervals import bca_interval, t_interval
from desim.statistics.sensitivity import indices, saltelli

pytestmark = pytest.mark.usefixtures("svg_alone")

RATES = ["1 Mb/s", "3 Mb/s", "10 Mb/s", "30 Mb/s", "100 Mb/s", "300 Mb/s"]
BY = {"rate": RATES, "strategy": ["near", "far"]}
_VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """Refuses tags that are not closed as they were opened, and headings below the third level;
    collects anchors and references."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.ids, self.references, self.words = [], [], [], []
        self.feed(text)
        self.close()
        assert not self.open
        self.text = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag, attrs):
        assert tag not in ("h4", "h5", "h6")
        if tag not in _VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "src", "xlink:href", "data", "action"):
                self.references.append(value)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in _VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


def made(folder, chosen: Design) -> Page:
    return Page(write(folder, chosen).read_text())


def bent(levels, iteration):
    """Slow below 10 Mb/s, and the far strategy 20 s later, but for the luck of a seed."""
    decades = np.log10(float(levels["rate"].split()[0]))
    noise_s = np.random.default_rng(iteration).normal(0.0, 5.0)
    own = np.random.default_rng([iteration, int(100 * decades), len(levels["strategy"])])
    time_s = 200.0 + 300.0 * max(0.0, 1.0 - decades) + noise_s + own.normal(0.0, 1.0)
    return timed(time_s + 20.0 * (levels["strategy"] == "far"), collisions=iteration)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = campaign(tmp_path_factory.mktemp("whole"), BY, 6, bent)
    chosen = design(BY, iterations=6, report={"metrics": ["exploration_time_s", "collisions"],
                                              "against": "rate", "by": "strategy"})
    return folder, made(folder, chosen)


def test_the_page_refers_to_nothing_outside_of_its_folder(whole):
    folder, page = whole
    text = (folder / "report" / "report.html").read_text()
    assert not re.search(r"https?:|url\((?!#)|@import|<link[^>]+stylesheet|<script src", text)
    for reference in page.references:
        if reference.startswith("#"):
            assert reference[1:] in page.ids
        elif reference != "data:,":
            assert (folder / "report" / reference).is_file()


def test_no_id_stands_twice(whole):
    ids = whole[1].ids
    assert len(ids) == len(set(ids))


def test_the_page_says_the_question_and_the_counts(whole):
    text = whole[1].text
    assert "Does <it> pay off & when?" in text
    assert "72 runs: 12 vectors with 6 seeds each. All reached the aim." in text


def test_means_and_intervals_are_those_of_the_runs(whole):
    folder, page = whole
    levels = {"rate": "1 Mb/s", "strategy": "near"}
    times = [bent(levels, k)["exploration_time_s"] for k in range(6)]
    low, high = stats.t.interval(0.95, 5, np.mean(times), stats.sem(times))
    assert f"{np.mean(times):.1f} [{low:.1f}, {high:.1f}] 6" in page.text
    lines = (folder / "report" / "tables" / "exploration_time_s.csv").read_text().splitlines()
    found = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert [float(found[name]) for name in ("mean", "low", "high")] == pytest.approx(
        [np.mean(times), low, high])
    assert float(found["rate [b/s]"]) == 1e6


def test_the_knee_is_named_for_each_line(whole):
    """At a glance, in the metric's section, and for programs."""
    folder, page = whole
    assert len(re.findall(r"≥? ?5\d\d \(n = 6\) → 2\d\d \(n = 6\) knee ", page.text)) == 2
    found = re.findall(r"strategy = near: knee of exploration time \[s\] at rate ([\d.]+) Mb/s "
                       r"\(95 % interval ([\d.]+) to ([\d.]+) Mb/s\)", page.text)
    at, low, high = map(float, found[0])
    assert low <= 10.0 <= high
    assert at == pytest.approx(10.0, rel=0.1)
    lines = (folder / "report" / "tables" / "knees.csv").read_text().splitlines()
    row = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert float(row["at"]) == pytest.approx(1e6 * at, rel=0.01)


def test_a_line_that_starves_to_the_end_has_two_knees(tmp_path):
    """Some runs failed: the other seeds still show what they have in common."""
    rates = {"rate": ["100 kb/s", "300 kb/s", *RATES]}

    def outcome(levels, k):
        if k == 3 and levels["rate"] == "3 Mb/s":
            return {"error": "broke"}
        kbps = float(levels["rate"].split()[0]) * (1 if "k" in levels["rate"] else 1000)
        own = np.random.default_rng([k, int(kbps)]).normal()
        return timed(200.0 + 50.0 * k + own + 500.0 * np.clip(np.log10(30e3 / kbps), 0.0, 1.5))

    page = made(campaign(tmp_path, rates, 6, outcome), design(rates, iterations=6))
    found = re.search(r"Knees of exploration time \[s\] at rate ([\d.]+) (k|M)b/s .* and "
                      r"([\d.]+) Mb/s \(95 % interval ([\d.]+) to ([\d.]+) Mb/s\)", page.text)
    low, high = float(found[4]), float(found[5])
    assert low <= 30.0 <= high < 1.4 * low
    assert "What a seed adds at all values of the axis alike" in page.text


def test_strategies_are_compared_run_by_run_and_corrected(whole):
    folder, _ = whole
    lines = (folder / "report" / "tables" / "exploration_time_s_comparisons.csv") \
        .read_text().splitlines()
    head, rows = lines[0].split(","), [line.split(",") for line in lines[1:]]
    assert len(rows) == len(RATES)
    raw = []
    for rate in RATES:
        near, far = ([bent({"rate": rate, "strategy": which}, k)["exploration_time_s"]
                      for k in range(6)] for which in ("near", "far"))
        raw.append(stats.ttest_rel(near, far).pvalue)
    assert [float(row[head.index("p")]) for row in rows] == pytest.approx(raw)
    smallest = min(range(len(raw)), key=raw.__getitem__)
    assert float(rows[smallest][head.index("p_holm")]) == pytest.approx(
        min(1.0, len(raw) * raw[smallest]))


def test_methods_name_seeds_levels_and_statistics(whole):
    text = whole[1].text
    assert "rate (fleet.rate): 1 Mb/s, 3 Mb/s, 10 Mb/s, 30 Mb/s, 100 Mb/s, 300 Mb/s" in text
    assert "seeds 1 to 6" in text
    assert "Student's t" in text
    assert "Holm" in text


def test_each_figure_has_three_files(whole):
    folder, page = whole
    for name in ("exploration_time_s", "collisions"):
        assert f"figure-{name}" in page.ids
        begins = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
        for ending, begin in begins.items():
            file = folder / "report" / "figures" / f"{name}.{ending}"
            assert file.read_bytes().startswith(begin)


def test_the_same_runs_give_the_same_page(whole, tmp_path):
    folder, _ = whole
    chosen = design(BY, iterations=6, report={"metrics": ["exploration_time_s", "collisions"],
                                              "against": "rate", "by": "strategy"})
    again = write(folder, chosen, tmp_path / "again")
    assert again.read_bytes() == (folder / "report" / "report.html").read_bytes()


def starving(levels, iteration):
    """At one robot nobody gets there in time, at two half of them."""
    if levels["robots"] == 1 or (levels["robots"] == 2 and iteration % 2):
        return timed(None)
    return timed(100.0 + iteration)


def test_censored_runs_do_not_make_starvation_seem_good(tmp_path):
    robots = {"robots": [1, 2, 4]}
    page = made(campaign(tmp_path, robots, 4, starving), design(robots, iterations=4))
    rows = [line.split(",") for line in (tmp_path / "report" / "tables" / "exploration_time_s.csv")
            .read_text().splitlines()]
    by_name = [dict(zip(rows[0], row, strict=True)) for row in rows[1:]]
    assert [float(row["mean"]) for row in by_name] == [LIMIT_S, (101 + 99 + 2000) / 4 + 0.5, 101.5]
    assert [row["successes_mean"] for row in by_name] == ["", "101.0", "101.5"]
    assert [int(row["reached"]) for row in by_name] == [0, 2, 4]
    assert "6 of 12 runs ended at the time limit." in page.text
    assert "No run reached the aim in 1 of 3 vectors: robots = 1." in page.text


def test_failed_runs_are_counted_and_left_out(tmp_path):
    robots = {"robots": [1, 2]}

    def outcome(levels, iteration):
        return {"error": "the <model> broke"} if iteration == 0 else timed(100.0 * iteration)

    page = made(campaign(tmp_path, robots, 4, outcome), design(robots, iterations=4))
    assert "2 of 8 runs failed." in page.text
    assert "2 × the <model> broke" in page.text
    assert "2 of 8 runs failed: the <model> broke." in page.text
    assert "reached the aim." not in page.text  # nothing of those that failed
    assert "200 [0, 448.4] 3" in page.text


def test_failing_is_not_missing_the_aim(tmp_path):
    robots = {"robots": [1, 2, 3]}

    def outcome(levels, iteration):
        if levels["robots"] == 3:
            return {"error": "no room" if iteration else "no link (robot_2, 2.35 s)"}
        return timed(None if levels["robots"] == 2 else 100.0 + iteration)

    page = made(campaign(tmp_path, robots, 4, outcome), design(robots, iterations=4))
    assert "4 of 12 runs failed, for 2 causes; the most frequent one, of 3: no room." in page.text
    assert "All runs failed in 1 of 3 vectors: robots = 3." in page.text
    assert "No run that finished reached the aim in 1 of 3 vectors: robots = 2." in page.text


def patrolling(k: int) -> dict[str, object]:
    return {"simulated_s": LIMIT_S, "idleness_mean_s": 40.0 + k}


def test_patrolling_has_no_aim_that_runs_could_miss(tmp_path):
    robots = {"robots": [1, 2]}

    def outcome(levels, iteration):
        return {"error": "no room"} if iteration == levels["robots"] == 1 else patrolling(iteration)

    page = made(campaign(tmp_path, robots, 4, outcome),
                design(robots, iterations=4, report={"metrics": ["idleness_mean_s"]}))
    assert "8 runs ended, of which 7 finished and 1 failed; failed runs are left out" in page.text
    assert "The larger a symbol, the more runs finished; hollow: none did." in page.text
    assert "3 runs finished" in page.text and "4 runs finished" in page.text  # of the symbols
    assert re.search(r"\baim|censored", page.text) is None
    table = (tmp_path / "report" / "tables" / "idleness_mean_s.csv").read_text()
    assert table.splitlines()[1].startswith("0,1,4,3,1,")
    assert table.startswith("vector,robots,runs,finished,failed,")


def test_runs_with_an_aim_beside_runs_without(tmp_path):
    tasks = {"task": ["exploration", "patrolling"]}
    page = made(campaign(tmp_path, tasks, 3, lambda levels, k: patrolling(k)
                         if levels["task"] == "patrolling" else timed(100.0 if k else None)),
                design(tasks, iterations=3))
    assert ("6 runs ended, of which 5 reached the aim or had none, 1 were stopped before it and 0 "
            "failed;") in page.text


def test_one_vector_without_parameters(tmp_path):
    page = made(campaign(tmp_path, {}, 5, lambda levels, k: timed(100.0 + k)),
                design({}, iterations=5))
    assert "5 runs: 1 vector with 5 seeds." in page.text
    assert "figure-exploration_time_s" in page.ids


def test_one_iteration_says_that_there_are_no_intervals(tmp_path):
    robots = {"robots": [1, 2, 4, 8, 16]}
    page = made(campaign(tmp_path, robots, 1, lambda levels, k: timed(100.0 / levels["robots"])),
                design(robots, iterations=1))
    assert "One run a vector: there are no intervals" in page.text


def test_no_finished_run(tmp_path):
    robots = {"robots": [1, 2]}
    nothing = dict.fromkeys(("simulated_s", "censored", "exploration_time_s", "explored"))
    page = made(campaign(tmp_path, robots, 2, lambda levels, k: {"error": "no room", **nothing}),
                design(robots, iterations=2))
    assert "4 of 4 runs failed." in page.text
    assert "4 × no room" in page.text
    assert "All 4 runs failed: no room." in page.text
    assert "reached the aim." not in page.text


def test_a_word_as_the_axis_compares_all_of_its_levels(tmp_path):
    doors = {"doors": ["none", "half", "closed"]}

    def outcome(levels, k):
        level = doors["doors"].index(levels["doors"])
        return timed(100.0 + 50.0 * level + (k * 7) % 5 + (k * (level + 2)) % 3)

    page = made(campaign(tmp_path, doors, 8, outcome), design(doors, iterations=8))
    assert "3 of 3 comparisons significant" in page.text
    assert "nee of" not in page.text


def test_further_parameters_become_panels(tmp_path):
    three = {"robots": [1, 2, 4], "strategy": ["near", "far"], "terrain": ["maze", "loop"]}
    page = made(campaign(tmp_path, three, 2, lambda levels, k: timed(100.0 / levels["robots"] + k)),
                design(three, iterations=2))
    assert "Panels are the levels of terrain." in page.text
    assert "terrain = maze" in page.text


def test_kinds_that_belong_together_say_which_saturates_first(tmp_path):
    rates = {"rate": RATES}

    def outcome(levels, k):
        decades = np.log10(float(levels["rate"].split()[0]))
        return timed(100.0 + k, a_delivered=min(1.0, 0.5 * decades), messages_delivered=7,
                     b_delivered=min(1.0, 0.2 + decades))

    page = made(campaign(tmp_path, rates, 2, outcome), design(
        rates, iterations=2, metrics={"a_delivered": "x / y", "b_delivered": "x / y"},
        report={"metrics": ["*_delivered"]}))
    assert "a (at 30 Mb/s) falls first, then b (at 3 Mb/s)." in page.text
    assert "messages delivered" not in page.text.split("Metrics by vector")[1].split("mean ±")[0]


def test_stopping_by_width_shows_the_measured_coverage(tmp_path):
    robots = {"robots": [1, 2]}
    page = made(campaign(tmp_path, robots, 6, lambda levels, k: timed(100.0 + 9.0 * (k % 3))),
                design(robots, iterations={"metric": "exploration_time_s", "width": "10 %",
                                           "at_least": 3, "at_most": 20}))
    share = float(re.search(r"by simulation ([\d.]+)% to", page.text)[1])
    assert 80.0 < share < 96.0
    rows = [line.split(",") for line in (tmp_path / "report" / "tables" / "exploration_time_s.csv")
            .read_text().splitlines()]
    assert 100 * float(rows[1][rows[0].index("coverage")]) == pytest.approx(share, abs=0.06)


def test_many_runs_say_how_their_interval_is_computed(tmp_path):
    """Widened, where a bootstrap is; t, where stopping by the width of t ended the runs."""
    robots = {"robots": [1, 2]}
    campaign(tmp_path, robots, 30, lambda levels, k: timed(100.0 + k, collisions=k % 7))
    report = {"metrics": ["collisions"]}
    page = made(tmp_path, design(robots, iterations=30, report=report))
    assert "(Hesterberg 2015; 96.2 % for 30 runs)" in page.text
    assert formatting.between(*bca_interval([k % 7 for k in range(30)])[1:3]) in page.text
    page = made(tmp_path, design(robots, report=report, iterations={
        "metric": "collisions", "width": 1.0, "at_least": 5, "at_most": 30}))
    assert "bootstrap" not in page.text
    shown = formatting.between(*t_interval([k % 7 for k in range(30)])[1:3])
    assert f"{shown} 30 9" in page.text  # and its measured coverage


def test_a_parameter_with_levels_says_what_it_sets(tmp_path):
    chosen = Design.model_validate({
        "name": "x", "base": "x.yaml", "iterations": 1, "parameters": {
            "rate": {"values": [1, 2]},
            "place": {"levels": {"in": {"network.rate": "$rate"},
                                 "out": {"deployment": "field"}}}}})
    levels = {"rate": [1, 2], "place": ["in", "out"]}
    page = made(campaign(tmp_path, levels, 1, lambda levels, k: timed(1.0)), chosen)
    assert "rate $rate in place 2" in page.text
    assert "place network.rate, deployment 2" in page.text


def test_what_was_dropped_in_every_run_is_counted(tmp_path):
    """A column without a gap is Arrow's own memory."""
    robots = {"robots": [1, 2]}
    page = made(campaign(tmp_path, robots, 2, lambda levels, k: timed(
        100.0, messages_dropped_collision=float(k))), design(robots, iterations=2))
    assert "messages dropped collision" in page.text


def test_a_report_that_goes_wrong_leaves_what_was_there(tmp_path, monkeypatch):
    folder = tmp_path / "campaign"
    folder.mkdir()
    campaign(folder, {}, 2, lambda levels, k: timed(1.0 + k))
    before = write(folder, design({}, iterations=2)).read_bytes()

    def broken(*_):
        raise ValueError("boom")

    monkeypatch.setattr(overview, "all_metrics", broken)  # figures and tables are written by then
    for out in (folder / "report", tmp_path / "new"):
        with pytest.raises(ValueError, match="boom"):
            write(folder, design({}, iterations=2), out)
    assert (folder / "report" / "report.html").read_bytes() == before
    assert sorted(path.name for path in folder.iterdir()) == ["report", "runs.parquet"]
    assert sorted(path.name for path in (folder / "report").iterdir()) == [
        "figures", "report.html", "tables"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["campaign"]


def test_a_folder_without_runs_is_refused(tmp_path):
    with pytest.raises(InputError, match="not a campaign's folder"):
        write(tmp_path, design({}))


def test_a_table_of_another_design_is_refused(tmp_path):
    campaign(tmp_path, {"robots": [1]}, 1, lambda levels, k: timed(1.0))
    with pytest.raises(InputError, match="no parameter 'speed'"):
        write(tmp_path, design({"speed": [1]}))


def test_a_saltelli_design_shows_its_indices(tmp_path):
    parameters = {"a": 1, "b": 1}
    points = saltelli(64, 2)
    rows = [{"run_id": f"{i:012d}", "vector": i, "iteration": 0, "seed": 1, "status": "finished",
             "error": None, "digest": None, "a": float(a), "b": float(b),
             **timed(300.0 + 400.0 * a + 10.0 * b)} for i, (a, b) in enumerate(points)]
    table(tmp_path, parameters, rows)
    spans = {name: {"key": f"fleet.{name}", "from": 0.0, "to": 1.0} for name in parameters}
    page = made(tmp_path, Design.model_validate({
        "name": "x", "base": "x.yaml", "parameters": spans, "vectors": {"saltelli": 64},
        "iterations": 1}))
    first, second = indices([row["exploration_time_s"] for row in rows], 2)
    assert f"a {first.total:.2g} [{first.total_low:.4g}, " in page.text
    lines = (tmp_path / "report" / "tables" / "exploration_time_s_sobol.csv").read_text()
    assert float(lines.splitlines()[2].split(",")[1]) == pytest.approx(second.first)
    assert "figure-exploration_time_s_sobol" in page.ids
    assert "a (fleet.a): between 0.0 and 1.0; b" in page.text  # not as far as they were drawn


def test_samples_name_the_range_of_the_design_and_a_shared_run_once(tmp_path):
    """Three vectors with two runs: two of them coincide."""
    rows = [{"run_id": run_id, "vector": i, "iteration": 0, "seed": 1, "status": "finished",
             "error": None, "digest": None, "noise": f"{noise} mm", "kind": kind,
             **timed(None if kind == 2 else 100.0 + i)}
            for i, (run_id, noise, kind) in enumerate([("a", 3.5, 1), ("b", 40, 2), ("a", 3.5, 1)])]
    table(tmp_path, {"noise": 1, "kind": 1}, rows)
    page = made(tmp_path, Design.model_validate({
        "name": "x", "base": "x.yaml", "vectors": {"latin_hypercube": 3}, "iterations": 1,
        "parameters": {"noise": {"key": "a.noise", "from": "1 mm", "to": "100 mm", "scale": "log"},
                       "kind": {"key": "a.kind", "values": [1, 2]}}}))
    assert "noise (a.noise): between 1 mm and 100 mm, evenly in the logarithm; kind (a.kind): 1, " \
           "2." in page.text
    assert "No run reached the aim in 1 of 3 vectors: noise = 40 mm, kind = 2." in page.text
    assert "2 runs: 3 vectors with 1 seed each. 1 of 2 runs ended at the time limit." in page.text
    assert "2 runs ended (vectors with the same values share theirs), of which 1 reached" \
        in page.text


def test_knees_say_which_panel_they_are_of(tmp_path):
    """Of more lines than the table has columns each has a row."""
    three = {"rate": RATES, "strategy": ["near", "far", "wide"], "terrain": ["maze", "loop"]}
    page = made(campaign(tmp_path, three, 4, bent), design(three, iterations=4))
    glance = page.text.split("In short")[2].partition("What was run")[0]
    for place in ("terrain = maze, strategy = near", "terrain = loop, strategy = wide"):
        assert f"exploration time [s] {place} " in glance
        assert f"{place}: knee of exploration time [s] at rate " in page.text
