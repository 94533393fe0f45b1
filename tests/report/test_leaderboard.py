"""The leaderboard: entries of campaigns of reference designs in a Markdown page."""

import json
import re

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import campaign, design, timed
from typer.testing import CliRunner

import desim
from desim.campaign.design.design import load_design, read_design
from desim.campaign.design.plan import Plan
from desim.campaign.design.reference import ReferenceDesign
from desim.campaign.folder.table import REFERENCE
from desim.cli import app
from desim.errors import InputError
from desim.report.campaign.numbers import Study
from desim.report.leaderboard import page as leaderboard
from desim.report.leaderboard.entries import LeaderboardEntry, MedianTime
from desim.report.leaderboard.page import enter

PARAMETERS = {"strategy": ["near", "far"], "robots": [2, 10]}
# Strategy and robots to the times of three runs; None: the run was stopped at 1000 s.
TIMES = {("near", 2): (100, 200, 300), ("far", 2): (150, 400, 500),
         ("near", 10): (10, 20, 30), ("far", 10): (None, 40, None)}


def study(folder, times=None, version=1, name="made_up", desim="0.1.0 abc", question="Who?",
          fixed=None):
    """A campaign of a reference design, by the times of its runs."""
    folder.mkdir(exist_ok=True)
    times = times or TIMES

    def outcome(levels, iteration):
        time_s = times.get((levels["strategy"], levels["robots"]), ["broken"] * 3)[iteration]
        if time_s == "broken":
            return {"error": "boom"}
        return timed(time_s, exploration_cost_m=1234.5 + iteration, map_quality=0.99,
                     bytes_on_air=2_500_000)

    parameters = {key: list(dict.fromkeys(place[at] for place in times))
                  for at, key in enumerate(PARAMETERS)}
    campaign(folder, parameters, len(next(iter(times.values()))), outcome)
    table = pq.read_table(folder / "runs.parquet")
    table = table.append_column("desim", pa.array([desim] * table.num_rows))
    reference = ReferenceDesign(name, version, {"strategy": ["strategy"], "robots": ["robots"]},
                                fixed or {"terrain": "maze", "network": "field: air"})
    pq.write_table(table.replace_schema_metadata({REFERENCE: json.dumps(reference._asdict())}),
                   folder / "runs.parquet")
    return Study(folder, design(parameters, question=question, name=name,
                                reference={"version": version}))


BLOCK = """\
<!-- leaderboard: made_up, version 1; desim report --leaderboard writes this block -->
## made_up, version 1

Who?

The fastest:

| network | robots | maze |
|---|---|---|
| field: air | 2 | near 200.0 s (+1) |
| field: air | 10 | near 20.0 s (+1) |

All:

| terrain | network | robots | strategy | time, s | runs | late | failed | way, m | map quality | sent, MB | desim |
|---|---|---|---|---|---|---|---|---|---|---|---|
| maze | field: air | 2 | near | 200.0 (100.0 to –) | 3 | 0 | 0 | 1 236 | 0.99 | 2.5 | 0.1.0 abc |
| maze | field: air | 2 | far | 400.0 (150.0 to –) | 3 | 0 | 0 | 1 236 | 0.99 | 2.5 | 0.1.0 abc |
| maze | field: air | 10 | near | 20.0 (10.0 to –) | 3 | 0 | 0 | 1 236 | 0.99 | 2.5 | 0.1.0 abc |
| maze | field: air | 10 | far | > 1000.0 (40.0 to –) | 3 | 2 | 0 | 1 236 | 0.99 | 2.5 | 0.1.0 abc |
<!-- end of leaderboard -->
"""  # noqa: E501


def test_a_new_page(tmp_path):
    page = tmp_path / "board.md"
    assert enter(study(tmp_path / "c"), page) == "4 entries of made_up, version 1"
    assert page.read_text() == f"# Leaderboard\n\n{BLOCK}"


def test_a_question_is_text(tmp_path):
    page = tmp_path / "board.md"
    found = study(tmp_path / "c", question="<!-- end of leaderboard --> <script>evil()</script>")
    for _ in range(2):
        enter(found, page)
    text = page.read_text()
    assert "&lt;script>evil()" in text and "<script" not in text
    assert text.count("<!-- end of leaderboard -->") == 1


def test_entering_again_changes_nothing(tmp_path):
    page, found = tmp_path / "board.md", study(tmp_path / "c")
    enter(found, page)
    before = page.read_bytes()
    enter(found, page)
    assert page.read_bytes() == before


