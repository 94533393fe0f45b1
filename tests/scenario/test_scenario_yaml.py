"""YAML 1.2: what a scalar is, and that what is written is read again."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError
from desim.scenario import yaml12


@pytest.mark.parametrize("text, value", [
    ("1e6", 1e6), ("1.5e-3", 1.5e-3), (".5", 0.5), ("5.", 5.0), ("+7", 7), ("017", 17),
    ("0o17", 15), ("0x1F", 31), ("no", "no"), ("off", "off"), ("yes", "yes"), ("y", "y"),
    ("True", True), ("false", False), ("~", None), ("null", None), ("", None),
    ("12:30:00", "12:30:00"), ("2024-01-01", "2024-01-01"), ("1_000", "1_000"), ("=", "="),
    ("'5'", "5"), ("!!str 5", "5"), ("0b1", "0b1"), ("1e", "1e"), ("20 ms", "20 ms"),
])
def test_scalars_of_the_core_schema(text, value):
    read = yaml12.parse_value(text, "text")
    assert read == value
    assert type(read) is type(value)


def test_keys_that_yaml_1_1_would_take_for_truth_values():
    assert yaml12.parse("on: 1\nno: 2\n", "text")[0] == {"on": 1, "no": 2}


def test_places_of_keys_values_and_items():
    _, places = yaml12.parse("a:\n  b: [1, 2]\nc: d\n", "file")
    assert str(places.key(("a", "b"))) == "file:2:3"
    assert str(places.value(("a", "b"))) == "file:2:6"
    assert str(places.value(("a", "b", 1))) == "file:2:10"
    assert str(places.value(("c",))) == "file:3:4"
    assert str(places.value(("a", "b", 7, "x"))) == "file:2:3"
    assert places.where("a.b.0") == "file:2:7: a.b.0"


def test_aliases_are_read_and_their_bomb_is_not():
    assert yaml12.parse("a: &x [1]\nb: *x\n", "text")[0] == {"a": [1], "b": [1]}
    bomb = "a0: &a0 [x]\n" + "".join(
        f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 9))
    with pytest.raises(InputError, match="more than 100000 keys and values"):
        yaml12.parse(bomb, "text")


DATA = st.recursive(
    st.none() | st.booleans() | st.integers(-10**30, 10**30) |
    st.floats(allow_nan=False, allow_infinity=False) |
    st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20) |
    st.sampled_from(["1e6", "no", "12:30", "0o7", "~", "", "0x1", ".5", " a ", "- a", "a: b"]),
    lambda inner: st.lists(inner, max_size=4) |
    st.dictionaries(st.text(st.characters(categories=["L", "N"]), max_size=8), inner, max_size=4))


@given(st.dictionaries(st.text(st.characters(categories=["L", "N"]), max_size=8), DATA,
                       max_size=4))
def test_what_is_dumped_is_read_again(data):
    assert yaml12.parse(yaml12.dump(data), "text")[0] == data


@given(st.text(max_size=40) | st.text("[]{}:-,&*!|>'\"%@#\n\t ab1", max_size=40))
def test_any_text_is_read_or_refused(text):
    try:
        yaml12.parse(text, "text")
    except InputError as error:
        assert all(line.startswith("text:") for line in error.args)


def test_lists_and_tuples_are_dumped_on_one_line_if_they_are_short():
    """But mappings in them have lines of their own."""
    assert yaml12.dump({"short": [1, "x"], "pair": ("0 m", 2.5), "mappings": [{"at": 1}],
                        "long": [10**9] * 7}) == (
        "short: [1, x]\npair: [0 m, 2.5]\nmappings:\n- at: 1\nlong:\n" + "- 1000000000\n" * 7)
