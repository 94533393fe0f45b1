"""Censored times: a textbook's example, exact areas, and coverage by simulation."""

import numpy as np
import pytest

from desim.statistics.censoring import (
    Median,
    kaplan_meier,
    median_time,
    restricted,
    restricted_mean,
)
from desim.statistics.intervals import t_interval

# Weeks of remission (Freireich et al. 1963), with a drug and with placebo; negative: censored.
DRUG = np.array([6, 6, 6, -6, 7, -9, 10, -10, -11, 13, 16, -17, -19, -20, 22, 23, -25, -32, -32,
                 -34, -35])
PLACEBO = np.array([1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23])


def runs(signed):
    return np.abs(signed), np.asarray(signed) > 0


def test_kaplan_meier_on_the_textbook_example():
    """Kleinbaum and Klein, Survival Analysis, chapter 2: shares and numbers at risk."""
    curve = kaplan_meier(*runs(DRUG))
    at = {int(t): k for k, t in enumerate(curve.times)}
    published = {6: (21, 3, .8571), 7: (17, 1, .8067), 10: (15, 1, .7529), 13: (12, 1, .6902),
                 16: (11, 1, .6275), 22: (7, 1, .5378), 23: (6, 1, .4482)}
    for time, (at_risk, events, share) in published.items():
        k = at[time]
        assert (curve.at_risk[k], curve.events[k]) == (at_risk, events)
        assert curve.share[k] == pytest.approx(share, abs=1e-4)
        assert curve.low[k] < share < curve.high[k]
    assert curve.events.sum() == 9


def test_median_of_the_textbook_example():
    """23 weeks, from 13, the log-log band's, to beyond what was seen."""
    assert median_time(*runs(DRUG)) == Median(23.0, 13.0, None)
    assert median_time(*runs(PLACEBO)).value == 8.0


@pytest.mark.parametrize("times", [[4.0, 1.0, 3.0], [4.0, 1.0, 3.0, 2.0]])
def test_without_censoring_it_is_the_ordinary_median(times):
    assert median_time(times, [True] * len(times)).value == np.median(times)


def test_a_median_that_is_not_reached():
    assert median_time([100.0] * 5, [False] * 5) == Median(None, None, None)
    # Half of them got there; where the second half begins nobody saw.
    assert median_time([1.0, 2.0, 9.0, 9.0], [True, True, False, False]).value is None
    assert median_time([1.0, 2.0, 3.0, 9.0], [True, True, True, False]).value == 2.5


def test_the_area_by_hand():
    """S is 1, from 1 on 3/4, from 3 on 3/8. A(1) = 2 * 3/4 + 3/8, A(3) = 3/8."""
    found = restricted_mean([1.0, 2.0, 3.0, 4.0], [True, False, True, False], limit=4.0)
    assert found.mean == pytest.approx(1.0 + 2 * 0.75 + 0.375)
    variance = 1.875**2 * 1 / (4 * 3) + 0.375**2 * 1 / (2 * 1)
    assert found.error == pytest.approx((4 / 3 * variance)**0.5)
    shorter = restricted_mean([1.0, 2.0, 3.0, 4.0], [True, False, True, False], limit=2.5)
    assert shorter.mean == pytest.approx(1.0 + 1.5 * 0.75)


def test_the_area_by_exact_integration():
    curve = kaplan_meier(*runs(DRUG))
    grid = (np.arange(35_000) + 0.5) / 1000
    heights = np.append(1.0, curve.share)[np.searchsorted(curve.times, grid, side="right")]
    area = heights.mean() * 35.0
    assert restricted_mean(*runs(DRUG), 35.0).mean == pytest.approx(area, rel=1e-12)


def test_with_one_limit_it_is_the_mean_of_the_restricted_times():
    times = np.minimum(np.random.default_rng(1).exponential(1000.0, 12), 2000.0)
    there = times < 2000.0
    assert 0 < there.sum() < 12
    found = restricted_mean(times, there, 2000.0)
    expected = t_interval(restricted(times, there, 2000.0))
    assert (found.mean, found.low, found.high) == pytest.approx(expected[:3], rel=1e-12)


def mean_of_successes(times, reached):
    """The mean of those that got there, as in the paper (Yan et al. 2017)."""
    return t_interval(np.asarray(times)[np.asarray(reached)])


def test_starvation_looks_good_only_to_the_mean_of_the_successes():
    ample = [400.0, 500.0, 600.0, 700.0, 800.0], [True] * 5
    starved = [400.0, 2000.0, 2000.0, 2000.0, 2000.0], [True, False, False, False, False]
    assert mean_of_successes(*starved).mean < mean_of_successes(*ample).mean
    assert restricted_mean(*starved, 2000.0).mean > restricted_mean(*ample, 2000.0).mean
    assert median_time(*starved).value is None


def test_coverage_of_restricted_mean_and_median():
    """Exponential times of mean 1, stopped at 1.2: standard error of the shares 0.7 %. The first
    twin forgets those that were stopped, the second takes the limit for their times' end."""
    draw, limit, experiments = np.random.default_rng(7), 1.2, 800
    true_mean, true_median = 1 - np.exp(-limit), np.log(2)
    held = np.zeros(3)
    for _ in range(experiments):
        times = draw.exponential(1.0, 30)
        ends, there = np.minimum(times, limit), times <= limit
        mean, median = restricted_mean(ends, there, limit), median_time(ends, there)
        naive = mean_of_successes(ends, there)
        held += (mean.low <= true_mean <= mean.high,
                 (median.low or 0.0) <= true_median <= (median.high or np.inf),
                 naive.low <= true_mean <= naive.high)
    restricted_share, median_share, naive_share = held / experiments
    assert 0.93 <= restricted_share <= 0.97
    assert 0.93 <= median_share <= 0.98, "an interval between observed times holds a bit more"
    assert naive_share < 0.5


def test_few_runs():
    assert restricted_mean([5.0], [True], 9.0)[:4] == (5.0, None, None, None)
    nobody = restricted_mean([9.0, 9.0, 9.0], [False] * 3, 9.0)
    assert nobody[:4] == (9.0, 0.0, None, None)
    assert restricted_mean([5.0, 5.0], [True, True], 9.0)[:4] == (5.0, 0.0, None, None)
    assert restricted_mean([5.0] * 3, [True] * 3, 9.0)[:4] == (5.0, 0.0, 5.0, 5.0)


def test_what_nobody_watched_is_refused():
    with pytest.raises(ValueError, match="up to 9"):
        restricted_mean([1.0, 8.0], [True, False], 9.0)
    with pytest.raises(ValueError, match="before the limit"):
        restricted([8.0], [False], 9.0)
    assert restricted([8.0, 12.0], [True, True], 9.0).tolist() == [8.0, 9.0]
    for times, there in (([], []), ([1.0], [True, False]), ([-1.0], [True])):
        with pytest.raises(ValueError):
            kaplan_meier(times, there)
