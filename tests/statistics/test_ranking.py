"""Rankings: Kendall's numbers by hand, flips that are there and flips that are luck."""

import numpy as np
import pytest

from desim.statistics.ranking import flips, kendall


def test_kendall_by_hand():
    """One of six pairs is turned over: tau (5 - 1) / 6. Of the 24 orders 1 turns none and 3 turn
    one over, so that p is 2 * 4 / 24."""
    found = kendall([1, 2, 3, 4], [1, 2, 4, 3])
    assert (found.tau, found.p) == pytest.approx((4 / 6, 8 / 24))
    assert kendall([1, 2, 3, 4], [4, 3, 2, 1]).tau == pytest.approx(-1.0)


def test_ties():
    """Five pairs in order, one tied on one side: 5 / sqrt(6 * 5)."""
    assert kendall([1, 2, 3, 4], [1, 2, 3, 3]).tau == pytest.approx(5 / 30**0.5)
    assert kendall([1, 2, 3], [5, 5, 5]) == (None, None)
    assert kendall([1], [1]) == (None, None)


def measured(means, seeds=10, noise=0.5, seed=1):
    draw = np.random.default_rng(seed)
    shared = draw.normal(0.0, 3.0, seeds)  # common random numbers
    return np.array(means)[:, None] + shared + draw.normal(0.0, noise, (len(means), seeds))


def test_a_flip_is_found_and_significant():
    found = flips(measured([1.0, 3.0, 5.0]), measured([3.0, 1.0, 5.0], seed=2))
    assert [(flip.i, flip.j, flip.significant) for flip in found] == [(0, 1, True)]
    assert found[0].first.difference.high < 0 < found[0].second.difference.low
    assert found[0].p < 0.05


def test_a_flip_on_one_side_only_is_chance():
    """The second side knows no difference between the first two settings."""
    found = flips(measured([1.0, 3.0, 5.0]), [[2.0, 2.1, 1.9, 2.2], [2.1, 1.9, 2.0, 2.1],
                                              [9.0, 9.2, 9.1, 8.9]])
    assert [(flip.i, flip.j, flip.significant) for flip in found] == [(0, 1, False)]


def test_no_flip_without_a_turn():
    assert flips(measured([1.0, 3.0, 5.0]), measured([1.0, 2.0, 9.0], seed=2)) == []
    same = np.ones((2, 5))
    assert flips(same, measured([1.0, 3.0])) == []
    # A single seed turns over, and proves nothing.
    assert [flip.significant for flip in flips([[1.0], [2.0]], [[2.0], [1.0]])] == [False]


def test_many_equal_settings_flip_and_hardly_ever_significantly():
    draw = np.random.default_rng(5)
    found = [flips(*draw.normal(size=(2, 5, 8))) for _ in range(40)]
    assert np.mean([len(turned) for turned in found]) > 3
    assert sum(flip.significant for turned in found for flip in turned) <= 1


@pytest.mark.parametrize("first, second", [([1.0, 2.0], [1.0, 2.0]),
                                           (np.ones((2, 3)), np.ones((3, 3)))])
def test_what_does_not_fit_is_refused(first, second):
    with pytest.raises(ValueError):
        flips(first, second)
