"""Names of metrics and parameters are anybody's: files stay in the report, markup stays text."""

import os
import sys
from pathlib import Path

import pytest
from synthetic import campaign, design

from desim.report.campaign import formatting
from desim.report.campaign.campaign_report import write

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))

from guarded import _is_evil
from hostile_campaigns import MARKUP

pytestmark = pytest.mark.usefixtures("svg_alone")

NAMES = ["../../../victim", "/tmp/victim", MARKUP, "messages_by_topic_/*/map_delivered", "x" * 300,
         "a\nb", ".."]


@pytest.mark.parametrize("name", NAMES)
def test_a_report_of_a_metric_of_this_name_writes_in_its_folder_alone(tmp_path, name):
    folder = tmp_path / "a" / "campaign"
    folder.mkdir(parents=True)
    campaign(folder, {"robots": [1, 2]}, 3, lambda levels, seed: {name: levels["robots"] + seed})
    page = write(folder, design({"robots": [1, 2]}, report={"metrics": [name]}, question=MARKUP))
    written = [os.path.join(top, file) for top, _, files in os.walk(tmp_path) for file in files]
    assert all(path.startswith((f"{folder}/report/", f"{folder}/runs.parquet"))
               for path in written)
    called = formatting.plain(name)
    assert {f"{called}.png", f"{called}.csv"} <= {os.path.basename(path) for path in written}
    assert not _is_evil(page) and f'href="figures/{called}.png"' in page.read_text()


def test_a_plain_name_stays_and_others_stay_apart():
    assert formatting.plain("explored_union-2") == "explored_union-2"
    assert len({formatting.plain(name) for name in (*NAMES, "a/b", "a.b", "a_b")}) == 10
