"""Random numbers by name, and noise as a function of a counter."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.engine.streams import Streams
from desim.errors import ModelError
from desim.ports import kernels

NAMES = [("robot", i, sensor) for i in (1, 2, 3) for sensor in ("odometry", "lidar")]
WORD = st.integers(0, 2**64 - 1)


# ---------------------------------------------------------------------------------------- by name


@given(st.permutations(NAMES))
def test_who_asks_first_does_not_matter(shuffled):
    in_order, in_disorder = Streams(7), Streams(7)
    expected = {name: in_order(*name).random(3).tolist() for name in NAMES}
    generators = {name: in_disorder(*name) for name in shuffled}
    assert {name: generators[name].random(3).tolist() for name in NAMES} == expected


def test_common_random_numbers_one_more_robot_moves_no_other_stream():
    small, large = Streams(7), Streams(7)
    large("robot", 31, "odometry").random(1000)
    large("network", "lan").random(1000)
    assert small("robot", 1, "odometry").random() == large("robot", 1, "odometry").random()


def test_asking_again_goes_on_where_the_stream_is():
    streams = Streams(0)
    assert streams("a", 1) is streams("a", 1)


@pytest.mark.parametrize("one, other", [
    (("a/b", "c"), ("a", "b/c")), ((3,), ("3",)), (("a",), ("a", "")), (("a", "b"), ("b", "a")),
    (("ab",), ("a", "b")), (("a', 'b",), ("a", "b")), ((1, 23), (12, 3)), ((-1,), (1,)),
])
def test_different_names_are_different_streams(one, other):
    streams = Streams(0)
    assert streams.key(*one) != streams.key(*other)
    assert streams(*one).random() != streams(*other).random()
    assert streams.integer(2**64, *one) != streams.integer(2**64, *other)


def test_no_two_of_many_keys_are_equal():
    keys = [Streams(seed).key("robot", i, "lidar") for seed in range(20) for i in range(500)]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("part", [np.int64(3), 3.0, True, None, ("a",)])
def test_a_name_that_has_no_one_spelling_is_refused(part):
    streams = Streams(0)
    streams("robot", 3)
    for ask in (streams, streams.key, lambda *name: streams.integer(10, *name)):
        with pytest.raises(ModelError, match="consists of str and int"):
            ask("robot", part)


def test_keys_and_integers_are_pure_functions_of_seed_and_name():
    streams = Streams(5)
    before = streams.key("x"), streams.integer(1000, "x")
    streams("x").random(10)
    assert (streams.key("x"), streams.integer(1000, "x")) == before
    assert Streams(6).key("x") != before[0]
    values = [streams.integer(7, "phase", i) for i in range(500)]
    assert sorted(set(values)) == list(range(7))


def test_known_answers():
    streams = Streams(1)
    assert streams.key("robot", 3, "lidar") == 11593023714369883917
    assert streams.integer(10**9, "timer") == 141543745
    assert streams("robot", 3, "odometry").integers(0, 2**32, 4).tolist() == [
        3031426597, 3468279298, 2168294465, 3195765600]


# ------------------------------------------------------------------------------- by counter


def splitmix64(key: int, counter: int) -> int:
    """The reference: output number ``counter`` of SplitMix64 seeded with ``key``."""
    mask = 2**64 - 1
    z = (key + (counter + 1) * 0x9E3779B97F4A7C15) & mask
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 & mask
    z = (z ^ z >> 27) * 0x94D049BB133111EB & mask
    return z ^ z >> 31


@given(WORD, WORD)
def test_mix_is_splitmix64(key, counter):
    assert kernels.mix(np.uint64(key), np.uint64(counter)) == splitmix64(key, counter)


def test_mix_gives_the_published_first_numbers_of_splitmix64():
    assert [kernels.mix(np.uint64(1234567), np.uint64(k)) for k in range(3)] == [
        6457827717110365317, 3203168211198807973, 9817491932198370423]


@given(WORD, WORD)
def test_uniform_and_normal_are_what_their_formulas_say(key, counter):
    def u(k):
        return ((splitmix64(key, k % 2**64) >> 12) + 0.5) / 2**52

    assert kernels.uniform(np.uint64(key), np.uint64(counter)) == u(counter)
    expected = math.sqrt(-2 * math.log(u(2 * counter))) * math.cos(2 * math.pi * u(2 * counter + 1))
    assert kernels.normal(np.uint64(key), np.uint64(counter)) == pytest.approx(
        expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("wanted", [0, 2**64 - 1])
def test_uniform_is_never_0_or_1(wanted):
    # The finalizer is a bijection; these keys make it give its extreme values at counter 0.
    mask = 2**64 - 1
    z = wanted
    z = z ^ z >> 31 ^ z >> 62
    z = z * pow(0x94D049BB133111EB, -1, 2**64) & mask
    z = z ^ z >> 27 ^ z >> 54
    z = z * pow(0xBF58476D1CE4E5B9, -1, 2**64) & mask
    z = z ^ z >> 30 ^ z >> 60
    key = np.uint64((z - 0x9E3779B97F4A7C15) & mask)
    assert kernels.mix(key, np.uint64(0)) == wanted
    assert 0.0 < kernels.uniform(key, np.uint64(0)) < 1.0


def test_moments_of_normal():
    # n = 200 000 independent draws: the mean has standard error 1/sqrt(n), the variance
    # sqrt(2/n), the third and fourth moments sqrt(15/n) and sqrt(96/n). 4.5 standard errors are
    # exceeded by chance once in 150 000 seeds; this seed is fixed.
    n = 200_000
    key = np.uint64(Streams(1).key("moments"))
    x = np.array([kernels.normal(key, np.uint64(k)) for k in range(n)])
    for value, expected, variance in ((x.mean(), 0, 1), (np.mean(x**2), 1, 2),
                                      (np.mean(x**3), 0, 15), (np.mean(x**4), 3, 96)):
        assert abs(value - expected) < 4.5 * math.sqrt(variance / n)
    # Neighbours in the sequence are uncorrelated, and so are equal counters of two keys.
    other = np.uint64(Streams(1).key("moments, too"))
    y = np.array([kernels.normal(other, np.uint64(k)) for k in range(n)])
    for product in (x[1:] * x[:-1], x * y):
        assert abs(product.mean()) < 4.5 / math.sqrt(n)
