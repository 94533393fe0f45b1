"""Curves with a plateau at either end have two bends, others as many as ``breakpoint_of`` sees."""

import numpy as np
import pytest

from desim.statistics.knee import breakpoint_of
from desim.statistics.two_knees import knees_of

LOADS = np.repeat(np.arange(1.0, 11.0), 10)  # 10 seeds at each of 10 loads


def stepped(seed, noise=0.5, ends=(3.6, 7.3)):
    """Flat, falling, flat."""
    draw = np.random.default_rng(seed)
    return -2.0 * np.clip(LOADS, *ends) + draw.normal(size=100) * noise


def test_the_intervals_hold_both_bends():
    """100 experiments, standard error 2.2 %. One bend alone would not."""
    found = [knees_of(LOADS, stepped(seed), seed=seed, resamples=299) for seed in range(100)]
    assert {len(knees) for knees in found} == {2}
    for which, truth in enumerate((3.6, 7.3)):
        assert np.mean([knees[which].low <= truth <= knees[which].high
                        for knees in found]) >= 0.9
        assert np.mean([knees[which].high - knees[which].low for knees in found]) < 1.5
    one = [breakpoint_of(LOADS, stepped(seed), resamples=299) for seed in range(100)]
    assert np.mean([knee is not None and knee.low <= 7.3 <= knee.high for knee in one]) < 0.5

def test_one_bend_stays_one():
    """100 experiments, standard error 2.2 %: 5 % have a second one by chance."""
    found = [knees_of(LOADS, stepped(seed, ends=(0.0, 6.3)), seed=seed, resamples=199)
             for seed in range(100)]
    assert np.mean([len(knees) == 2 for knees in found]) <= 0.11
    assert min(len(knees) for knees in found) == 1


def test_a_line_has_none():
    """100 experiments: 5 % have one by chance, 2.5 % two at once."""
    found = [knees_of(LOADS, 2 * LOADS + np.random.default_rng(seed).normal(size=100), seed=seed,
                      resamples=199) for seed in range(100)]
    assert np.mean([len(knees) > 0 for knees in found]) <= 0.13
    assert knees_of(LOADS, 2 * LOADS) == knees_of(LOADS, 0 * LOADS) == ()


def test_bends_that_are_alike():
    """A single one does not see them: in the middle the curve is as straight as at its ends."""
    rates_bps = np.repeat(10.0 ** np.arange(4.0, 9.5, 0.5), 2)
    times_s = np.clip(1000 - 400 * (np.log10(rates_bps) - 5.5), 200, 1000) + 0.01 * (
        np.arange(22) % 2)
    first, second = knees_of(rates_bps, times_s, log=True)
    assert (first.at, second.at) == pytest.approx((10**5.5, 10**7.5), rel=0.01)
    slopes = first.slope_before, first.slope_after, second.slope_before, second.slope_after
    assert slopes == pytest.approx((0.0, -400.0, -400.0, 0.0), abs=0.1)


def test_blocks_are_taken_out():
    seeds = np.tile(np.arange(10), 10)
    shifts = np.random.default_rng(1).normal(size=10)[seeds] * 5.0
    plain, blocked = (knees_of(LOADS, stepped(0) + add, blocks=seeds) for add in (0.0, shifts))
    for one, other in zip(plain, blocked, strict=True):
        assert one == pytest.approx(other)


def test_order_and_scale_do_not_matter():
    shuffled = np.random.default_rng(2).permutation(100)
    metric = stepped(4)
    found = knees_of(LOADS, metric, resamples=299)
    assert knees_of(LOADS[shuffled], metric[shuffled], resamples=299) == found
    large = knees_of(LOADS * 1e6, metric * 1e-6, resamples=299)
    assert [knee.at for knee in large] == pytest.approx([1e6 * knee.at for knee in found])


def test_few_loads_have_one_bend_at_most():
    few = LOADS <= 6
    assert len(knees_of(LOADS[few], stepped(0, ends=(2.0, 4.0))[few])) == 1
