"""YAML of strangers is refused before it is built, and all else is read as PyYAML reads it."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from desim import outside_yaml

VALUES = st.recursive(st.none() | st.booleans() | st.integers() | st.text(max_size=5),
                      lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
                          st.text(max_size=3), inner, max_size=3), max_leaves=20)


@given(VALUES)
def test_what_is_small_is_read_as_it_stands(value):
    assert outside_yaml.read(yaml.safe_dump(value)) == value


@pytest.mark.parametrize("text, why", [
    ("[" * 100_000, "nested too deeply; at most 100 lists and mappings"),
    ("{a: " * 101, "nested too deeply; at most 100 lists and mappings"),
    ("- " * 101, "nested too deeply; at most 100 lists and mappings"),
    ("".join(f"k{n}: 0\n" for n in range(50_001)), "more than 100000 keys and values, aliases "
                                                     "written out"),
    ("a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [{f'*a{n - 1}, ' * 9}]\n" for n in range(1, 9)),
     "more than 100000 keys and values, aliases written out"),
    ("a: 1" + ":59" * 5000, "a value of 15001 characters without quotes; at most 10000"),
    ("a: !!int '1" + ":59" * 5000 + "'", "a value of 15001 characters without quotes; at most "
                                         "10000")])
def test_what_would_take_long_is_refused(text, why):
    with pytest.raises(ValueError, match=f"^{why}$"):
        outside_yaml.read(text)


def test_just_below_the_limits_it_is_read():
    assert outside_yaml.read("[" * 100 + "]" * 100) is not None
    assert len(outside_yaml.read("".join(f"k{n}: 0\n" for n in range(49_999)))) == 49_999
    assert outside_yaml.read("a: '" + "x" * 20_000 + "'") == {"a": "x" * 20_000}
    assert outside_yaml.read("a: &a [*a]")["a"]
