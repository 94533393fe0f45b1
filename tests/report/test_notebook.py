"""Runs, campaigns and comparisons in a notebook."""

from __future__ import annotations

import base64
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest

import desim
from desim.errors import InputError, ModelError
from desim.report.notebook import html_of
from desim.results.shown import InNotebooks


@pytest.fixture(scope="module")
def run(repository, tmp_path_factory):
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=("stop.elapsed=3 s",),
                     out=tmp_path_factory.mktemp("results"))


class Tags(HTMLParser):
    """All tags are closed in their order."""

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag not in ("img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def well_formed(text):
    tags = Tags()
    tags.feed(text)
    return tags.open == [] and "<script" not in text


def test_what_is_no_result_shows_its_repr():
    assert html_of(["<b>"]) == "<pre>[&#x27;&lt;b&gt;&#x27;]</pre>"


def test_a_run_shows_its_figures_and_its_replay(run):
    text = run._repr_html_()
    assert well_formed(text)
    assert "hello, seed 1: finished, elapsed" in text and ">explored area</td>" in text
    assert text.count('<iframe sandbox="allow-scripts"') == 1 and "<img" not in text


def test_a_run_without_a_recording_shows_its_picture(repository, tmp_path):
    run = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path,
                    overrides=("stop.elapsed=1 s", "trace.keep=none"))
    text = run._repr_html_()
    assert well_formed(text) and "<iframe" not in text
    picture = base64.b64decode(re.search(r"base64,([^\"]+)", text)[1])
    assert picture.startswith(b"\x89PNG") and len(picture) < 200_000


def test_so_does_one_whose_replay_is_large(run, monkeypatch):
    monkeypatch.setattr("desim.report.notebook._MOST_BYTES", 1000)
    assert "<img" in run._repr_html_()


def test_a_comparison(run):
    text = desim.compare(run, run)._repr_html_()
    assert well_formed(text) and "everything that happened is the same" in text
    assert text.count("<iframe") == 1


def test_damage_is_named_where_the_run_would_be_shown(repository, tmp_path):
    run = desim.run(repository / "scenarios" / "hello.yaml", overrides=("stop.elapsed=1 s",),
                    out=tmp_path / "<b>")
    (run.path / "poses.parquet").write_bytes(b"?")
    text = run._repr_html_()
    assert "damaged: poses.parquet is not what desim wrote" in text and "&lt;b&gt;" in text
    with pytest.raises(InputError):
        run.table("poses")


def test_a_failed_run_shows_its_error(repository, tmp_path, monkeypatch):
    (tmp_path / "bad_stop.py").write_text("def now(quantities):\n    return 1 / 0\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelError):
        desim.run(repository / "scenarios" / "hello.yaml", out="out",
                  overrides=("stop.when=bad_stop:now",))
    path, = (tmp_path / "out" / "hello").iterdir()
    text = desim.Run(path)._repr_html_()
    assert well_formed(text) and "hello, seed 1: failed" in text and "ZeroDivisionError" in text


def test_who_draws_is_said_by_desim_itself_and_costs_nothing_before():
    code = ("import sys, desim; from desim.results.shown import _draw; "
            "print(len(_draw), 'desim.report' in sys.modules, 'matplotlib' in sys.modules)")
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, check=True)
    assert done.stdout.split() == ["1", "False", "False"]


def test_a_notebook_falls_back_to_the_repr_where_nobody_draws(monkeypatch):
    monkeypatch.setattr("desim.results.shown._draw", [])
    assert InNotebooks()._repr_html_() is None
