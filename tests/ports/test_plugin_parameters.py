"""Parameter blocks, the names in them, and the order of hosts."""

import random

import pytest
from pydantic import ValidationError

from desim.ports import Params, natural_key, tuples, with_preset, yaml_key


@pytest.mark.parametrize("field, key", [("rate_bps", "rate"), ("power_dbm", "power"),
                                        ("speed_mps", "speed"), ("burst_bytes", "burst"),
                                        ("hops", "hops"), ("m_per_s", "m_per_s")])
def test_a_key_is_the_name_without_its_unit(field, key):
    assert yaml_key(field) == key


class Rates(Params):
    """Parameters with a default that is checked as given ones are."""

    rate_bps: int = 8


def test_parameters_stay_as_they_are_made():
    rates = Rates(rate=9)
    assert rates.rate_bps == 9
    with pytest.raises(ValidationError, match="frozen"):
        rates.rate_bps = 10
    with pytest.raises(ValidationError, match="Extra inputs are not permitted"):
        Rates(rates=9)


def test_a_wrong_default_is_an_error():
    class Wrong(Params):
        rate_bps: int = "fast"

    with pytest.raises(ValidationError, match="valid integer"):
        Wrong()


def test_tuples_stand_in_for_lists_at_any_depth():
    assert tuples({"a": [1, [2, {"b": [3]}]], "c": "de"}) == {"a": (1, (2, {"b": (3,)})), "c": "de"}


PRESETS = {"11a": {"rate": 54, "power": 15}, "11b": {"rate": 11}}


@pytest.mark.parametrize("given, found", [
    ({}, {"rate": 54, "power": 15}),
    ({"standard": "11b"}, {"rate": 11, "standard": "11b"}),
    ({"rate": 6}, {"rate": 6, "power": 15}),
    ({"standard": "11z", "rate": 1}, {"standard": "11z", "rate": 1}),
    ({"standard": ["11b"]}, {"standard": ["11b"]}),
    ("11b", "11b")])
def test_a_preset_fills_in_what_is_not_given(given, found):
    assert with_preset(given, "standard", "11a", PRESETS) == found


def test_numbers_in_names_are_sorted_as_numbers():
    names = ["2", "10", "base", "robot", "robot_1", "robot_01b", "robot_2", "robot_10", "robot_a"]
    mixed = names[:]
    random.Random(1).shuffle(mixed)
    assert sorted(mixed, key=natural_key) == names
