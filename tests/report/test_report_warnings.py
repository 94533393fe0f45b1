"""The page's warnings about metrics that raised, are absent, or are not known well enough."""

import json

import pyarrow.parquet as pq
from synthetic import campaign, design, timed

from desim.campaign.folder.table import RAISED
from desim.report.campaign.campaign_report import write

ROBOTS = {"robots": [1, 2]}


def test_metrics_that_raised_or_are_not_there(tmp_path):
    campaign(tmp_path, ROBOTS, 3, lambda levels, k: timed(
        100.0 + k, a=1.0 if k else None, b=None, c=float(k)))
    file = tmp_path / "runs.parquet"
    pq.write_table(pq.read_table(file).replace_schema_metadata(
        {RAISED: json.dumps({"a": [2, "ValueError: <boom>"]})}), file)
    text = write(tmp_path, design(ROBOTS, iterations=3, metrics=dict.fromkeys("abc", "m:f"),
                                  report={"metrics": ["exploration_time_s", "b"]})).read_text()
    assert "metric a raised in 2 of 6 runs: ValueError: &lt;boom&gt;." in text
    assert "No run has a value of b." in text
    assert "figure-b" not in text


def test_a_width_that_was_not_reached(tmp_path):
    """Of two robots the metric varies twenty times as much."""
    campaign(tmp_path, ROBOTS, 6, lambda levels, k: timed(
        100.0 + (1.0, 20.0)[levels["robots"] - 1] * (-1) ** k))
    until = {"metric": "exploration_time_s", "width": "10 %", "at_least": 3}
    text = write(tmp_path, design(ROBOTS, iterations={**until, "at_most": 6})).read_text()
    said = ("The 95 % interval of exploration_time_s was still wider than 10 % in 1 of 2 vectors "
            "after 6 runs each: robots = 2.")
    assert text.count(said) == 2  # in short, and in the methods
    text = write(tmp_path, design(ROBOTS, iterations={**until, "at_most": 7})).read_text()
    assert "was still wider" not in text
