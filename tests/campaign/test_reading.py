"""A campaign's folder in Python."""


import numpy as np
import pytest
from designs import Here, planned

import desim
from desim.campaign.design.metrics import Metrics
from desim.campaign.running.sweep import Sweep
from desim.campaign.running.work import work
from desim.errors import InputError
from desim.results.row import failure


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Two runs are finished, the third has failed."""
    folder = tmp_path_factory.mktemp("campaign")
    plan = planned(folder, "parameters: {robots: {key: fleet.size, values: [1, 2, 3]}}\n"
                           "iterations: 1\nquestion: Why?\n")
    workers = Here(work=lambda task: failure(task.run_id, "boom") if
                   task.loaded.scenario.fleet.size == 3 else work(task))
    with Sweep(plan, Metrics(plan), folder / "out") as sweep:
        sweep.run(workers)
    return folder / "out"


def test_a_campaign(path):
    campaign = desim.Campaign(path)
    assert campaign.path == path and isinstance(campaign, desim.Campaign)
    assert campaign.design.question == "Why?" and campaign.design.iterations == 1
    assert campaign.runs["robots"].tolist() == [1, 2, 3]
    assert campaign.runs["status"].tolist() == ["finished", "finished", "failed"]
    assert campaign.runs["explored"].dtype == float and np.isnan(campaign.runs["explored"][2])
    assert [run.scenario.fleet.size for run in campaign] == [1, 2]
    first = campaign.run(campaign.runs["run_id"][0])
    assert first.metrics["explored"] == campaign.runs["explored"][0]


def test_what_is_not_there(path, tmp_path):
    campaign = desim.Campaign(path)
    failed = campaign.runs["run_id"][2]
    for run_id, text in ((failed, f"run {failed!r} has left no folder: boom"),
                         ("nobody", "has no run 'nobody'")):
        with pytest.raises(InputError) as caught:
            campaign.run(run_id)
        assert str(caught.value) == f"{path}: {text}"
    with pytest.raises(InputError, match="not the folder of a campaign"):
        desim.Campaign(tmp_path)


def test_a_campaign_in_a_notebook(path):
    text = desim.Campaign(path)._repr_html_()
    assert "2 runs, 1 failed" in text and "<p>Why?</p>" in text
    assert text.count("<tr>") == 4  # the head, and three vectors
