"""Commands that read hostile files, in processes under limits and an audit hook.

A few of those that ``tools/hostile.py`` plays, and what the hook must see.
"""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))

from guarded import measured
from hostile_files import KINDS, bag_folder, carmen, design, hostile


@pytest.mark.parametrize("kind", [design, carmen, bag_folder])
def test_a_hostile_file_is_refused_in_words(tmp_path, kind):
    (tmp_path / "out").mkdir()
    name, commands = hostile(tmp_path, KINDS.index(kind))
    assert name == kind.__name__
    for words in commands:
        end = measured(tmp_path, words, 10**9)  # memory is not judged here
        assert not end.wrong and end.code == 2, end


def test_the_hook_sees_code_in_the_folder(tmp_path):
    (tmp_path / "evil.py").write_text("class Evil: pass\n")
    (tmp_path / "s.yaml").write_text(
        f"name: x\nstop: {{elapsed: 1 s}}\ncoordination: {{strategy: '{tmp_path}/evil:Evil'}}\n")
    end = measured(tmp_path, ["run", "s.yaml", "--quiet", "--out", "out"], 0)
    assert end.wrong == "forbidden" and "runs" in end.said


def test_the_hook_sees_what_is_written_elsewhere(tmp_path):
    end = measured(tmp_path, ["new", "hello", "--to", "."], 0)
    assert end.wrong == "forbidden" and "forbidden: " in end.said
