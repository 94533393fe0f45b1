"""Commands that read hostile files, in processes under limits and an audit hook.

A few of those that ``tools/fuzz.py hostile`` plays, and what the hook must see.
"""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))

from guarded import Guard, _is_evil


@pytest.fixture(scope="module")
def guard():
    with Guard() as guard:
        yield guard


@pytest.mark.parametrize("kind", ["design", "carmen", "bag_folder"])
def test_a_hostile_file_is_refused_in_words(guard, tmp_path, kind):
    for words in guard.made(tmp_path / "case", kind, 0):
        end = guard.measured(tmp_path / "case", words)
        assert not end.wrong and end.code == 2, end


@pytest.mark.parametrize("number", range(int(os.environ.get("HOSTILE_FOLDERS", "4"))))
def test_a_hostile_campaign_is_read_as_data(guard, tmp_path, number):
    for words in guard.made(tmp_path / "case", "campaign_folder", number):
        end = guard.measured(tmp_path / "case", words)
        assert not end.wrong, (words, end)


def test_the_hook_sees_code_in_the_folder(guard, tmp_path):
    (tmp_path / "evil.py").write_text("class Evil: pass\n")
    (tmp_path / "s.yaml").write_text(
        f"name: x\nstop: {{elapsed: 1 s}}\ncoordination: {{strategy: '{tmp_path}/evil:Evil'}}\n")
    end = guard.measured(tmp_path, ["run", "s.yaml", "--quiet", "--out", "out"])
    assert end.wrong == "forbidden" and "runs" in end.said


def test_the_hook_sees_what_is_written_elsewhere(guard, tmp_path):
    end = guard.measured(tmp_path, ["new", "hello", "--to", "."])
    assert end.wrong == "forbidden" and "forbidden: " in end.said


def test_markup_that_a_page_takes_for_its_own_is_seen(tmp_path):
    for text, evil in (("<p onclick=x>", True), ("<script> evil()</script>", True),
                       ("<evil>", True), ("&lt;evil&gt; <script>a = 'evil()'</script>", False)):
        (tmp_path / "page.html").write_text(text)
        assert _is_evil(tmp_path / "page.html") == evil
