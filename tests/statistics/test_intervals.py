"""Intervals against worked numbers, and how often they hold the mean, by simulation."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

from desim.statistics.intervals import (
    Interval,
    bca_interval,
    interval,
    proportion,
    t_interval,
    widened,
)


def held(draw, mean, experiments, method):
    """The share of the experiments whose interval holds the mean."""
    found = [method(draw()) for _ in range(experiments)]
    return np.mean([low <= mean <= high for _, low, high, _, _ in found])


def test_t_by_hand():
    """Mean 3, s^2 = 2.5, t_4 = 2.776445."""
    half = 2.776445 * (2.5 / 5)**0.5
    found = t_interval([1, 2, 3, 4, 5])
    assert found[:3] == pytest.approx((3.0, 3.0 - half, 3.0 + half), rel=1e-6)
    assert found[3:] == (5, "t")
    assert found.half_width == pytest.approx(half, rel=1e-6)


@pytest.mark.parametrize("n", [5, 10])
def test_t_holds_the_mean_of_normal_values(n):
    """Standard error of the share: 0.3 %."""
    draw = np.random.default_rng(n)
    assert 0.93 <= held(lambda: draw.normal(3.0, 2.0, n), 3.0, 4000, t_interval) <= 0.97


def test_the_twin_with_z_in_place_of_t_does_not():
    def z_interval(values):
        found = t_interval(values)
        half = found.half_width * 1.960 / 2.776
        return found._replace(low=found.mean - half, high=found.mean + half)

    draw = np.random.default_rng(5)
    assert held(lambda: draw.normal(3.0, 2.0, 5), 3.0, 4000, z_interval) < 0.93


@pytest.mark.parametrize("name, mean", [("normal", 0.0), ("exponential", 1.0)])
def test_bca_holds_the_mean_of_30_values(name, mean):
    """Standard error of the share: 0.8 %. Measured with 2000 experiments: docs/reports.md."""
    draw = np.random.default_rng(30)
    values = {"normal": lambda: draw.normal(0.0, 1.0, 30),
              "exponential": lambda: draw.exponential(1.0, 30)}[name]
    share = held(values, mean, 800, lambda sample: bca_interval(sample, resamples=999))
    assert 0.93 <= share <= 0.97


def test_bca_is_scipys_at_the_widened_level():
    """t_39 = 2.0227, times sqrt(40 / 39) is 2.0485, which a normal value exceeds in 4.05 %."""
    values = np.sort(np.random.default_rng(1).exponential(1.0, 40))
    assert widened(0.95, 40) == pytest.approx(1 - 0.0405, abs=1e-4)
    scipys = stats.bootstrap((values,), np.mean, confidence_level=widened(0.95, 40),
                             n_resamples=50_000, method="BCa",
                             random_state=np.random.default_rng(2)).confidence_interval
    ours = bca_interval(values, resamples=50_000)
    assert ours[1:3] == pytest.approx(tuple(scipys), rel=0.01)


def test_bca_follows_the_skew():
    values = np.random.default_rng(2).exponential(1.0, 50)
    found = interval(values)
    assert found.method == "bca"
    assert found.high - found.mean > 1.1 * (found.mean - found.low)


def test_the_same_values_and_seed_give_the_same_interval_in_any_order():
    values = np.random.default_rng(3).normal(size=30)
    assert interval(values) == interval(values[::-1])
    assert interval(values, seed=1) != interval(values, seed=2)


def test_which_method_for_how_many():
    values = np.random.default_rng(4).normal(size=1001)
    assert [interval(values[:n]).method for n in (2, 3, 29, 30, 1000, 1001)] \
        == ["none", "t", "t", "bca", "bca", "t"]


def test_what_does_not_spread():
    assert interval([]) == Interval(None, None, None, 0, "none")
    assert interval([7.0]) == Interval(7.0, None, None, 1, "none")
    assert interval([7.0, 8.0]) == Interval(7.5, None, None, 2, "none")
    for n in (3, 30):
        assert interval([0.1] * n) == Interval(0.1, 0.1, 0.1, n, "equal")
    assert interval([]).half_width is None


@pytest.mark.parametrize("wrong", [[1.0, float("nan")], [float("inf")], [[1.0], [2.0]]])
def test_what_is_no_sample_is_refused(wrong):
    with pytest.raises(ValueError):
        interval(wrong)


def test_wilson_by_hand():
    """(k + z^2/2 +- z sqrt(k (n - k) / n + z^2/4)) / (n + z^2), z = 1.959964; k 4 of 5."""
    z = 1.959964
    middle, half = 4 + z**2 / 2, z * (4 * 1 / 5 + z**2 / 4)**0.5
    found = proportion(4, 5)
    assert found[:3] == pytest.approx((0.8, (middle - half) / (5 + z**2),
                                       (middle + half) / (5 + z**2)), rel=1e-6)
    assert found[3:] == (5, "wilson")


def test_all_or_no_successes_still_leave_doubt():
    assert proportion(0, 5)[1:3] == pytest.approx((0.0, 0.4345), abs=1e-4)
    assert proportion(5, 5)[1:3] == pytest.approx((0.5655, 1.0), abs=1e-4)
    assert proportion(0, 0) == Interval(None, None, None, 0, "none")
    with pytest.raises(ValueError):
        proportion(6, 5)


def test_help_does_not_wait_for_scipy():
    done = subprocess.run([sys.executable, "-X", "importtime", "-c",
                           "import desim.statistics, desim.cli"],
                          capture_output=True, text=True, timeout=60, check=True)
    assert "desim.statistics" in done.stderr
    assert "scipy" not in done.stderr


def test_a_mean_as_text_has_its_half_width():
    assert t_interval([340.0, 350.0, 360.0]).text() == "350 ± 25"
    assert t_interval([340.0, 350.0, 360.0]).text(1) == "350.0 ± 24.8"
    assert t_interval([340.0]).text() == "340" and t_interval([]).text() == ""


def test_logarithms_of_quotients_read_as_their_geometric_mean_and_its_bounds():
    # Half of ln 2 with bounds 12.7 standard errors away, each half of ln 2: Student's table.
    assert t_interval(np.log([1.0, 2.0, 4.0])).quotient_text() == "2.00 (0.36 to 11.19)"
    assert t_interval([np.log(0.5)] * 3).quotient_text(1) == "0.5 (0.5 to 0.5)"
    assert t_interval([np.log(3.0)]).quotient_text() == "3.00"
    assert t_interval([]).quotient_text() == ""
