"""Sobol's indices against closed forms."""

import numpy as np
import pytest

from desim.statistics.sensitivity import indices, saltelli

A, B = 7.0, 0.1


def ishigami(unit):
    x = np.pi * (2 * unit - 1)
    return np.sin(x[:, 0]) + A * np.sin(x[:, 1])**2 + B * x[:, 2]**4 * np.sin(x[:, 0])


def closed_form():
    """Ishigami and Homma 1990: parts of the variance of parameters 1, 2 and of 1 with 3."""
    first = (1 + B * np.pi**4 / 5)**2 / 2
    second = A**2 / 8
    both = B**2 * np.pi**8 * (1 / 18 - 1 / 50)
    whole = first + second + both
    return (np.array([first, second, 0.0]) / whole,
            np.array([first + both, second, both]) / whole)


def test_ishigami():
    found = indices(ishigami(saltelli(1024, 3, seed=1)), 3)
    for index, first, total in zip(found, *closed_form(), strict=True):
        assert (index.first, index.total) == pytest.approx((first, total), abs=0.03)
        assert index.first_low <= first <= index.first_high
        assert index.total_low <= total <= index.total_high
        assert index.total_high - index.total_low < 0.2


def test_the_error_falls_with_the_points():
    def error(points):
        found = indices(ishigami(saltelli(points, 3)), 3, resamples=99)
        return max(abs(index.total - total)
                   for index, total in zip(found, closed_form()[1], strict=True))

    assert error(8192) < 0.01 < error(64)


def test_the_twin_with_columns_mixed_up_does_not_agree():
    f = ishigami(saltelli(1024, 3, seed=1)).reshape(-1, 5)
    found = indices(f[:, [0, 2, 1, 3, 4]].ravel(), 3)
    assert abs(found[0].total - closed_form()[1][0]) > 0.05


def test_a_sum_has_equal_first_and_total_indices():
    """Parts 1, 4 and 9 of 14 of the variance; a mean far from zero does not matter."""
    rows = saltelli(512, 4)
    for index, part in zip(indices(1e4 + rows @ [1.0, 2.0, 3.0, 0.0], 4), (1, 4, 9, 0),
                           strict=True):
        assert (index.first, index.total) == pytest.approx((part / 14, part / 14), abs=0.02)


def test_the_design_by_its_definition():
    rows = saltelli(8, 3, seed=5).reshape(8, 5, 3)
    assert ((rows >= 0) & (rows < 1)).all()
    for i in range(3):
        assert (rows[:, 1 + i, i] == rows[:, 4, i]).all()
        others = [k for k in range(3) if k != i]
        assert (rows[:, 1 + i, others] == rows[:, 0, others]).all()
    # Balanced: one point in each eighth of every axis.
    for half in (rows[:, 0], rows[:, 4]):
        assert (np.sort(np.floor(8 * half), axis=0) == np.arange(8)[:, None]).all()
    assert (saltelli(8, 3, seed=5) == rows.reshape(-1, 3)).all()
    assert (saltelli(8, 3, seed=6) != rows.reshape(-1, 3)).any()


def test_what_does_not_vary_has_no_index():
    assert indices(np.full(40, 0.1), 3) == [(None,) * 6] * 3


def test_what_is_no_design_is_refused():
    with pytest.raises(ValueError, match="power of two"):
        saltelli(100, 3)
    for values, dimensions in (([1.0] * 11, 3), ([1.0] * 5, 3)):
        with pytest.raises(ValueError, match="for each point"):
            indices(values, dimensions)
