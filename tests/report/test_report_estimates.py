"""Times that were not reached: what counts with the limit, and what says nothing."""

import csv

import pytest
from synthetic import LIMIT_S, campaign, design, timed

from desim.report.campaign.campaign_report import write
from desim.report.campaign.numbers.contrasts import contrasts
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Study

pytestmark = pytest.mark.usefixtures("svg_alone")

ROBOTS = {"robots": [1, 2, 3]}


def ended(levels, k):
    """One robot is always the whole fleet. Of two the second gets there in half of the runs, which
    go on to the limit; runs of three stop when the first one knows enough."""
    time_s = 100.0 + 10.0 * k
    if levels["robots"] == 1:
        return timed(time_s, fleet_time_s=time_s, stop_reason="explored")
    if levels["robots"] == 2:
        late = k % 2
        return timed(time_s, fleet_time_s=None if late else time_s + 50.0,
                     stop_reason="elapsed" if late else "explored") | (
            {"simulated_s": LIMIT_S} if late else {})
    return timed(time_s, fleet_time_s=time_s if k == 0 else None, stop_reason="explored")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = campaign(tmp_path_factory.mktemp("times"), ROBOTS, 4, ended)
    return Study(folder, design(ROBOTS, iterations=4, report={
        "metrics": ["exploration_time_s", "fleet_time_s"]}))


def test_runs_that_were_stopped_for_another_reason_say_nothing_of_the_time(study):
    estimates = Estimates(study)
    one, two, three = (estimates.of("fleet_time_s", vector) for vector in study.vectors)
    assert (one.mean, one.n, one.late) == (115.0, 4, 0)
    assert (two.mean, two.n, two.late) == ((150.0 + LIMIT_S + 170.0 + LIMIT_S) / 4, 4, 2)
    assert (three.mean, three.low, three.n, three.times) == (None, None, 0, None)
    assert estimates.limit("fleet_time_s") == LIMIT_S
    assert [estimates.of("exploration_time_s", vector).mean for vector in study.vectors] \
        == [115.0] * 3


def test_all_vectors_at_once_come_to_the_same(study):
    estimates = Estimates(study)
    means = estimates.means("fleet_time_s")
    found = [estimates.of("fleet_time_s", vector) for vector in study.vectors]
    assert means.n.tolist() == [4.0, 4.0, 0.0] and means.late.tolist() == [0.0, 2.0, 0.0]
    for i in (0, 1):
        assert [column[i] for column in means[:3]] == pytest.approx(
            [found[i].mean, found[i].low, found[i].high])
    assert all(column[2] != column[2] for column in means[:3])


def test_instants_of_stopping_are_not_compared(study):
    found = contrasts(study, Estimates(study), "fleet_time_s")
    assert {(one.first, one.second) for one in found} == {("1", "2")}


def test_the_limit_alone_is_no_interval(tmp_path):
    """No run of two robots got there: at least the limit, and nobody knows how much more."""
    robots = {"robots": [1, 2]}
    folder = campaign(tmp_path, robots, 3, lambda levels, k: timed(
        None if levels["robots"] == 2 else 100.0 + k, stop_reason="elapsed"))
    estimates = Estimates(Study(folder, design(robots, iterations=3)))
    means = estimates.means("exploration_time_s")
    assert means.mean.tolist() == [101.0, LIMIT_S] and means.late.tolist() == [0.0, 3.0]
    assert means.low[1] != means.low[1] and means.high[1] != means.high[1]


def test_tables_and_page_say_what_is_only_a_bound(study, tmp_path):
    text = write(study.folder, study.design, tmp_path).read_text()
    with open(tmp_path / "tables" / "metrics_by_vector.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["fleet_time_s_late"] for row in rows] == ["0.0", "2.0", "0.0"]
    assert [row["fleet_time_s"] for row in rows] == ["115.0", "580.0", ""]
    assert ">≥ 580 ±" in text and ">≥ 580</td>" in text
    assert "4 of 12 finished runs have no such value, or are of a vector" in text
