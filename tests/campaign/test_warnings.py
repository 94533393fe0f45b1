"""Warnings about metrics at the end of a campaign."""

import json

import pyarrow.parquet as pq
import pytest
from designs import Here, planned

from desim.campaign.design.metrics import Metrics
from desim.campaign.folder.table import RAISED
from desim.campaign.running.sweep import Sweep
from desim.campaign.running.warnings import warnings_of

MINE = """import math

def late(run):
    if run.metrics["simulated_s"] > 0.05 and len(run.metrics["robots"]) > 1:
        raise ValueError("boom\\nand more")
    return 1.0

def leaves(run):
    if run.metrics["simulated_s"] > 0.05:
        raise SystemExit(3)
    return 1.0

def nothing(run):
    return math.nan

def luck(run):
    return run.manifest["seed"]
"""
TEXT = "parameters: {robots: {key: fleet.size, values: [1, 2]}}\nreport: {metrics: [explored]}\n"


@pytest.fixture
def swept(tmp_path):
    """The warnings about a campaign with ``text``, and the metadata of its table."""
    module = f"of_{tmp_path.name}"  # a process knows one module of a name
    (tmp_path / f"{module}.py").write_text(MINE)

    def done(text):
        plan = planned(tmp_path, TEXT + text.replace("mine:", f"{module}:"))
        out = tmp_path / "out"
        with Sweep(plan, Metrics(plan), out) as sweep:
            sweep.run(Here())
            said = warnings_of(plan, sweep.metrics, sweep.agenda)
        return said, json.loads(pq.read_schema(out / "runs.parquet").metadata[RAISED.encode()])

    return done


def test_a_function_that_raises_leaves_the_run_and_is_reported(swept):
    said, raised = swept("iterations: 2\nmetrics: {a: 'mine:late', "
                         "b: 'mine:leaves'}\n")
    assert said == ["metric b raised in 4 of 4 runs: SystemExit: 3",
                    "metric a raised in 2 of 4 runs: ValueError: boom"]
    assert raised == {"b": [4, "SystemExit: 3"], "a": [2, "ValueError: boom"]}


def test_a_metric_without_a_value_is_reported(swept):
    assert swept("iterations: 1\nmetrics: {a: 'mine:nothing', "
                 "b: exploration_time_s / 2, c: explored / 2}\n") \
        == (["no run has a value of a, b"], {})


def test_widths_that_were_not_reached_are_reported(swept):
    assert swept("iterations: {metric: luck, width: 0.1, at_least: 2, at_most: 3}\n"
                 "metrics: {luck: 'mine:luck'}\n")[0] == [
        "the 95 % interval of luck is still wider than 0.1 in 2 of 2 vectors after 3 runs each"]
