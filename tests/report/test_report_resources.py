"""The resource that saturated first, in the report of a campaign."""

import csv

import pytest
from synthetic import campaign, design, timed

from desim.report.campaign.campaign_report import write
from desim.report.campaign.numbers import Study
from desim.report.campaign.tables import resources

pytestmark = pytest.mark.usefixtures("svg_alone")

PARAMETERS = {"speed": [1, 2]}


def slow_fails_by_its_processor(levels, iteration):
    peak = 0.99 if levels["speed"] == 1 else 0.4
    first = "processor" if levels["speed"] == 1 else "lan" if iteration == 0 else None
    return timed(100.0 + iteration, saturated_first=first, saturation_processor_peak=peak,
                 saturation_lan_peak=0.5, saturation_queue_lost=iteration,
                 saturation_processor_part=f"robot_{iteration // 2}" if first else None)


def test_a_table_and_a_sentence_say_what_gave_in_first(tmp_path):
    folder, plan = campaign(tmp_path, PARAMETERS, 3, slow_fails_by_its_processor), design(
        PARAMETERS)
    assert resources.sentences(Study(folder, plan)) == [
        "Resource that saturated first, of 6 runs: processor in 3 and lan in 1; none in 2."]
    page = write(folder, plan)
    assert "Which resource saturates first" in page.read_text()
    with open(page.parent / "tables" / "saturated_first.csv") as file:
        rows = list(csv.DictReader(file))
    assert [(row["speed"], row["first"]) for row in rows] == [
        ("1", "processor 3 (robot_0: 2, robot_1: 1)"), ("2", "none 2, lan 1")]
    assert [float(row["saturation_processor_peak"]) for row in rows] == pytest.approx([0.99, 0.4])


def test_where_nothing_gave_in_nothing_is_said(tmp_path):
    folder = campaign(tmp_path, PARAMETERS, 2, lambda levels, iteration: timed(
        9.0, saturated_first=None, saturation_lan_peak=0.1, saturation_queue_lost=0))
    study = Study(folder, design(PARAMETERS))
    assert resources.sentences(study) == []
    assert [row[-2] for row in resources.resources_table(study).rows] == ["none 2", "none 2"]


def test_campaigns_of_an_earlier_version_have_no_such_table(tmp_path):
    folder = campaign(tmp_path, PARAMETERS, 2, lambda levels, iteration: timed(9.0))
    assert resources.resources_table(Study(folder, design(PARAMETERS))) is None
