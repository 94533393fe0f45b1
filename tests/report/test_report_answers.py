"""The first sentences of a report: an answer with its uncertainty.

Intervals stay within the possible values, and no more certainty than the seeds give.
"""

import re

import numpy as np
import pytest
from scipy import stats
from synthetic import LIMIT_S, campaign, design, timed

from desim.report.campaign.answers import warnings
from desim.report.campaign.campaign_report import write
from desim.report.campaign.numbers import bounds
from desim.report.campaign.numbers.contrasts import contrasts
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Study

STRATEGIES = {"strategy": ["near", "far"]}


def study_of(folder, parameters, iterations, outcome, **more):
    campaign(folder, parameters, iterations, outcome)
    return Study(folder, design(parameters, iterations=iterations, **more))


def page_of(study):
    html = write(study.folder, study.design).read_text()
    return html, re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", html))


def by_strategy(gap_s):
    """Seeds share 7 s of luck; ``far`` takes ``gap_s`` longer, give or take a second."""
    def outcome(levels, k):
        far = levels["strategy"] == "far"
        return timed(100.0 + 7.0 * k + far * (gap_s + (-1) ** k), delivered=0.9 + 0.1 * (k % 2),
                     collisions=3 * (k % 2))
    return outcome


def test_the_question_is_answered_with_uncertainty(tmp_path):
    html, text = page_of(study_of(tmp_path, STRATEGIES, 6, by_strategy(20.0)))
    assert ("exploration time [s] of strategy = far is 20 above near, 95 % interval of the "
            "difference [18.85, 21.15], n = 6 seeds.") in text
    assert text.index("is 20 above near") < text.index("In short"), "below the question"
    assert '<ul class=answer>' in html
    assert "<details open><summary>Comparisons (1)" in html


def test_settings_that_cannot_be_distinguished_are_not(tmp_path):
    _, text = page_of(study_of(tmp_path, STRATEGIES, 6, by_strategy(0.0)))
    assert "of strategy = far cannot be told from near: difference 0, 95 % interval" in text


def test_of_runs_that_all_reached_their_limit_no_difference_is_known(tmp_path):
    for name, levels, says in (
            ("strategy", ["near", "far"], "exploration time [s] of strategy = far and near: no run "
             "reached the aim, so that nothing is known of the difference."),
            ("robots", [1, 2], "exploration time [s]: no run reached the aim, neither at robots = "
             "1 nor at 2.")):
        (tmp_path / name).mkdir()
        _, text = page_of(study_of(tmp_path / name, {name: levels}, 6,
                                   lambda levels, k: timed(None)))
        assert says in text and "difference 0" not in text


def test_a_difference_with_late_runs_says_that_they_count_up_to_the_limit(tmp_path):
    def outcome(levels, k):
        return timed(None if levels["strategy"] == "far" and k == 0 else 100.0 + k)

    _, text = page_of(study_of(tmp_path, STRATEGIES, 6, outcome))
    assert "n = 6 seeds; late runs count up to the limit." in text


def test_few_seeds_are_a_hint_and_never_significant(tmp_path):
    study = study_of(tmp_path, STRATEGIES, 3, by_strategy(20.0))
    (found,) = contrasts(study, Estimates(study), "exploration_time_s")
    assert found.p is None and found.paired.t_p < 0.01, "the twin: tested, it would be"
    _, text = page_of(study)
    assert "n = 3 seeds; too few seeds for more than a hint." in text
    assert "significant differences" not in text.lower()


def test_a_line_goes_from_one_end_to_the_other(tmp_path):
    robots = {"robots": [1, 2, 4]}
    _, text = page_of(study_of(tmp_path, robots, 5,
                               lambda levels, k: timed(400.0 / levels["robots"] + k)))
    assert ("exploration time [s] goes from 402 [400, 404] (n = 5) at robots = 1 to 102 [100, 104] "
            "(n = 5) at 4: -300 [-300, -300] more, seed by seed.") in text


def test_the_mean_of_all_lines_shows_what_each_alone_does_not(tmp_path):
    """Each line alone varies more from seed to seed than the axis makes; their mean does not."""
    def slower(levels, k):
        noise = 30.0 * (-1) ** k * (1 if levels["strategy"] == "nearest" else -1)
        return timed(300.0 - 10.0 * levels["speed"] + k + noise * levels["speed"])

    said = ("exploration time [s] of speed = 3 is 20 below 1, 95 % interval of the difference "
            "[-20, -20], n = 6 seeds, mean over 2 settings of the rest.")
    both = ["nearest", "other"]
    for name, strategies, numbers, is_said in (
            ("two", both, "common", True), ("one", ["other"], "common", False),
            ("independent", both, "independent", False)):
        (tmp_path / name).mkdir()
        _, text = page_of(study_of(tmp_path / name, {"speed": [1, 2, 3], "strategy": strategies}, 6,
                                   slower, random_numbers=numbers))
        assert (said in text) == is_said


def test_a_setting_in_which_no_run_reached_the_aim_is_left_out_of_the_mean(tmp_path):
    def outcome(levels, k):
        return timed(None if levels["strategy"] == "lost" else 300.0 - 10.0 * levels["speed"] + k)

    parameters = {"speed": [1, 2], "strategy": ["nearest", "other", "lost"]}
    _, text = page_of(study_of(tmp_path, parameters, 6, outcome))
    assert ("of speed = 2 is 10 below 1, 95 % interval of the difference [-10, -10], n = 6 seeds, "
            "mean over 2 settings of the rest; 1 more left out, of which nothing is known.") in text


