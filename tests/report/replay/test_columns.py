"""Columns of integers survive the way into a page, whatever their size and sign."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from unpacking import unpacked

from desim.report.replay.columns import Columns


def round_trip(values):
    columns = Columns()
    columns.add("a", np.array([7]))
    columns.add("b", values)
    found = unpacked(columns.index, columns.text())
    assert found["a"].tolist() == [[7]]
    return found["b"]


@given(st.lists(st.integers(-2**50, 2**50)))
def test_integers(values):
    assert round_trip(np.array(values, np.int64)).tolist() == [values]


@given(st.integers(0, 5), st.integers(0, 20), st.integers(1, 2**40))
def test_rows(rows, count, largest):
    values = np.arange(rows * count).reshape(rows, count) * 977 % largest - largest // 2
    assert (round_trip(values) == values).all()


@pytest.mark.parametrize("shape", [(1, 0), (1, 7), (1, 8), (3, 13)])
def test_bits(shape):
    values = np.arange(shape[0] * shape[1]).reshape(shape) * 7 % 3 == 0
    columns = Columns()
    columns.add_bits("a", values)
    assert (unpacked(columns.index, columns.text())["a"] == values).all()


def test_steady_motion_takes_little_space():
    columns = Columns()
    columns.add("x", np.arange(0, 1_000_000, 100))
    assert len(columns.text()) < 100