def test_what_is_around_the_block_stays(tmp_path):
    page = tmp_path / "board.md"
    around = "# Mine\n\nSome words.  \n\n\n| a | b |\n|---|---|\n"
    page.write_text(f"{around}{BLOCK.replace('near 200.0 s', 'nobody')}\n\nThe end")
    enter(study(tmp_path / "c"), page)
    assert page.read_text() == f"{around}{BLOCK}\n\nThe end"


def test_versions_are_not_mixed(tmp_path):
    page = tmp_path / "board.md"
    enter(study(tmp_path / "c"), page)
    slow = dict.fromkeys(TIMES, (900, 901, 902))
    enter(study(tmp_path / "d", slow, version=2), page)
    enter(study(tmp_path / "e", slow, name="made_up_too"), page)
    first, second, third = (page.read_text().find(f"## {title}") for title in (
        "made_up, version 2", "made_up, version 1", "made_up_too, version 1"))
    assert 0 < first < second < third
    assert f"\n\n{BLOCK}\n<!--" in page.read_text()  # as it was
    assert page.read_text().count("901.0") == 2 * (4 + 2)


def test_one_block_for_two_versions_would_be_noticed(tmp_path, monkeypatch):
    """The twin: blocks are told apart by their name alone."""
    page = tmp_path / "board.md"
    enter(study(tmp_path / "c"), page)
    blocks = leaderboard._blocks
    monkeypatch.setattr(leaderboard, "_blocks", lambda *of: [
        block._replace(version=2) for block in blocks(*of)])
    enter(study(tmp_path / "d", version=2), page)
    assert BLOCK not in page.read_text()


def test_another_campaign_adds_and_replaces_entries(tmp_path):
    page = tmp_path / "board.md"
    enter(study(tmp_path / "c"), page)
    enter(study(tmp_path / "d", {("best", 2): range(50, 58), ("far", 2): range(8, 16)},
                desim="0.2.0 def"), page)
    rows = [line for line in page.read_text().splitlines() if line.startswith("| maze | field")]
    assert [(row.split(" | ")[3], row.split(" | ")[-1]) for row in rows] == [
        ("far", "0.2.0 def |"), ("best", "0.2.0 def |"), ("near", "0.1.0 abc |"),
        ("near", "0.1.0 abc |"), ("far", "0.1.0 abc |")]
    assert "| field: air | 2 | far 11.5 s |" in page.read_text()  # nobody's interval overlaps


def test_failed_runs_and_places_that_nobody_explores(tmp_path):
    page = tmp_path / "board.md"
    enter(study(tmp_path / "c", {("near", 2): ("broken", 100, 200), ("far", 2): ("broken",) * 3,
                                 ("near", 4): (None, None, None)}), page)
    text = page.read_text()
    assert "| 2 | near | 150.0 (100.0 to –) | 3 | 0 | 1 | 1 236 |" in text
    assert "| 2 | far | – | 3 | 0 | 3 | – | – | – |" in text
    assert "| 4 | near | > 1000.0 | 3 | 3 | 0 |" in text
    assert "| field: air | 4 | none |" in text


TEXT = st.text(st.characters(exclude_categories=("C", "Z"), include_characters=" "), min_size=1,
               max_size=9).map(lambda text: " ".join(text.split()) or "x")


@given(st.lists(st.builds(LeaderboardEntry, *[TEXT] * len(LeaderboardEntry._fields)), max_size=4))
def test_entries_are_read_as_they_were_written(found):
    text = leaderboard._written(ReferenceDesign("d", 1, {}, {}), "", found)
    block, = leaderboard._blocks("page", text)
    assert list(leaderboard._known("page", text, block)) == found


@pytest.mark.parametrize("text, times", [
    ("96.4 (95.2 to 98.0)", (96.4, 95.2, 98.0)), ("96.4 (95.2 to –)", (96.4, 95.2, float("inf"))),
    ("96.4", (96.4, 0.0, float("inf"))), ("> 2000.0", (float("inf"), 0.0, float("inf"))),
    ("> 2000.0 (40.0 to –)", (float("inf"), 40.0, float("inf"))),
    ("–", (float("inf"), 0.0, float("inf")))])
def test_times_as_numbers(text, times):
    entry = LeaderboardEntry(*"abcd", text, *"efghijk")
    assert entry.times == MedianTime(*times)


