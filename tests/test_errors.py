"""Errors survive being made again, by SimPy or on the way between processes."""

import pickle

import pytest

from desim.errors import (
    DesimError,
    InputError,
    KernelError,
    ModelError,
    below,
    described,
    did_you_mean,
)


@pytest.mark.parametrize("kind", [DesimError, InputError, KernelError, ModelError])
def test_an_error_can_be_made_again_from_its_args(kind):
    error = kind("first", "second")
    for again in (type(error)(*error.args), pickle.loads(pickle.dumps(error))):
        assert (type(again), again.args, str(again)) == (kind, error.args, str(error))


def test_complaints_stand_one_in_a_line():
    assert str(InputError("a.yaml:1:1: $.x: wrong", "a.yaml:2:1: $.y: wrong")) == (
        "a.yaml:1:1: $.x: wrong\na.yaml:2:1: $.y: wrong")


def test_a_plug_in_names_its_own_keys_and_others_where_it_stands():
    with pytest.raises(InputError) as caught, below("network.media.lan"), below(".rules.1"):
        raise InputError(".groups.0: is empty", "nobody is left")
    assert caught.value.args == ("network.media.lan.rules.1.groups.0: is empty",
                                 "network.media.lan.rules.1: nobody is left")


def test_the_nearest_word_is_suggested():
    assert did_you_mean("ratee", ["rate", "range"]) == " (did you mean 'rate'?)"
    assert did_you_mean("zzz", ["rate", "range"]) == ""


@pytest.mark.parametrize("error, expected", [
    (ValueError("oh no"), "ValueError: oh no"), (ValueError("oh\r\nno"), "ValueError: oh"),
    (ValueError(), "ValueError"), (SystemExit("bye"), "SystemExit: bye")])
def test_foreign_errors_are_described_in_one_line(error, expected):
    assert described(error) == expected
