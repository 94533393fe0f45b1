"""Sequential stopping: the rule, and how often the interval holds the mean."""

import numpy as np
import pytest

from desim.statistics.intervals import t_interval
from desim.statistics.sequential import StoppingRule, coverage_of, enough


def test_the_rule_step_by_step():
    """The half width of 1, 2, 3, ... values 0, 1, 0, 1: t_{n-1} s / sqrt(n)."""
    values = [0.0, 1.0] * 10
    halves = {n: t_interval(values[:n]).half_width for n in range(3, 21)}
    stops = [n for n in range(21) if enough(values[:n], 0.3, at_least=2, at_most=18)]
    assert stops == [n for n in range(3, 18) if halves[n] <= 0.3] + [18, 19, 20]
    assert 2 < stops[0] < 18


def test_not_before_at_least_and_in_any_case_at_most():
    rule = StoppingRule(1.0, at_least=3, at_most=6)
    assert [enough([7.0] * n, *rule) for n in range(8)] == [False] * 3 + [True] * 5
    wild = [0.0, 100.0] * 4
    assert [enough(wild[:n], *rule) for n in range(8)] == [False] * 6 + [True] * 2


def test_relative_to_the_size_of_the_mean():
    values = -100.0 + np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    assert enough(values, 0.01, relative=True, at_least=5)
    assert not enough(values, 0.005, relative=True, at_least=5)
    assert not enough(values + 100.0, 0.01, relative=True, at_least=5)


def played(rule, mean, deviation, experiments, draw):
    """The rule value by value, as a campaign plays it."""
    held = used = 0
    for _ in range(experiments):
        values = [*draw.normal(mean, deviation, rule.at_least)]
        while not enough(values, *rule):
            values.append(draw.normal(mean, deviation))
        found = t_interval(values, rule.level)
        held += found.low <= mean <= found.high
        used += len(values)
    return held / experiments, used / experiments


@pytest.mark.parametrize("rule", [StoppingRule(0.1, True, at_least=5, at_most=30),
                                  StoppingRule(0.6)])
def test_the_tabulated_coverage_is_that_of_the_rule_played(rule):
    """300 experiments, standard error 1.7 %, of the number of values about 0.4."""
    share, used = played(rule, 5.0, 1.0, 300, np.random.default_rng(1))
    found = coverage_of(rule, 5.0, 1.0)
    assert found.share == pytest.approx(share, abs=0.05)
    assert found.mean_n == pytest.approx(used, abs=1.5)


def test_stopping_early_costs_coverage_and_a_fixed_number_does_not():
    stopped = coverage_of(StoppingRule(0.5))
    fixed = coverage_of(StoppingRule(0.5, at_least=16, at_most=16))
    assert fixed.share == pytest.approx(0.95, abs=3 * fixed.error)
    assert stopped.share < 0.92
    assert stopped.narrow == 1.0
    assert stopped.share < coverage_of(StoppingRule(0.5, at_least=15)).share


def test_only_the_width_in_deviations_matters():
    one = coverage_of(StoppingRule(0.5))
    other = coverage_of(StoppingRule(50.0), mean=3e6, deviation=100.0)
    assert one == other


def test_it_is_tabulated_bounded_and_the_same_again():
    rule = StoppingRule(0.01, at_most=20_000)
    found = coverage_of(rule)
    assert found.experiments == 500
    assert coverage_of(rule) is found
    coverage_of.cache_clear()
    assert coverage_of(rule) == found


@pytest.mark.parametrize("wrong", [StoppingRule(0.0), StoppingRule(0.1, at_least=1),
                                   StoppingRule(0.1, at_most=4)])
def test_what_is_no_rule_is_refused(wrong):
    with pytest.raises(ValueError, match="at_least"):
        enough([1.0], *wrong)
    with pytest.raises(ValueError, match="at_least"):
        coverage_of(wrong)


def test_values_that_do_not_vary_have_no_coverage():
    with pytest.raises(ValueError, match="deviation"):
        coverage_of(StoppingRule(0.1), deviation=0.0)
