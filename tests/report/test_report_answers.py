"""The first sentences of a report: an answer with its uncertainty.

Intervals stay within the possible values, and no more certainty than the seeds give.
"""

import html
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

pytestmark = pytest.mark.usefixtures("svg_alone")

STRATEGIES = {"strategy": ["near", "far"]}


def study_of(folder, parameters, iterations, outcome, **more):
    campaign(folder, parameters, iterations, outcome)
    return Study(folder, design(parameters, iterations=iterations, **more))


def page_of(study):
    text = write(study.folder, study.design).read_text()
    return text, re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", text))


def by_strategy(gap_s):
    """Seeds share 7 s of luck; ``far`` takes ``gap_s`` longer, give or take a second."""
    def outcome(levels, k):
        far = levels["strategy"] == "far"
        return timed(100.0 + 7.0 * k + far * (gap_s + (-1) ** k), delivered=0.9 + 0.1 * (k % 2),
                     collisions=3 * (k % 2))
    return outcome


def first_screen(study):
    """Its heading, its sentences and its figures."""
    header = page_of(study)[0].partition("<header>")[2].partition("</header>")[0]
    said = [re.sub("<[^>]*>", "", text) for text in re.findall(
        "<(?:p|h1|li)[ >].*?</(?:p|h1|li)>", header)]
    return [html.unescape(text).strip() for text in said], re.findall('<figure id="([^"]*)"',
                                                                     header)


def test_the_first_screen_of_factors_that_interact(tmp_path):
    """Near gains from robots, far loses; each says so itself, and of more settings each counts."""
    def outcome(levels, k):
        sign = -1 if levels["strategy"] == "near" else 1
        return timed(400.0 + sign * 20.0 * levels["robots"] + k + (-1) ** k * levels["robots"],
                     map_age_s=5.0)

    parameters = {"robots": [1, 2, 3, 4], **STRATEGIES}
    said, figures = first_screen(study_of(
        tmp_path, parameters, 6, outcome,
        report={"metrics": ["exploration_time_s", "map_age_s"], "against": "robots"}))
    assert said == [
        "made_up",
        "Does <it> pay off & when?",
        "strategy = near: exploration time is lowest at robots = 4 and highest at 1: 60 s apart "
        "[54.34, 65.66].",
        "strategy = far: exploration time is lowest at robots = 1 and highest at 4: 60 s apart "
        "[54.34, 65.66].",
        "Exploration time is lowest at strategy = near in all 4 levels of robots.",
        "Map age is the same at every robots in all 2 levels of strategy.",
        "48 runs: 8 vectors with 6 seeds each. All reached the aim."]
    assert figures == ["figure-answer"]


def test_where_many_settings_differ_nothing_is_pooled(tmp_path):
    def outcome(levels, k):
        sign = 1 if levels["terrain"] == "d" else -1
        return timed(400.0 + sign * 20.0 * levels["robots"] + k)

    said, _ = first_screen(study_of(tmp_path, {"robots": [1, 2], "terrain": list("abcde")},
                                    5, outcome))
    assert said[2] == ("Exploration time is lowest at robots = 2 in 4 of 5 levels of terrain and "
                       "at 1 in 1. They differ, so that no pooled answer exists.")


def test_the_first_screen_of_runs_that_ended_at_the_time_limit(tmp_path):
    """Of a level that all runs reached the mean is known, and that it is the lowest."""
    def outcome(levels, k):
        late = levels["rate"] == "1 Mb/s" or (levels["rate"] == "3 Mb/s" and k < 2)
        return timed(None if late else 100.0 + 10.0 * k)

    said, figures = first_screen(study_of(
        tmp_path, {"rate": ["1 Mb/s", "3 Mb/s", "10 Mb/s", "30 Mb/s"]}, 5,
        lambda levels, k: outcome(levels, k) if levels["rate"] != "30 Mb/s"
        else timed(90.0 + 10.0 * k)))
    assert said[2:] == [
        "Exploration time is lowest at rate = 30 Mb/s, 110 s [90.37, 129.6]. 7 of 20 runs ended at "
        "the time limit, among them all at 1 Mb/s.",
        "20 runs: 4 vectors with 5 seeds each. 7 of 20 runs ended at the time limit."]
    assert figures == ["figure-answer"]


def test_a_lowest_mean_among_those_that_are_known_may_be_chance(tmp_path):
    """Of levels that all runs reached; those with late runs are out of question."""
    def outcome(levels, k):
        return timed({"1 Mb/s": None, "3 Mb/s": 102.0 + 10.0 * (-1) ** k, "10 Mb/s": 100.0,
                      "30 Mb/s": 130.0 + k}[levels["rate"]])

    said, _ = first_screen(study_of(
        tmp_path, {"rate": ["1 Mb/s", "3 Mb/s", "10 Mb/s", "30 Mb/s"]}, 5, outcome))
    assert said[2] == (
        "Exploration time is lowest at rate = 10 Mb/s, 100 s, not clearly lower than at 3 Mb/s. "
        "5 of 20 runs ended at the time limit, among them all at 1 Mb/s.")


def test_the_first_screen_of_two_runs_each_shows_the_values(tmp_path):
    study = study_of(tmp_path, STRATEGIES, 2, by_strategy(20.0))
    assert first_screen(study)[0][2:] == [
        "Exploration time is lowest at strategy = near (100 and 107 s) and highest at far (121 and "
        "126 s).",
        "4 runs: 2 vectors with 2 seeds each, too few for more than a hint. All reached the aim."]
    body = page_of(study)[1].partition("made_up Does")[2].partition("Methods")[0]
    assert not re.search(r"\[-?[\d.]+, ", body), "nor is there an interval below"


