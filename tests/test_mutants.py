"""The mutation runs of rooms: what is changed, and what is found."""

from __future__ import annotations

import ast
import textwrap
from pathlib import Path

import pytest
from mutants import LATE, Mutant, killer, made, mutants, nearest, room_of, verdict

CODE = textwrap.dedent("""\
    def late(a: int | None, b: int) -> bool:
        if a is None and not b:
            note(a, b)
        return max(a, b) < 2
""")


def all_of(code):
    return [made(*place) for place in mutants(Path("a.py"), ast.parse(code))]


def test_each_change_is_one_and_annotations_stay():
    assert [(mutant.line, mutant.change) for mutant in sorted(all_of(CODE))] == [
        (2, "a is None  ->  a is not None"),
        (2, "a is None and (not b)  ->  a is None or not b"),
        (2, "not b  ->  b"),
        (3, "note(a, b)  ->  note(b, a)"),
        (3, "note(a, b)  ->  pass"),
        (4, "2  ->  3"),
        (4, "max(a, b) < 2  ->  max(a, b) <= 2")]
    whole = ast.unparse(ast.parse(CODE)).splitlines()
    for mutant in all_of(CODE):
        changed = [(old, new) for old, new in zip(whole, mutant.text.splitlines(), strict=True)
                   if old != new]
        assert len(changed) == 1


@pytest.mark.parametrize(("code", "expected"), [
    ("LIMIT = 1", ""), ("LIMIT = 2", "test_a.py::test_limit"), ("LIMIT =", "test_a.py"),
    ("while True: pass", LATE), ("import threading; threading.Event().wait()", LATE)])
def test_a_test_that_fails_kills(tmp_path, code, expected):
    (tmp_path / "a.py").write_text(code)
    (tmp_path / "test_a.py").write_text("import a\ndef test_limit(): assert a.LIMIT == 1\n")
    assert verdict(tmp_path, ["test_a.py"], 3) == expected


@pytest.mark.parametrize(("changed", "by"), [(1, ""), (2, "test_a.py::test_limit")])
def test_what_fails_without_a_mutant_kills_none(tmp_path, changed, by):
    """Neither a test that fails nor a file that cannot be imported."""
    (tmp_path / "a.py").write_text("LIMIT = 1")
    (tmp_path / "test_a.py").write_text(
        "import a\ndef test_no(): assert False\ndef test_limit(): assert a.LIMIT == 1\n")
    (tmp_path / "test_b.py").write_text("import b")
    mutant, unfit = Mutant(Path("a.py"), 1, "", f"LIMIT = {changed}"), []
    assert killer(tmp_path, mutant, ["test_b.py", "test_a.py"], 9, unfit) == by
    assert unfit == ["test_b.py", "test_a.py::test_no"]


def test_what_fails_in_company_of_others_kills_none(tmp_path):
    (tmp_path / "a.py").write_text("LIMIT = 1")
    (tmp_path / "test_a.py").write_text("import a\ndef test_limit(): assert a.LIMIT < 3\n")
    (tmp_path / "test_b.py").write_text("import a\ndef test_greedy(): a.LIMIT = 5\n")
    mutant, unfit = Mutant(Path("a.py"), 1, "", "LIMIT = 2"), []
    assert killer(tmp_path, mutant, ["test_b.py", "test_a.py"], 9, unfit) == ""
    assert unfit == ["test_a.py::test_limit"]


def test_a_modules_own_tests_are_the_nearest():
    files = nearest(Path("desim/middleware/tcp/scoreboard.py"), 20)
    assert files[0] == "tests/middleware/test_scoreboard.py"
    assert "tests/robot/mapping/test_tiles.py" in nearest(Path("desim/robot/mapping/tiles.py"), 9)


def test_compiled_code_is_left_out():
    assert {path.name for path in room_of("netmodels/switch")} == {
        "__init__.py", "compiled_queues.py", "switch.py", "times.py", "trains.py"}
    with pytest.raises(SystemExit, match="^mutants: there is no nowhere and no desim/nowhere$"):
        room_of("nowhere")
