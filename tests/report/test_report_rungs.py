"""Whether a ranking holds on every rung, and the design that asks."""

from io import StringIO

import pytest
from rich.console import Console
from synthetic import campaign, design, timed

from desim.campaign.design.ladder import RUNGS, ladder_design
from desim.commands.views.ladder import terminal_table
from desim.errors import InputError
from desim.report.campaign.answers import rungs
from desim.report.campaign.campaign_report import write
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Study
from desim.report.campaign.tables.table import ReportTable

pytestmark = pytest.mark.usefixtures("svg_alone")

LADDER = {"rung": list(RUNGS), "strategy": ["a", "b", "c"]}
KEYS = {"rung": {"key": "network.fidelity", "values": list(RUNGS)},
        "strategy": {"key": "coordination.strategy", "values": ["a", "b", "c"]}}


def outcome(levels, k):
    """On ideal and disk a is faster than b, above slower; c is the slowest; the same on walls."""
    rung, setting = (LADDER[name].index(levels[name]) for name in LADDER)
    if setting == 2:
        return timed(None if levels["rung"] == "mac" else 900.0 + k)
    ahead = setting == (0 if rung < 2 else 1)
    return timed(100.0 + 3.0 * k - (20.0 + k % 2) * ahead)


@pytest.fixture
def climbed(tmp_path):
    chosen = design({}, iterations=6).model_copy(update={
        "report": design({}, report={"against": "rung", "by": "strategy"}).report,
        "parameters": type(design({})).model_validate(
            {"name": "x", "base": "x", "parameters": KEYS}).parameters})
    study = Study(campaign(tmp_path, LADDER, 6, outcome), chosen)
    return study, rungs.compared(study, Estimates(study), "exploration_time_s")


def test_each_rung_is_ranked_against_the_highest(climbed):
    _, found = climbed
    assert [rung.name for rung in found] == list(RUNGS)
    assert [round(rung.kendall.tau, 3) for rung in found] == [0.333, 0.333, 1.0, 1.0, 1.0]
    assert [[(flip.i, flip.j, flip.significant) for flip in rung.flips] for rung in found] \
        == [[(0, 1, True)], [(0, 1, True)], [], [], []]


def test_it_is_said_which_rung_flips_what(climbed):
    study, found = climbed
    said = rungs.sentences(study, "exploration_time_s", found)
    assert said == ["ideal flips a and b (significant, p < 0.001) against multihop.",
                    "disk flips a and b (significant, p < 0.001) against multihop."]
    text = write(study.folder, study.design).read_text()
    written = (study.folder / "report" / "tables" / "exploration_time_s_ladder.tex").read_text()
    assert written.count(r"$\geq$ 1\,000") == 1  # of c on mac
    assert said[0].replace("<", "&lt;") in text


def test_a_narrow_terminal_shows_whole_names():
    names = ["nearest_frontier", "random_frontier", "one_more_way_to_choose_goals"]
    table = ReportTable("t", "T.", ["rung", *names, "flipped"],
                  [["multihop", 1234.5, 0.25, 3.5, f"{names[0]}/{names[2]}*"]], [], [])
    console = Console(width=60, file=StringIO())
    console.print(terminal_table(table))
    text = console.file.getvalue()
    assert "…" not in text
    flipped = "".join(line.split("│")[5].strip() for line in text.splitlines()
                      if line.startswith("│"))
    assert flipped == f"{names[0]}/{names[2]}*"


def test_the_design_has_all_rungs_by_all_settings(repository):
    scenario = str(repository / "scenarios" / "field_30.yaml")
    made = ladder_design(scenario, "robot.laser.beams=180, 360", seeds=3,
                         overrides=("fleet.size=4",))
    assert made.design.iterations == 3
    assert made.design.set == {"fleet.size": 4}
    assert made.design.parameters["rung"].values == RUNGS
    assert made.design.parameters["beams"].values == (180, 360)
    assert made.design.name == "ladder_field_30_beams"


@pytest.mark.parametrize("compare", ["fleet.size", "=1,2", "fleet.size=1", "a..b=1,2"])
def test_a_wrong_comparison_is_refused(repository, compare):
    with pytest.raises(InputError, match="must look like a.b.c=value,value"):
        ladder_design(str(repository / "scenarios" / "field_30.yaml"), compare)
