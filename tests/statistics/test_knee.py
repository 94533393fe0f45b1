"""Knees that were put in are found within their intervals; on a line there is none."""

import numpy as np
import pytest

from desim.statistics.knee import breakpoint_of

LOADS = np.repeat(np.arange(1.0, 11.0), 10)  # 10 seeds at each of 10 loads


def bent(knee, noise, seed):
    return np.minimum(LOADS, knee) + np.random.default_rng(seed).normal(size=100) * noise


@pytest.mark.parametrize("noise", [0.5, 0.15 + 0.1 * LOADS], ids=["even", "growing"])
def test_the_interval_holds_the_knee(noise):
    """200 experiments, standard error 1.5 %; not below 91 %. The interval is worth something, too:
    it is less than two loads wide."""
    found = [breakpoint_of(LOADS, bent(6.3, noise, seed), seed=seed, resamples=299)
             for seed in range(200)]
    assert None not in found
    assert np.mean([knee.low <= 6.3 <= knee.high for knee in found]) >= 0.91
    assert np.mean([knee.high - knee.low for knee in found]) < 2.0
    # The twin: a knee put 10 % elsewhere is not held that often.
    assert np.mean([knee.low <= 6.93 <= knee.high for knee in found]) < 0.7


@pytest.mark.parametrize("noise", [0.5, 0.1 * LOADS], ids=["even", "growing"])
def test_a_line_has_no_knee(noise):
    """200 experiments, standard error 1.5 %: 5 % are found by chance."""
    found = [breakpoint_of(LOADS, bent(np.inf, noise, seed), seed=seed, resamples=199)
             for seed in range(200)]
    assert sum(knee is not None for knee in found) / 200 <= 0.09


def test_without_noise():
    knee = breakpoint_of(LOADS, 5.0 + np.minimum(LOADS, 6.0))
    assert knee.at == 6.0
    assert (knee.low, knee.high) == pytest.approx((6.0, 6.0), abs=7 / 400)
    assert (knee.slope_before, knee.slope_after) == pytest.approx((1.0, 0.0), abs=1e-12)
    assert (knee.p, knee.n) == (1 / 2000, 100)
    for line in (2 * LOADS + 1, 0.1 * np.ones_like(LOADS), 0 * LOADS):
        assert breakpoint_of(LOADS, line) is None


def test_common_random_numbers_narrow_the_interval():
    """Seeds that differ by more than the knee bends; 200 experiments. For their mean width 40 are
    enough."""
    seeds = np.tile(np.arange(10), 10)
    held, narrower = [], []
    for seed in range(200):
        metric = bent(6.3, 0.5, seed) + np.random.default_rng([seed, 1]).normal(size=10)[seeds]
        blocked = breakpoint_of(LOADS, metric, seed=seed, resamples=299, blocks=seeds)
        held.append(blocked.low <= 6.3 <= blocked.high)
        if seed < 40:
            plain = breakpoint_of(LOADS, metric, seed=seed, resamples=299)
            narrower.append((blocked.high - blocked.low) / (plain.high - plain.low))
    assert np.mean(held) >= 0.91
    assert np.mean(narrower) < 0.6
    for wrong in (seeds[:-1], np.zeros(100)):
        with pytest.raises(ValueError, match="block"):
            breakpoint_of(LOADS, metric, blocks=wrong)


def test_in_the_logarithm_of_the_load():
    """Time over bandwidth, falling by 200 s a decade up to 2 Mb/s."""
    rates_bps = np.repeat([62.5e3, 125e3, 250e3, 500e3, 1e6, 2e6, 4e6, 8e6, 16e6, 32e6], 10)
    draw = np.random.default_rng(1)
    times_s = 600 - 200 * np.log10(np.minimum(rates_bps, 2e6) / 2e6) + draw.normal(0, 20, 100)
    knee = breakpoint_of(rates_bps, times_s, log=True)
    assert knee.low <= 2e6 <= knee.high
    assert knee.high / knee.low < 2
    assert knee.slope_before == pytest.approx(-200, abs=20)


def test_the_same_seed_gives_the_same_knee():
    metric = bent(6.0, 0.5, 0)
    assert breakpoint_of(LOADS, metric, seed=3) == breakpoint_of(LOADS, metric, seed=3)
    assert breakpoint_of(LOADS, metric, seed=3) != breakpoint_of(LOADS, metric, seed=4)


def test_the_order_of_magnitude_of_the_metric_does_not_matter():
    metric = bent(6.0, 0.5, 0)
    one, other = breakpoint_of(LOADS, metric), breakpoint_of(LOADS * 1e6, metric * 1e-6)
    assert [other.at, other.low, other.high] == pytest.approx([1e6 * one.at, 1e6 * one.low,
                                                               1e6 * one.high])
    assert other.p == one.p


def test_what_has_no_answer_is_refused():
    for loads in ([1, 2, 3, 4] * 5, [1, 2, 3, 4, 5, 6, 7], []):
        with pytest.raises(ValueError, match="at least 5 different loads and 8 runs"):
            breakpoint_of(loads, loads)
    with pytest.raises(ValueError, match="logarithm"):
        breakpoint_of(range(8), range(8), log=True)
