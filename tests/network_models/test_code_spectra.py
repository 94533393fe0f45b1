"""The weights of the error bounds, counted anew in the trellis of the code of 802.11."""

from collections import Counter
from itertools import product

import pytest

from netmodels.radio.errors import _CODES

GENERATORS = 0o133, 0o171  # IEEE 802.11-2020, 17.3.5.6
KEPT = {"1/2": [(1, 1)], "2/3": [(1, 1), (1, 0)], "3/4": [(1, 1), (1, 0), (0, 1)]}


def after(state, bits, kept):
    """The state after the bits of one branch, and how many coded ones of it are sent."""
    weight = 0
    for bit, sent in zip(bits, kept, strict=True):
        register = bit << 6 | state
        weight += sum(keep and (register & generator).bit_count() & 1
                      for generator, keep in zip(GENERATORS, sent, strict=True))
        state = register >> 1
    return state, weight


def wrong_bits(kept, most):
    """By weight up to ``most``: the wrong input bits on all paths of that weight which leave state
    0 with one branch and come back to it with another (Frenger, Orten, Ottosson 1998)."""
    branches = {state: [(*after(state, bits, kept), sum(bits))
                        for bits in product((0, 1), repeat=len(kept))] for state in range(64)}
    found, live = Counter(), {(0, 0): (1, 0)}  # by state and weight: paths, wrong bits
    first = True
    while live:
        later: dict[tuple[int, int], tuple[int, int]] = {}
        for (state, weight), (paths, wrong) in live.items():
            for to, own, ones in branches[state]:
                if weight + own > most or first and not ones:
                    continue
                if to == 0:
                    found[weight + own] += wrong + ones * paths
                    continue
                before = later.get((to, weight + own), (0, 0))
                later[to, weight + own] = before[0] + paths, before[1] + wrong + ones * paths
        live, first = later, False
    return found


@pytest.mark.parametrize("rate", KEPT)
def test_the_weights_are_those_of_the_code(rate):
    bits, least, step, weights = _CODES[rate]
    assert bits == len(KEPT[rate])
    most = least + step * (len(weights) - 1)
    assert wrong_bits(KEPT[rate], most) == {
        least + step * k: weight for k, weight in enumerate(weights)}


def test_the_twin_another_generator_has_other_weights(monkeypatch):
    monkeypatch.setitem(globals(), "GENERATORS", (0o133, 0o165))
    with pytest.raises(AssertionError):
        test_the_weights_are_those_of_the_code("1/2")
