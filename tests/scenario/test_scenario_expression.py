"""Expressions: a small language of numbers and conditions, and nothing beyond it."""

import itertools
import sys
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError, ModelError
from desim.scenario.expression import Condition, compile, condition

VALUES = {"explored": 0.95, "collisions": 2, "time_s": 600.0}


@pytest.mark.parametrize("text, value", [
    ("1 + 2 * 3", 7), ("-(2 - 5) / 2", 1.5), ("+collisions", 2), ("1e3", 1000.0),
    ("max(collisions, 1, 7)", 7), ("min(explored, 1)", 0.95), ("abs(-3)", 3),
    ("explored > 0.9", True), ("explored > 0.9 and collisions == 0", False),
    ("explored > 0.9 and not collisions == 0 or time_s < 1", True),
    ("0 < collisions <= 2", True), ("0 < collisions < 2", False), ("time_s != 600", False),
    ("  explored >= .95 ", True), ("explored >\n 0.9", None),
])
def test_values(text, value):
    if value is None:
        with pytest.raises(InputError, match="is not an expression"):
            compile(text, VALUES)
    else:
        assert compile(text, VALUES).evaluate(VALUES) == value


@pytest.mark.parametrize("text, complaint", [
    ("explord > 1", "unknown quantity 'explord' (did you mean 'explored'?); allowed: explored, "
                    "collisions, time_s"),
    ("explored + (collisions > 1)", "'collisions > 1' is a condition where a number is needed"),
    ("explored and collisions", "'explored' is a number where a condition is needed, e.g. "
                                "'explored > 0.9'"),
    ("1e999 > explored", "'1e999' is not a finite number"),
    ("9" * 400 + " > explored", "'" + "9" * 400 + "' is not a finite number"),
    ("(" * 40 + "1" + ")" * 40 + " > 0", None),
    ("-" * 40 + "1 > 0", "'" + "-" * 40 + "1 > 0' is nested deeper than 32"),
    ("1 +" * 200 + "1", "an expression has at most 500 characters, this one 601"),
])
def test_refusals(text, complaint):
    if complaint is None:
        assert isinstance(compile(text, VALUES), Condition)  # parentheses alone nest nothing
        return
    with pytest.raises(InputError) as caught:
        compile(text, VALUES)
    assert str(caught.value) == complaint


@pytest.mark.parametrize("text", [
    "__import__('os')", "explored.real > 1", "explored[0]", "[explored]", "2 ** 9", "5 % 2",
    "5 // 2", "lambda: 1", "'a' < 'b'", "True", "max(explored)", "abs(1, 2)", "max(*explored)",
    "min(explored, key=1)", "explored if 1 < 2 else 3", "f'{explored}'", "~1", "explored is 1",
    "1 in 2", "(x := 1)", "exec('1')", "max.__class__",
])
def test_what_is_not_whitelisted(text):
    with pytest.raises(InputError, match="allowed: numbers, names"):
        compile(text, VALUES)


@pytest.mark.parametrize("text, value", [
    ("time_s / collisions", None), ("time_s / collisions > 3", None),
    ("time_s / collisions != time_s / collisions", None), ("-(1 / collisions) < 0", None),
    ("abs(1 / collisions) >= 0", None), ("max(1, 1 / collisions) > 0", None),
    ("min(nowhere_m, 1) <= 1", None), ("nowhere_m * 0 == 0", None), ("nowhere_m != 1", None),
    ("1e308 * 10 > 1", None), ("1e308 * 10 - 1e308 * 10 == 0", None),
    ("9" * 200 + " * " + "9" * 200 + " > 1", None), ("9" * 200 + " / 3 > 1", True),
    (f"{sys.float_info.max} > 1", True),
    ("not time_s / collisions > 3", None),
    # false and unknown = false, true and unknown = unknown; or likewise the other way round
    ("collisions > 0 and 1 / collisions > 0", False), ("1 / collisions > 0 and 1 > 2", False),
    ("1 / collisions > 0 and 1 < 2", None), ("1 / collisions > 0 or 1 < 2", True),
    ("1 / collisions > 0 or 1 > 2", None), ("not (1 / collisions > 0 and 1 > 2)", True),
    ("1 / collisions < 1 < 0", False), ("1 / collisions < 1 < 2", None),
])
def test_what_cannot_be_computed_is_unknown(text, value):
    values = {**VALUES, "collisions": 0, "nowhere_m": float("nan")}
    assert compile(text, values).evaluate(values) is value


def test_kleenes_tables():
    words = {True: "1 < 2", False: "2 < 1", None: "1 / 0 < 1"}
    for left, right in itertools.product(words, repeat=2):
        both = condition(f"{words[left]} and {words[right]}", {}).evaluate({})
        either = condition(f"{words[left]} or {words[right]}", {}).evaluate({})
        known = {True: 1.0, None: 0.5, False: 0.0}  # Kleene's and is the least, or the greatest
        assert known[both] == min(known[left], known[right])
        assert known[either] == max(known[left], known[right])


def test_a_function_of_the_users(tmp_path, monkeypatch):
    (tmp_path / "my_stops.py").write_text("def enough(q):\n    return q['explored'] > 0.9\n")
    (tmp_path / "my_mistake.py").write_text("1 +\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    assert condition("my_stops:enough", VALUES).evaluate(VALUES) is True
    with pytest.raises(InputError, match="cannot load function 'my_stops:enoug': module "
                       r"'my_stops' has no attribute 'enoug' \(did you mean 'enough'\?\); it "
                       "defines: enough$"):
        condition("my_stops:enoug", VALUES)
    with pytest.raises(InputError, match="cannot load function 'my_mistake:f': invalid syntax "
                       "at my_mistake.py:1$"):
        condition("my_mistake:f", VALUES)


def test_a_callable_object_whose_answer_is_neither_true_nor_false(tmp_path, monkeypatch):
    (tmp_path / "my_answers.py").write_text(
        "import numpy as np\n\n\nclass Both:\n    def __call__(self, q):\n"
        "        return np.array([1, 2])\n\n\nboth = Both()\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    with pytest.raises(ModelError) as caught:
        condition("my_answers:both", VALUES).evaluate(VALUES)
    assert str(caught.value) == (
        "stop.when: my_answers.Both (my_answers.py:4) returned array([1, 2]); wanted: true or "
        "false")


NUMBERS = st.recursive(
    st.sampled_from(list(VALUES)) | st.integers(0, 9).map(str),
    lambda inner: st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(
        lambda parts: f"({' '.join(parts)})") |
    st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(
        lambda parts: f"{parts[0]}({parts[1]}, {parts[2]})"),
    max_leaves=8)


@given(NUMBERS)
def test_agrees_with_python(text):
    try:
        expected = eval(text, {}, dict(VALUES))
    except ZeroDivisionError:
        assert compile(text, VALUES).evaluate(VALUES) is None
    else:
        assert compile(text, VALUES).evaluate(VALUES) == expected


@given(st.text(max_size=30))
def test_any_text_is_an_expression_or_an_input_error(text):
    with suppress(InputError):
        compile(text, VALUES)
