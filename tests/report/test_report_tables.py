"""Tables for the page, for LaTeX, for programs."""

import csv
import shutil
import subprocess

import pytest
from synthetic import campaign, design, timed

from desim.report.campaign import formatting
from desim.report.campaign.campaign_report import write
from desim.report.campaign.numbers import Estimates, Study
from desim.report.campaign.tables.overview import all_metrics
from desim.report.campaign.tables.table import ReportTable, Shown, as_csv, as_html, as_latex

pytestmark = pytest.mark.usefixtures("svg_alone")

ODD = ReportTable("odd", "50 % of a_b & c: [m²] {x} ~ ^ \\ $ # –", ["a_b [m²]", "words & more"],
            [[1234567.0, "100 % <x>"], [None, "[a] – b"], [Shown("> 5 000", 5000.0), "c_d"]],
            ["a", "b"], [[1234567.125, "x,y"], [None, "z"], [5000, ""]])


def test_csv_has_every_digit(tmp_path):
    as_csv(ODD, tmp_path)
    with open(tmp_path / "odd.csv", newline="") as file:
        assert list(csv.reader(file)) == [["a", "b"], ["1234567.125", "x,y"], ["", "z"],
                                          ["5000", ""]]


def test_the_page_sorts_by_values_not_by_words():
    text = as_html(ODD)
    assert 'data-v="5000">&gt; 5 000' in text
    assert "100 % &lt;x&gt;" in text


def test_many_rows_are_left_to_the_file():
    rows = [[float(i)] for i in range(1000)]
    text = as_html(ReportTable("long", "Long.", ["x"], rows, ["x"], rows))
    assert text.count("<tr>") == 151
    assert "850 more rows in tables/long.csv" in text


@pytest.mark.parametrize("value, text", [
    (0.0, "0"), (None, "–"), (float("nan"), "–"), (1234.5678, "1 235"), (0.012345, "0.01235"),
    (99.99999, "100"), (-3.0, "-3"), (1e-9, "1e-09"), (1234567.0, "1 234 567"), (20000.0, "20 000"),
    (0.5, "0.5")])
def test_numbers_have_four_digits(value, text):
    assert formatting.number(value) == text


@pytest.mark.parametrize("metric, title", [
    ("mean_cpu_percent", "mean CPU [%]"), ("mean_ram_mb", "mean RAM [MB]"),
    ("mean_rx_kBps", "mean received [kB/s]"), ("mean_tx_kBps", "mean sent [kB/s]"),
    ("resync_delay_s_mean", "resync delay, mean [s]"), ("map_quality", "map quality")])
def test_titles_are_words_with_a_unit(metric, title):
    assert formatting.titled(metric) == title


def compiled(folder, sources):
    latex = shutil.which("pdflatex")
    if latex is None:
        pytest.skip("there is no pdflatex")
    inputs = "\n".join(rf"\input{{{source}}}" for source in sources)
    (folder / "all.tex").write_text(
        "\\documentclass{article}\n\\usepackage[T1]{fontenc}\n\\usepackage{array,booktabs,longtable}\n"
        f"\\begin{{document}}\n{inputs}\n\\end{{document}}\n")
    return subprocess.run([latex, "-interaction=nonstopmode", "-halt-on-error", "all.tex"],
                          cwd=folder, capture_output=True, text=True)


def test_latex_breaks_captions_between_words_but_not_numbers(tmp_path):
    as_latex(ReportTable("long", "Mean of 1 234 567 runs in 20 cases of 2010 at 5 %.",
                          ["a b"], [["x y"], [12345.0]], [], []), tmp_path)
    text = (tmp_path / "long.tex").read_text()
    assert r"\caption{Mean of 1\,234\,567 runs in 20 cases of 2010 at 5 \%.}" in text
    assert r"a b \\" in text and r"x y \\" in text and r"12\,345 \\" in text


def test_latex_folds_long_cells(tmp_path):
    rows = [["a", "160\nknee 4 Mb/s", "word " * 20, 1.0]]
    as_latex(ReportTable("folded", "Folded.", list("abcd"), rows, [], []), tmp_path)
    text = (tmp_path / "folded.tex").read_text()
    long = r">{\raggedright\arraybackslash}p{0.35\linewidth}"
    assert text.startswith("% \\usepackage{array,booktabs,longtable}\n"
                           rf"\begin{{longtable}}{{l{long}{long}r}}")
    assert r"160\newline knee 4 Mb/s & word" in text
    done = compiled(tmp_path, ["folded"])
    assert done.returncode == 0, done.stdout[-2000:]


def test_latex_compiles_with_odd_letters(tmp_path):
    as_latex(ODD, tmp_path)
    done = compiled(tmp_path, ["odd"])
    assert done.returncode == 0, done.stdout[-2000:]


def test_latex_of_a_report_compiles(tmp_path):
    axes = {"rate": ["1 Mb/s", "3 Mb/s"], "strategy": ["near_est", "far & wide"]}
    campaign(tmp_path, axes, 4, lambda levels, k: timed(
        None if k == 0 else 100.0 * k + len(levels["strategy"]), explored_m2=k))
    write(tmp_path, design(axes, iterations=4, report={"metrics": ["exploration_time_s",
                                                                   "explored_m2"]}))
    folder = tmp_path / "report" / "tables"
    assert not (folder / "metrics_by_vector.tex").exists()
    assert (folder / "parameters.tex").exists()
    done = compiled(folder, sorted(file.stem for file in folder.glob("*.tex")))
    assert done.returncode == 0, done.stdout[-2000:]


def test_the_page_has_the_metrics_that_differ_and_folds_the_others(tmp_path):
    """Of two rates; ``load`` is apart, ``noise`` overlaps, of one topic's ``sent`` nobody asked."""
    axes = {"rate": ["1 Mb/s", "3 Mb/s"]}

    def outcome(levels, k):
        fast = levels["rate"] == "3 Mb/s"
        return timed(100.0 + k, load=10.0 * fast + k, noise=0.1 * fast + k, steady=7.0,
                     **{"messages_by_topic_/map_sent": 100.0 * fast + k})

    folder = campaign(tmp_path, axes, 4, outcome)
    study = Study(folder, design(axes, iterations=4, report={"metrics": ["exploration_time_s"]}))
    first, others = all_metrics(study, Estimates(study))
    head = ["vector", "rate", "runs", "reached", "failed"]
    assert first.head == [*head, "exploration time [s]", "load"]
    assert {"noise", "steady"} <= set(others.head) and not {"load"} & set(others.head)
    assert {"load", "noise", "steady", "messages_by_topic_/map_sent"} <= set(first.exact_head)
