"""The figures and sentences of a campaign, each by itself, without the page."""

import numpy as np
import pytest
from synthetic import campaign, design, timed

from desim.report.campaign.answers.sensitivity import scatter_figure
from desim.report.campaign.figures.layout import paneled
from desim.report.campaign.figures.metric import metric_figure
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.knees import interval
from desim.report.campaign.numbers.lines import panels
from desim.report.campaign.numbers.study import Axis, Study
from desim.statistics.knee import Knee


def studied(folder, by, iterations, outcome):
    study = Study(campaign(folder, by, iterations, outcome), design(by, iterations=iterations))
    return study, Estimates(study)


def test_each_vector_is_a_dot_in_the_panel_of_each_parameter(tmp_path):
    by = {"robots": [1, 2, 3], "hosts": [5, 6]}
    study, estimates = studied(tmp_path, by, 1, lambda levels, k: timed(
        100.0 * levels["robots"] + levels["hosts"]))
    of_robots, of_hosts = (
        {tuple(dot) for dot in axes.collections[0].get_offsets().tolist()}
        for axes in scatter_figure(study, estimates, "exploration_time_s").axes)
    times = {(robots, hosts): 100.0 * robots + hosts
             for robots in by["robots"] for hosts in by["hosts"]}
    assert of_robots == {(robots, time_s) for (robots, _), time_s in times.items()}
    assert of_hosts == {(hosts, time_s) for (_, hosts), time_s in times.items()}


def test_panels_share_both_axes():
    _, (first, *others) = paneled(3)
    first.set_xlim(0.0, 7.0)
    first.set_ylim(0.0, 9.0)
    assert [(axes.get_xlim(), axes.get_ylim()) for axes in others] == [((0.0, 7.0), (0.0, 9.0))] * 2


def test_the_legend_says_what_a_hollow_symbol_means(tmp_path):
    study, estimates = studied(tmp_path, {"robots": [1, 2]}, 2, lambda levels, k: timed(
        None if levels["robots"] == 1 else 100.0 + k))
    figure = metric_figure(study, estimates, "exploration_time_s", panels(study), [])
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "none did" in legend


@pytest.mark.parametrize(("low", "high", "said"), [
    (2.5, 3.5, "2.5 to 3.5 kB"), (3.0, 3.5, "3 to 3.5 kB"), (2.5, 3.0, "2.5 to 3 kB"),
    (2.0, 3.5, "below 3.5 kB"), (2.5, 4.0, "above 2.5 kB"), (2.0, 4.0, "open at both ends")])
def test_a_bound_at_the_second_load_or_the_last_but_one_is_open(low, high, said):
    axis = Axis("size", ("1", "2", "3", "4", "5"), np.arange(1.0, 6.0), "kB")
    assert interval(Knee(3.0, low, high, 0.0, 1.0, 0.01, 50), axis) == said