def test_each_line_is_named_with_its_panel(tmp_path):
    parameters = {"robots": [1, 2], "strategy": ["near"], "terrain": ["maze", "loop"]}
    _, text = page_of(study_of(tmp_path, parameters, 5,
                               lambda levels, k: timed(400.0 / levels["robots"] + k)))
    assert "terrain = maze: exploration time [s] goes from 402" in text
    assert "terrain = loop: exploration time [s] goes from 402" in text


def test_intervals_do_not_leave_what_can_be(tmp_path):
    def outcome(levels, k):
        return timed((50.0, None)[k % 2], delivered=(0.1, 1.0)[k % 2],
                     collisions=(0, 3)[k % 2], gain=(-5.0, 5.0)[k % 2])
    study = study_of(tmp_path, {"robots": [1]}, 2, outcome, metrics={
        "delivered": "messages_delivered / messages_sent", "gain": "collisions - 3"})
    found = {metric: Estimates(study).of(metric, study.vectors[0])
             for metric in ("delivered", "collisions", "gain", "exploration_time_s")}
    assert (found["delivered"].low, found["delivered"].high) == (0.0, 1.0)
    assert found["collisions"].low == 0.0 and found["collisions"].high > 3.0
    assert found["gain"].low < -50.0, "nothing is known of what it can be"
    time_s = found["exploration_time_s"]
    assert time_s.low >= 0.0 and time_s.high == LIMIT_S
    means = Estimates(study).means("delivered")
    assert (means.low[0], means.high[0]) == (0.0, 1.0)


@pytest.mark.parametrize("formula, values, known", [
    ("messages_delivered / messages_sent", (0.2, 0.9), (0.0, 1.0)),
    ("messages_delivered / (messages_delivered + recoveries)", (0.2, 1.0), (0.0, 1.0)),
    ("bytes_on_air / messages_sent", (0.2, 70.0), (0.0, float("inf"))),
    ("collisions + recoveries", (0.0, 1.0), (0.0, float("inf"))),
    ("collisions - recoveries", (0.0, 1.0), bounds.ANY),
    ("safety * 2", (0.0, 1.0), bounds.ANY),
    ("module:function", (0.0, 1.0), bounds.ANY)])
def test_what_an_expression_can_be(tmp_path, formula, values, known):
    study = study_of(tmp_path, {"robots": [1]}, 2, lambda levels, k: timed(1.0, own=values[k]),
                     metrics={"own": formula})
    assert bounds.of(study, "own") == known


def test_values_far_from_normal_are_pointed_at_where_runs_are_few(tmp_path):
    def two_peaks(levels, k):
        return timed(100.0 + 300.0 * (k == 0) + 0.1 * k)

    def smooth(levels, k):
        return timed(100.0 + stats.norm.ppf((8 * k + levels["robots"] - 0.5) / 40))

    robots = {"robots": list(range(1, 9))}
    for name, outcome, said in ("odd", two_peaks, True), ("normal", smooth, False):
        folder = tmp_path / name
        folder.mkdir()
        study = study_of(folder, robots, 5, outcome)
        printed = warnings.about_few(study, Estimates(study), ["exploration_time_s"])
        assert ("are not near normal" in printed) == said


def test_many_small_vectors_of_normal_values_are_not_pointed_at():
    random = np.random.default_rng(7)
    experiments = 100
    warned = sum(warnings.are_odd(list(random.normal(size=(100, 5)))) for _ in range(experiments))
    # The test's level is 1 %; residuals of one sample depend on each other, which adds a little.
    assert stats.binomtest(warned, experiments, 0.04, "greater").pvalue > 0.01


def test_twin_residuals_that_pass_for_normal_warn_of_normal_values(monkeypatch):
    monkeypatch.setattr(warnings.stats.beta, "cdf", lambda share, a, b: warnings.stats.norm.cdf(
        (2 * share - 1) * (2 * a + 1) / np.sqrt(2 * a + 2)))
    random = np.random.default_rng(7)
    assert all(warnings.are_odd(list(random.normal(size=(100, 5)))) for _ in range(10))


def test_labels_are_text(tmp_path, recwarn):
    labels = {"strategy": ["from $5 to $10", r"$\frac$", "近い"]}
    html, text = page_of(study_of(tmp_path, labels, 5, lambda levels, k: timed(1.0 + k)))
    assert "from $5 to $10" in text and r"$\frac$" in text and "近い" in text
    assert not [one for one in recwarn if "Glyph" in str(one.message)]


def test_figures_have_a_role_and_a_title(tmp_path):
    html, _ = page_of(study_of(tmp_path, STRATEGIES, 5, by_strategy(20.0)))
    svgs = re.findall(r'<svg role="img" aria-labelledby="([^"]*)"[^>]*><title id="([^"]*)">([^<]+)',
                      html)
    assert len(svgs) == html.count("<svg") > 0
    assert all(label == own and title.startswith("exploration time [s] against strategy")
               for label, own, title in svgs)
