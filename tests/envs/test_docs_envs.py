"""The page of envs and its example: its programs run, its table and its learners are real."""

import re
import runpy
from contextlib import chdir, redirect_stdout
from io import StringIO

import numpy as np
import pytest
from doc_pages import blocks

pytest.importorskip("pettingzoo", reason="PettingZoo is not installed (pip install 'desim[envs]')")

PAGE, EXAMPLE = "docs/envs.md", "scenarios/learning/talk_less.py"


@pytest.fixture(scope="module")
def example(repository):
    return runpy.run_path(str(repository / EXAMPLE))


def test_the_programs_of_the_page_run(repository):
    printed = StringIO()
    with chdir(repository), redirect_stdout(printed):
        for language, text in blocks(repository / PAGE):
            assert language == "python"
            exec(compile(text, PAGE, "exec"), {})
    assert re.fullmatch(r"[0-9a-f]{32}\n", printed.getvalue())


def test_the_page_has_the_table_that_the_example_prints(repository, example, capsys):
    example["table"]()
    page = (repository / PAGE).read_text()
    assert f"\n\n{capsys.readouterr().out}\n" in page


def test_the_figure_is_drawn_from_committed_data(example, tmp_path):
    example["figure"](tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 10_000


def test_learners_talk_less_at_equal_exploration_time(example):
    results = example["evaluation"]()
    _, always_s, always_kb = results["always"].mean(axis=0)
    learned = np.array([rows.mean(axis=0) for name, rows in results.items() if "learner" in name])
    assert len(learned) == 5
    assert (learned[:, 2] < 0.6 * always_kb).all()
    assert (learned[:, 1] < always_s + 1).all()
    assert results["never"][:, 1].mean() > 1.4 * always_s


def test_a_generation_of_a_learner(example):
    env = example["environment"]()
    rows = list(example["learned"](env, 0, generations=2, candidates=3, episodes=1))
    assert [row["generation"] for row in rows] == [0, 1]
    again = list(example["learned"](env, 0, generations=2, candidates=3, episodes=1))
    assert again == rows