def complaint(*arguments):
    outcome = CliRunner().invoke(app, ["report", *map(str, arguments)])
    assert outcome.exit_code == 2
    return outcome.output


@pytest.mark.parametrize("change, expected", [
    (lambda text: text.replace("<!-- end of leaderboard -->", ""),
     "{page}:3: the block that begins here has no end, <!-- end of leaderboard -->"),
    (lambda text: text + "\n" + text.partition("<!-- end")[0],
     "{page}:27: the block that begins here has no end, <!-- end of leaderboard -->"),
    (lambda text: text.replace("| runs | late |", "| runs |"),
     "{page}:3: the block that begins here has other columns; take it out, and enter its campaigns "
     "again"),
    (lambda text: text.replace("| far | 400.0 (150.0 to –) |", "| far |"),
     "{page}:20: 11 cells, but 12 columns"),
])
def test_pages_that_were_changed_by_hand(tmp_path, change, expected):
    page, found = tmp_path / "board.md", study(tmp_path / "c")
    enter(found, page)
    page.write_text(change(page.read_text()))
    before = page.read_bytes()
    with pytest.raises(InputError) as caught:
        enter(found, page)
    assert str(caught.value) == expected.format(page=page)
    assert page.read_bytes() == before


def test_campaigns_and_pages_that_cannot_be(tmp_path):
    made = study(tmp_path / "c")
    table = pq.read_table(tmp_path / "c" / "runs.parquet")
    pq.write_table(table.replace_schema_metadata({}), tmp_path / "c" / "runs.parquet")
    with pytest.raises(InputError, match=(
            "c: not the runs of a reference design; the design of such runs has the key reference, "
            r"which desim sweep notes in runs\.parquet$")):
        enter(Study(made.folder, made.design), tmp_path / "board.md")
    for number, (of, by, said) in enumerate((
            ({"version": 2}, made.design, "made_up, version 2; the design is made_up, version 1"),
            ({"name": "a"}, made.design, "a, version 1; the design is made_up, version 1"),
            ({}, design(PARAMETERS), "made_up, version 1; the design is made_up, version none"))):
        other = study(tmp_path / str(number), **of)
        with pytest.raises(InputError, match=f"{number}: the runs are of {said}$"):
            enter(Study(other.folder, by), tmp_path / "board.md")
    (tmp_path / "binary.md").write_bytes(b"\xff")
    with pytest.raises(InputError, match=r"^--leaderboard: .*binary\.md cannot be read: "):
        enter(made, tmp_path / "binary.md")
    with pytest.raises(InputError, match=r"^--leaderboard: .*gone.* cannot be written: "):
        enter(made, tmp_path / "gone" / "board.md")
    broken = study(tmp_path / "d", {("near", 2): ("broken",) * 3})
    with pytest.raises(InputError, match="d: none of its runs has finished$"):
        enter(broken, tmp_path / "board.md")
    assert not (tmp_path / "board.md").exists()


# ------------------------------------------------------------------------------------ the whole way

HELLO = """\
name: tiny
question: Which strategy explores the house of hello.yaml first?
reference: {{version: 1}}
base: {base}
parameters:
  strategy: {{key: coordination.strategy, values: [random_frontier, nearest_frontier]}}
  network: {{levels: {{lan: {{network.media.lan: {{model: switch}}}}}}}}
iterations: 3
stop: {{elapsed: 60 s}}
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory, repository):
    """The folder of a campaign that was really run."""
    folder = tmp_path_factory.mktemp("tiny")
    (folder / "design.yaml").write_text(HELLO.format(base=repository / "scenarios" / "hello.yaml"))
    outcome = CliRunner().invoke(app, ["sweep", str(folder / "design.yaml"), "--jobs", "1",
                                       "--quiet", "--out", str(folder / "c")])
    assert outcome.exit_code == 0, outcome.output
    return folder / "c"


def test_from_a_design_to_the_page(swept, tmp_path):
    page = tmp_path / "board.md"
    outcome = CliRunner().invoke(app, ["report", str(swept), "--leaderboard", str(page)])
    assert outcome.output == f"leaderboard: {page}: 2 entries of tiny, version 1\n"
    assert not (swept / "report").exists()

    runs = pq.read_table(swept / "runs.parquet").to_pylist()
    times = {name: sorted(run["exploration_time_s"] for run in runs if run["strategy"] == name)
             for name in ("random_frontier", "nearest_frontier")}
    first, second = sorted(times, key=lambda name: times[name][1])

    def row(name):
        mine = [run for run in runs if run["strategy"] == name]
        way, quality, sent = (sum(run[metric] for run in mine) / 3 for metric in (
            "exploration_cost_m", "map_quality", "bytes_on_air"))
        source, = {json.loads(path.read_text())["source"]
                   for run in mine for path in swept.glob(f"runs/*/{run['run_id']}/manifest.json")}
        assert 10 <= way < 100 and 0.9 < quality < 1 and 1e6 <= sent < 1e7
        low, median, _ = times[name]
        return (f"| hello | lan | 3 | {name} | {median:.1f} ({low:.1f} to –) | 3 | 0 | 0 | "
                f"{_shown(way, 2)} | {_shown(quality, 4)} | {_shown(sent / 1e6, 2)} | "
                f"{desim.__version__} {source} |")

    assert page.read_text() == f"""\
