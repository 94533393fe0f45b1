"""Words and tables of a campaign's report, each by itself: methods, messages' time, units."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from synthetic import campaign, design, timed

from desim.report.campaign import campaign_report, formatting
from desim.report.campaign.answers import methods
from desim.report.campaign.answers.sensitivity import SobolIndices, sobol_table
from desim.report.campaign.figures import layout, time_series
from desim.report.campaign.figures.layout import along
from desim.report.campaign.numbers.latencies import MeanLoss, TopicLatency
from desim.report.campaign.numbers.lines import panels
from desim.report.campaign.numbers.study import Axis, Study
from desim.report.campaign.tables.latency import age_table, latency_table, loss_table
from desim.statistics.intervals import t_interval


@pytest.fixture
def study(tmp_path):
    by = {"robots": [1, 2]}
    return Study(campaign(tmp_path, by, 2, lambda levels, k: (
        timed(None) if levels["robots"] == 1 and k else timed(100.0 + k))),
        design(by, iterations=2))


NO_SOURCES = SimpleNamespace(manifest=None, stop={}, design=None, scenario=None)


def said(study, sources=NO_SOURCES, intervals=(), metrics=(), contrasts=None, knees=False, wide=""):
    return methods.paragraphs(study, set(intervals), 999, sources, list(metrics), contrasts or {},
                              knees, wide)


def test_the_plainest_campaign(study):
    assert said(study) == [
        "The campaign “made_up” was simulated with desim. The base scenario was small.yaml.",
        "All combinations (2 vectors) of 1 parameter were run: robots (fleet.robots): 1, 2. Each "
        "vector was run 2 times. Common random numbers: iteration k of each vector had the seed 1 "
        "+ k, k from 0 (seeds 1 to 2). 4 runs ended, of which 3 reached the aim, 1 were stopped "
        "before it and 0 failed; failed runs are left out of all estimates.",
        "Intervals are 95 % confidence intervals of the mean over the runs of a vector, from "
        "Student's t."]


@pytest.mark.parametrize("stop", [{"explored": None}, {"explored": 1.0, "by": "none"}])
def test_versions_models_and_settings_are_named(study, stop):
    manifest = {"desim_version": "0.6", "source": "abc", "plugins": {"x": "b", "y": "a"},
                "versions": {"desim": "0.6", "numpy": "2.0", "numba": "0.60"},
                "machine": {"libm": "glibc 2.36", "machine": "x86_64"}}
    study.design = design({"robots": [1, 2]}, iterations=2, set={"a": "b", "c": [1, 2]},
                          measure={"period": "1 s"})
    made, *_ = said(study, SimpleNamespace(
        manifest=manifest, stop={"elapsed": "9 s"} | stop))
    assert made == (
        "The campaign “made_up” was simulated with desim 0.6 (source abc; numpy 2.0, numba 0.60), "
        "with the models a, b; glibc 2.36 on x86_64. The base scenario was small.yaml, with a = b, "
        "c = [1, 2]. A run stopped at elapsed = 9 s, whatever came first. Measured: period = 1 s.")


@pytest.mark.parametrize(("more", "says"), [
    ({"iterations": 1}, "Each vector was run once."),
    ({"random_numbers": "independent"},
     "Each run had a seed of its own, derived from 1 and its parameters."),
    ({"metrics": {"twice": "2 * explored"}}, " Metrics of this campaign: twice = 2 * explored."),
    ({"iterations": {"metric": "explored", "width": "10 %", "at_least": 2, "at_most": 5}},
     "Each vector was repeated until the 95 % interval of explored was at most 10 % wide, at least "
     "2 and at most 5 times (between 2 and 2 runs).")])
def test_how_often_and_with_which_seeds(study, more, says):
    study.design = design({"robots": [1, 2]}, **{"iterations": 2, **more})
    assert says in said(study)[1]


def test_methods_that_were_used_are_named_and_no_others(study):
    text = said(study, intervals=["bca"], metrics=["exploration_time_s"],
                contrasts={"exploration_time_s": [object()]}, knees=True, wide="W is wide.")
    assert text[1].endswith(" W is wide.")
    for word in ("999 resamples", "right-censored at that instant", "paired t test",
                 "times with the limit in place of what was censored", "Quandt 1958",
                 "What a seed adds at all values"):
        assert word in text[2], word
    plain = said(study, metrics=["collisions"], contrasts={"collisions": [object()]})[2]
    assert "paired t test" in plain and "censored" not in plain and "Quandt" not in plain


def test_a_design_that_is_sampled_says_from_what():
    of = SimpleNamespace
    shapes = {"a": methods.Span.model_validate({"key": "k.a", "from": "1 s", "to": "9 s"}),
              "b": methods.Span.model_validate({"key": "k.b", "from": "1 s", "to": "9 s",
                                                "scale": "log"})}
    study = of(design=of(parameters=shapes), is_sampled=True)
    axis = {name: Axis(name, ("1 s", "9 s"), np.array([1.0, 9.0]), "s") for name in shapes}
    assert [methods.values(study, axis[name]) for name in shapes] == [
        "between 1 s and 9 s", "between 1 s and 9 s, evenly in the logarithm"]
    many = Axis("a", tuple(map(str, range(42))), np.arange(42.0), "")
    study.is_sampled = False
    assert methods.values(study, many).endswith(", 38, 39 and 2 more")
    assert methods.values(study, axis["a"]) == "1 s, 9 s"


@pytest.mark.parametrize(("value", "text"), [
    (None, "–"), (float("nan"), "–"), (0, "0"), (1234567.0, "1 234 567"), (0.00012345, "0.0001234"),
    (10.0, "10"), (12.345, "12.35"), (1e7, "1e+07"), (9.9e-5, "9.9e-05"), (-2.5, "-2.5")])
def test_numbers_have_four_digits(value, text):
    assert formatting.number(value) == text


def test_small_words():
    assert [formatting.probability(p) for p in (None, 0.0009, 0.001, 0.25)] == [
        "–", "< 0.001", "0.001", "0.250"]
    assert [formatting.counted(count, "run") for count in (0, 1, 2)] == [
        "0 runs", "1 run", "2 runs"]
    assert formatting.counted(2, "entry", "entries") == "2 entries"
    assert [formatting.listed(words) for words in ("", "a", "ab", "abc")] == [
        "none", "a", "a and b", "a, b and c"]
    assert formatting.listed("abcd", most=2) == "a, b and 2 more"
    assert [formatting.between(*pair) for pair in ((1.0, 2.0), (None, 2.0), (1.0, None))] == [
        "[1, 2]", "–", "–"]
    assert (formatting.at_least(2.0, 1), formatting.at_least(2.0, 0), formatting.at_least(
        None, 3)) == ("≥ 2", "2", "–")
    assert [formatting.quantity(value, "b/s") for value in (999, 1e3, 3.2e6, 1e9)] == [
        "999 b/s", "1 kb/s", "3.2 Mb/s", "1 Gb/s"]
    assert (formatting.quantity(2e6, "m"), formatting.quantity(2.0, "")) == ("2 000 000 m", "2")
    assert [formatting.titled(name) for name in (
        "exploration_time_s", "resync_delay_s_mean", "efficiency_m2_per_m", "mean_cpu_percent",
        "count")] == ["exploration time [s]", "resync delay, mean [s]", "efficiency [m²/m]",
                      "mean CPU [%]", "count"]


def of_topic(study, number, latency_s=(0.1, 0.2, 0.3), lost=(), ages_s=None):
    return TopicLatency(study.vectors[number], "/map", 2, 5.0,
                        t_interval(np.array(latency_s)) if latency_s else None,
                        {"airtime": 0.05, "queue": 0.15} if latency_s else {}, lost, ages_s or {})


def test_the_latency_of_messages_is_in_milliseconds_by_part(study):
    made = latency_table(study, [of_topic(study, 0), of_topic(study, 1, ())])
    assert made.head == ["topic", "vector", "robots", "runs", "reached", "failed", "delivered",
                         "latency", "95 % interval", "n", "queue", "airtime"]
    first, second = made.rows
    assert first[:2] == ["/map", 0] and first[3:8] == [2, 1, 0, 5.0, pytest.approx(200.0)]
    assert first[9:] == [3, pytest.approx(150.0), pytest.approx(50.0)]
    assert second[7] is None and second[8].text == "–" and second[9:] == [0, None, None]
    assert made.exact_head[-3:] == ["n", "queue_s", "airtime_s"]
    exact = made.exact_rows[0]
    assert exact[:2] == ["/map", 0] and exact[6:8] == [2, 5.0]
    assert exact[8] == pytest.approx(0.2) and exact[9] < 0.2 < exact[10]


def test_ages_are_a_table_where_there_are_some(study):
    ages_s = {"waited": (0.001, 0.002), "computed": (0.003, 0.004), "on_the_way": (0.005, 0.006)}
    assert age_table(study, [of_topic(study, 0)]) is None
    made = age_table(study, [of_topic(study, 0), of_topic(study, 1, ages_s=ages_s)])
    row, = made.rows
    assert row[1] == 1 and row[6:] == [1, 2, 3, 4, 5, 6]
    assert made.head[6:8] == ["waited, median", "waited, p95"]
    assert made.head[-1] == "on the way, p95" and made.exact_head[-1] == "on_the_way_p95_s"
    assert made.exact_rows[0][6:] == [2, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006]


def test_losses_are_a_table_where_there_are_some(study):
    assert loss_table(study, [of_topic(study, 0)]) is None
    made = loss_table(study, [of_topic(study, 0, lost=(
        MeanLoss("outbox_full", "robot_*", 2.5, 0.125), MeanLoss("outage", "lan", 1.0, 0.05)))])
    assert [row[6:9] for row in made.rows] == [["outbox_full", "robot_*", 2.5],
                                               ["outage", "lan", 1.0]]
    assert (made.rows[0][9].text, made.rows[0][9].value) == ("12.50%", 0.125)
    assert made.exact_rows[1][6:] == [2, "outage", "lan", 1.0, 0.05]


def test_sobol_indices_stand_before_their_intervals(study):
    one = SobolIndices(0.5, 0.25, 0.75, 0.625, 0.5, 0.875)
    made = sobol_table(study, [one], "count")
    assert made.rows == [["robots", 0.5, "[0.25, 0.75]", 0.625, "[0.5, 0.875]"]]
    assert made.exact_rows == [["robots", *one]] and made.name == "count_sobol"


def test_an_axis_of_a_parameter():
    axes, other, bare = (Figure().subplots() for _ in range(3))
    along(axes, Axis("rate", ("1", "10", "100"), np.array([1.0, 10.0, 100.0]), ""))
    along(other, Axis("words", ("a", "b"), np.array([]), ""))
    along(bare, None)
    assert (axes.get_xscale(), other.get_xscale()) == ("log", "linear")
    assert axes.get_xticks().tolist() == [1, 10, 100] and not len(axes.get_xticks(minor=True))
    assert axes.get_xlabel() == "rate" and other.get_xlabel() == "words"
    assert [label.get_text() for label in other.get_xticklabels()] == ["a", "b"]
    assert len(bare.get_xticks()) == 0


@pytest.mark.parametrize(("values", "log", "expected"), [
    ([], False, (-np.inf, np.inf)), ([2.0, 4.0], True, (0.5, 16.0)),
    ([2.0, 4.0], False, (1.2, 4.8)), ([5.0], False, (3.0, 7.0)), ([0.0], False, (-0.4, 0.4))])
def test_intervals_make_an_axis_not_much_wider_than_the_values(values, log, expected):
    assert layout.span(np.array(values), log) == pytest.approx(expected)


def test_a_run_that_has_ended_keeps_its_last_share(study, monkeypatch):
    runs = {0: [(np.array([0.0, 10.0]), np.array([0.0, 50.0]))] * 3,
            1: [(np.array([0.0, 20.0]), np.array([0.0, 100.0]))]}
    monkeypatch.setattr(time_series, "_read", lambda study, vector: runs[vector.number])
    figure = time_series.explored_figure(study, panels(study))
    axes, = figure.axes
    ended, going = (line.get_ydata() for line in axes.get_lines())
    assert (ended[30], ended[60], ended[120]) == (25.0, 50.0, 50.0)
    assert (going[60], going[120]) == (50.0, 100.0)
    assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, 20.0), (0.0, 103.0))
    assert axes.get_xlabel() == "simulated time [s]" and axes.get_ylabel() == "explored share [%]"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "robots = 1", "robots = 2"]
    monkeypatch.setattr(time_series, "_read", lambda *_: [])
    assert time_series.explored_figure(study, panels(study)) is None


def test_the_explored_share_over_time_is_a_section_where_there_is_some(monkeypatch):
    drawn = ["a figure"]
    monkeypatch.setattr(campaign_report.time_series, "explored_figure", lambda *_: drawn[0])
    study = SimpleNamespace(is_sampled=False, metrics=["explored"])
    page = SimpleNamespace(_study=study, _drawn=[], _figure=lambda *words: " | ".join(words))
    section, = campaign_report._Report._explored(page)
    assert (section.anchor, section.title, section.level) == ("time", "Explored share over time", 2)
    assert section.body.startswith("a figure | explored_over_time | Median and quartiles over ")
    drawn[0] = None
    assert campaign_report._Report._explored(page) == []
    drawn[0], study.is_sampled = "a figure", True
    assert campaign_report._Report._explored(page) == []
