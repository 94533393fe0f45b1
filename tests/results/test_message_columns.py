"""Sums by group, against the same sums row by row."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.results.message_columns import Groups, words_of

ROWS = st.lists(st.tuples(*[st.integers(0, most) for most in (5, 3, 4, 1000)]), max_size=60)


@given(ROWS)
def test_sums_are_those_of_a_loop(rows):
    expected: dict[tuple[int, ...], int] = {}
    for *key, value in rows:
        expected[tuple(key)] = expected.get(tuple(key), 0) + value
    table = np.array(rows, np.int64).reshape(-1, 4).T
    groups = Groups(*table[:3])
    found = dict(zip(zip(*(column.tolist() for column in groups.columns), strict=True),
                     groups.sums(table[3]).tolist(), strict=True))
    assert found == expected and list(found) == sorted(expected) and len(groups) == len(expected)


WORDS = ["b", None, "a", "b"]


@pytest.mark.parametrize("column", [
    pa.chunked_array([WORDS[:2], WORDS[2:]]),
    pa.chunked_array([pa.array(WORDS[:2]).dictionary_encode(),
                      pa.array(WORDS[2:]).dictionary_encode()])], ids=["plain", "dictionaries"])
def test_words_and_their_numbers(column):
    words, numbers = words_of(column)
    assert [words[k] if k >= 0 else None for k in numbers.tolist()] == WORDS
    assert numbers[1] == -1 and len(words) == 2


def test_no_words():
    words, numbers = words_of(pa.chunked_array([], pa.string()))
    assert words == [] and len(numbers) == 0