# Leaderboard

<!-- leaderboard: tiny, version 1; desim report --leaderboard writes this block -->
## tiny, version 1

Which strategy explores the house of hello.yaml first?

The fastest:

| network | robots | hello |
|---|---|---|
| lan | 3 | {first} {times[first][1]:.1f} s (+1) |

All:

| terrain | network | robots | strategy | time, s | runs | late | failed | way, m | map quality | sent, MB | desim |
|---|---|---|---|---|---|---|---|---|---|---|---|
{row(first)}
{row(second)}
<!-- end of leaderboard -->
"""  # noqa: E501


def _shown(value, decimals):
    return f"{value:.{decimals}f}".rstrip("0")


def test_a_table_alone_with_its_design(swept, tmp_path):
    """As studies leave it in docs/studies/."""
    folder = tmp_path / "alone"
    folder.mkdir()
    (folder / "runs.parquet").write_bytes((swept / "runs.parquet").read_bytes())
    for campaign_folder, more in ((swept, []), (folder, ["--design", swept / "design.yaml"])):
        outcome = CliRunner().invoke(app, [
            "report", str(campaign_folder), *map(str, more), "--quiet", "--leaderboard",
            str(tmp_path / f"{campaign_folder.name}.md")])
        assert outcome.exit_code == 0 and not outcome.output
    assert (tmp_path / "alone.md").read_text() == (tmp_path / "c.md").read_text()


def test_a_report_and_the_leaderboard_are_two_commands(swept, tmp_path):
    assert complaint(swept, "--leaderboard", tmp_path / "a.md", "--out", tmp_path / "b") == (
        "--out is the folder of a report, and with --leaderboard there is none\n")
    assert not (tmp_path / "a.md").exists()


# ------------------------------------------------------------------------------ docs/leaderboard.md


@pytest.fixture
def example(repository):
    """The design in the page, of somebody's own strategy."""
    block, = re.findall(r"```yaml\n(extends: .*?)```",
                        (repository / "docs" / "leaderboard.md").read_text(), re.DOTALL)
    return block.replace("extends: ", f"extends: {repository / 'scenarios' / 'studies'}/")


def test_the_page_is_what_the_studies_tables_give(repository, tmp_path):
    page = tmp_path / "leaderboard.md"
    text = (repository / "docs" / "leaderboard.md").read_text()
    titles = re.findall(r"^## (\S+), version 1$", text, re.MULTILINE)
    page.write_text(re.sub(r"\| [\d.]+ \(.*\n", "| 1.0 | 1 | 0 | 0 | – | – | – | – |\n", text))
    assert page.read_text() != text
    for name in titles:
        [file] = (repository / "scenarios").glob(f"*/{name}.yaml")
        design, _ = read_design(str(file))
        enter(Study(repository / "docs" / "studies" / name, design), page)
    assert titles and page.read_text() == text


def test_a_strategy_of_ones_own_enters_the_design_that_it_extends(tmp_path, example):
    (tmp_path / "mine.yaml").write_text(example)
    (tmp_path / "mine.py").write_text("""\
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier


class Mine(NearestFrontier):
    pass
""")
    plan = Plan(load_design(tmp_path / "mine.yaml"))
    chosen = [vector for vector in plan.vectors if vector.matches(("strategy=mine",))]
    assert len(chosen) == 16
    assert plan.reference == ReferenceDesign("strategies", 1, {
        role: [role] for role in ("strategy", "terrain", "network", "robots")}, {})
