"""Paired comparisons against scipy's numbers, corrections against worked examples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from desim.statistics.comparisons import holm, paired, paired_times
from desim.statistics.intervals import t_interval


def draw(seeds=12, gain=0.3):
    """Two settings that share most of their random numbers."""
    draw = np.random.default_rng(4)
    shared = draw.normal(10.0, 3.0, seeds)
    return shared + draw.normal(gain, 0.4, seeds), shared + draw.normal(0.0, 0.4, seeds)


def test_p_values_are_scipys():
    first, second = draw()
    found = paired(first, second)
    t, w = stats.ttest_rel(first, second), stats.wilcoxon(first, second)
    assert found.t_p == pytest.approx(t.pvalue, rel=1e-9)
    assert found.wilcoxon_p == pytest.approx(w.pvalue, rel=1e-9)
    assert found.difference[1:3] == pytest.approx(t.confidence_interval(0.95), rel=1e-9)
    assert found.cohen_dz == pytest.approx(t.statistic / 12**0.5, rel=1e-9)


def test_the_twin_that_forgets_the_pairs_sees_nothing():
    first, second = draw(30)
    assert paired(first, second).t_p < 0.01
    assert stats.ttest_ind(first, second).pvalue > 0.2
    assert paired(first, np.roll(second, 1)).t_p > 0.2


def test_ranks_by_hand():
    """Differences 1, -2, 3, 4, 0: ranks 1 to 4, of 10, 2 of them against. 2 / 10 or more uneven
    sums on 2 sides: 6 of 16."""
    found = paired([1.0, 0.0, 3.0, 4.0, 5.0], [0.0, 2.0, 0.0, 0.0, 5.0])
    assert found.rank_biserial == pytest.approx((8 - 2) / 10)
    assert found.wilcoxon_p == pytest.approx(6 / 16)
    assert (found.above, found.equal, found.below) == (3, 1, 1)


def test_turned_round_it_says_the_same():
    first, second = draw()
    one, other = paired(first, second), paired(second, first)
    assert one.t_p == pytest.approx(other.t_p)
    assert one.wilcoxon_p == other.wilcoxon_p
    assert one.cohen_dz == pytest.approx(-other.cohen_dz)
    assert one.rank_biserial == pytest.approx(-other.rank_biserial)
    assert (one.above, one.below) == (other.below, other.above)


def test_what_does_not_vary():
    same = paired([1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    assert same[1:5] == (None,) * 4
    assert (same.difference.mean, same.equal) == (0.0, 3)
    shifted = paired([0.1, 0.2, 0.7], [1.1, 1.2, 1.7])
    assert (shifted.t_p, shifted.cohen_dz) == (None, None), "a shift by 1, but for rounding"
    assert (shifted.wilcoxon_p, shifted.rank_biserial) == (0.25, -1.0)
    assert paired([1.0], [0.0]).t_p is None
    assert paired([], []).difference.n == 0
    with pytest.raises(ValueError, match="paired"):
        paired([1.0, 2.0], [1.0])


def test_false_alarms_are_as_many_as_they_may_be():
    """1000 experiments without a difference, standard error 0.7 %."""
    draw = np.random.default_rng(9)
    alarms = np.mean([paired(*draw.normal(size=(2, 10))).t_p < 0.05 for _ in range(1000)])
    assert 0.03 <= alarms <= 0.07


def test_censored_pairs_have_the_right_sign_and_at_least_their_size():
    found = paired_times([300.0, 2000.0, 2000.0, 500.0], [True, False, False, True],
                         [200.0, 900.0, 2000.0, 2000.0], [True, True, False, False], 2000.0)
    assert (found.both_censored, found.one_censored) == (1, 2)
    assert (found.paired.above, found.paired.equal, found.paired.below) == (2, 1, 1)
    assert found.paired.difference == t_interval([100.0, 1100.0, 0.0, -1500.0])
    with pytest.raises(ValueError, match="before the limit"):
        paired_times([300.0], [False], [200.0], [True], 2000.0)


def test_holm_by_hand():
    """Times 4, 3, 2, 1 in ascending order, never less than the one before."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.7]).tolist() == [1.0, 1.0]
    assert holm([]).tolist() == []


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_the_correction_only_raises_and_keeps_the_order(raw):
    adjusted = holm(raw)
    assert (adjusted >= np.array(raw) - 1e-15).all() and (adjusted <= 1.0).all()
    assert (np.diff(adjusted[np.argsort(raw, kind="stable")]) >= -1e-15).all()


def test_holm_bounds_the_chance_of_any_false_alarm_and_no_correction_does_not():
    """Standard error of the first share: 0.2 %."""
    p = np.random.default_rng(3).random((10_000, 10))
    assert np.mean([holm(row).min() < 0.05 for row in p]) < 0.055
    assert (p.min(axis=1) < 0.05).mean() > 0.3


@pytest.mark.parametrize("wrong", [[1.2], [-0.1], [float("nan")]])
def test_what_is_no_probability_is_refused(wrong):
    with pytest.raises(ValueError):
        holm(wrong)
