"""The figures and sentences of a campaign, each by itself, without the page."""

import numpy as np
import pytest
from synthetic import campaign, design, timed

from desim.report.campaign.answers.sensitivity import scatter_figure
from desim.report.campaign.figures.layout import paneled
from desim.report.campaign.figures.metric import metric_figure
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.knees import Knees, interval
from desim.report.campaign.numbers.lines import evenly, panels
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


def test_of_many_vectors_each_eighth_has_its_mean_and_interval(tmp_path):
    """Of three values 100 apart, with Student's t of two degrees of freedom: 4.303 * 100 / 3**0.5.
    """
    study, estimates = studied(tmp_path, {"robots": list(range(1, 25))}, 1, lambda levels, k: timed(
        100.0 * levels["robots"]))
    axes, = scatter_figure(study, estimates, "exploration_time_s").axes
    means, *bars = (line.get_xydata() for line in axes.lines)
    assert means.tolist() == [[x, 100.0 * x] for x in range(2, 25, 3)]
    assert len(bars) == 8
    for (x, mean), bar in zip(means, bars, strict=True):
        assert np.allclose(bar, [(x, mean - 248.4), (x, mean + 248.4)], atol=0.05)


@pytest.mark.parametrize(("metric", "values", "scale"), [
    ("exploration_time_s", (1.0, 100.0), "log"), ("exploration_time_s", (10.0, 100.0), "linear"),
    ("share", (0.001, 1.0), "linear"), ("share", (0.0, 100.0), "linear")])
def test_a_wide_range_is_logarithmic_but_for_shares(tmp_path, metric, values, scale):
    study, estimates = studied(tmp_path, {"robots": [1, 2]}, 2, lambda levels, k: timed(
        values[levels["robots"] - 1], share=values[levels["robots"] - 1]))
    axes, = metric_figure(study, estimates, metric, panels(study), []).axes
    assert axes.get_yscale() == scale


def test_on_a_logarithmic_axis_the_levels_have_numbers_and_nothing_else_has(tmp_path):
    study, estimates = studied(tmp_path, {"robots": [1, 4, 16, 64]}, 2, lambda levels, k: timed(
        100.0 + k))
    figure = metric_figure(study, estimates, "exploration_time_s", panels(study), [])
    figure.draw_without_rendering()
    axes, = figure.axes
    assert axes.get_xscale() == "log"
    assert [label.get_text() for label in axes.get_xticklabels(which="both")] == [
        "1", "4", "16", "64"]


@pytest.mark.parametrize(("count", "labelled"), [(1, [0]), (2, [0, 1]), (3, [1, 2]), (4, [2, 3])])
def test_a_panel_with_none_below_has_the_numbers_of_the_axis(count, labelled):
    _, all_axes = paneled(count)
    assert [i for i, axes in enumerate(all_axes)
            if axes.xaxis.get_tick_params()["labelbottom"]] == labelled


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


@pytest.mark.parametrize(("failed", "was_sought"), [(0, True), (1, True), (2, True), (3, False)])
def test_a_knee_is_sought_in_eight_runs_whole_iterations_or_not(tmp_path, failed, was_sought):
    """Of two iterations at five loads so many runs of the second one failed."""
    study, estimates = studied(
        tmp_path, {"robots": [1, 2, 3, 4, 5]}, 2, lambda levels, k: {"error": "broken"} if k
        and levels["robots"] <= failed else timed(100.0 + max(levels["robots"], 3) + 0.01 * k))
    (line,), = (panel.lines for panel in panels(study))
    knees = Knees(study, estimates, 1).of("exploration_time_s", line, "")
    assert knees.was_sought == was_sought
    assert [knee.at for knee in knees.knees] == pytest.approx([3.0] * was_sought, abs=0.1)


@pytest.mark.parametrize(("most", "items"), [
    (1, [0]), (2, [0, 8]), (3, [0, 4, 8]), (5, [0, 2, 4, 6, 8]), (9, list(range(9)))])
def test_of_many_items_some_are_taken_evenly_with_both_ends(most, items):
    assert evenly(range(9), most) == items