def test_settings_that_cannot_be_distinguished_are_not(tmp_path):
    said, _ = first_screen(study_of(tmp_path, STRATEGIES, 6, by_strategy(0.1)))
    assert said[2] == ("Exploration time does not differ clearly by strategy: near and far lie "
                       "0.1 s apart [-1.05, 1.25].")


def test_the_interval_allows_for_the_choice_of_two_levels_among_many(tmp_path):
    levels = {"strategy": list("abcd")}
    said, _ = first_screen(study_of(
        tmp_path, levels, 6, lambda chosen, k: timed(
            100.0 + 7.0 * k + 3.0 * (chosen["strategy"] == "d") * (1 + (-1) ** k))))
    low, high = stats.t.interval(1 - 0.05 / 6, 5, 3.0, stats.sem([6, 0, 6, 0, 6, 0]))
    assert said[2].endswith(f"3 s apart [{low:.4g}, {high:.4g}].") and low < 0.0
    assert stats.t.interval(0.95, 5, 3.0, stats.sem([6, 0, 6, 0, 6, 0]))[0] < 0.0


@pytest.mark.parametrize("outcome, says", [
    (lambda levels, k: timed(None), "Where exploration time is lowest is not known. All 10 runs "
                                    "ended at the time limit."),
    (lambda levels, k: timed(None if k == 0 else 100.0 + levels["robots"]),
     "Where exploration time is lowest is not known. 2 of 10 runs ended at the time limit."),
    (lambda levels, k: timed(100.0), "Exploration time is the same at every robots: 100 s.")],
    ids=["all", "some", "none"])
def test_what_is_not_known_is_not_said(tmp_path, outcome, says):
    assert first_screen(study_of(tmp_path, {"robots": [1, 2]}, 5, outcome))[0][2] == says


def test_runs_of_different_seeds_are_not_subtracted(tmp_path):
    said, _ = first_screen(study_of(tmp_path, STRATEGIES, 6, by_strategy(20.0),
                                    random_numbers="independent"))
    assert said[2] == ("Exploration time is lowest at strategy = near and highest at far: 20 s "
                       "apart.")


def test_failed_runs_and_runs_stopped_otherwise_are_counted_in_words(tmp_path):
    def outcome(levels, k):
        return {"error": "full", "stop_reason": "failed"} if k == 0 else timed(
            None if k < 4 else 50.0, stop_reason="elapsed" if k == 1 else "blocked")

    said, _ = first_screen(study_of(tmp_path, STRATEGIES, 6, outcome))
    assert said[-1] == ("12 runs: 2 vectors with 6 seeds each. 2 of 12 runs failed. 2 of 12 runs "
                        "ended at the time limit. 4 of 12 runs ended before the aim for another "
                        "reason.")


def test_a_line_that_bends_says_where(tmp_path):
    rates = [f"{rate} Mb/s" for rate in (1, 3, 10, 30, 100, 300)]

    def outcome(levels, k):
        rate = float(levels["rate"].split()[0])
        return timed(200.0 + 300.0 * max(0.0, 1.0 - np.log10(rate)) + (-1) ** k * 0.01 * rate**0.3)

    said, _ = first_screen(study_of(tmp_path, {"rate": rates}, 6, outcome))
    assert re.fullmatch(r"Exploration time bends at rate 1\d(\.\d)? Mb/s \[.*\]\.", said[3])


def test_few_seeds_are_a_hint_and_never_significant(tmp_path):
    study = study_of(tmp_path, STRATEGIES, 3, by_strategy(20.0))
    (found,) = contrasts(study, Estimates(study), "exploration_time_s")
    assert found.p is None and found.paired.t_p < 0.01, "the twin: tested, it would be"
    _, text = page_of(study)
    assert "2 vectors with 3 seeds each, too few for more than a hint." in text
    assert "significant differences" not in text.lower()


def test_intervals_do_not_leave_what_can_be(tmp_path):
    def outcome(levels, k):
        return timed((50.0, None)[k % 2], delivered=(0.1, 1.0)[k % 2],
                     collisions=(0, 3)[k % 2], gain=(-5.0, 5.0)[k % 2])
    study = study_of(tmp_path, {"robots": [1]}, 4, outcome, metrics={
        "delivered": "messages_delivered / messages_sent", "gain": "collisions - 3"})
    found = {metric: Estimates(study).of(metric, study.vectors[0])
             for metric in ("delivered", "collisions", "gain", "exploration_time_s")}
    assert (found["delivered"].low, found["delivered"].high) == (0.0, 1.0)
    assert found["collisions"].low == 0.0 and found["collisions"].high > 3.0
    assert found["gain"].low < -5.0, "nothing is known of what it can be"
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
    _, text = page_of(study_of(tmp_path, labels, 5, lambda levels, k: timed(1.0 + k)))
    assert "from $5 to $10" in text and r"$\frac$" in text and "近い" in text
    assert not [one for one in recwarn if "Glyph" in str(one.message)]


def test_figures_have_a_role_and_a_title(tmp_path):
    page, _ = page_of(study_of(tmp_path, STRATEGIES, 5, by_strategy(20.0)))
    svgs = re.findall(r'<svg role="img" aria-labelledby="([^"]*)"[^>]*><title id="([^"]*)">([^<]+)',
                      page)
    assert len(svgs) == page.count("<svg") > 0
    assert all(label == own and title.startswith("exploration time [s]")
               for label, own, title in svgs)
