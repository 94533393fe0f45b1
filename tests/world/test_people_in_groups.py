"""Groups of people beside what Moussaid, Perozo, Garnier, Helbing, Theraulaz published (2010)."""

import math
from functools import cache

import numpy as np
import pytest
from test_people import DT_S, HALL, crowd, walked

from desim.scenario.schema.environment import People

FAR = (("-60 m", "0 m"), ("60 m", "0 m"))
GROUPS = 40
FASTER_MPS = 0.065  # than which no group may be, or slower, beside the published fit


@cache
def in_the_open(size, together=True):
    """The places [seconds, groups, size, 2] of groups that walk along x, 14 m apart."""
    people = crowd(People(count=GROUPS * size, path=FAR, width="6 m"),
                   size=("140 m", f"{14 * GROUPS} m"))
    arrays = people.walkers
    arrays.target[:], arrays.step[:] = 1, 1
    group, k = np.divmod(np.arange(GROUPS * size), size)
    arrays.offsets[:] = 14.0 * (group - (GROUPS - 1) / 2)
    arrays.places[:] = np.column_stack([np.full(len(k), -50.0),
                                        arrays.offsets + 0.8 * (k - (size - 1) / 2)])
    if together:
        arrays.company[:] = np.column_stack([group * size, group * size + size])
    return walked(people, 40.0)[::60].reshape(-1, GROUPS, size, 2)[10:]


def speed_mps(places):
    return float((places[-1] - places[0])[..., 0].mean() / (len(places) - 1))


@pytest.mark.parametrize("size", [2, 3, 4, 5])
def test_speed_falls_with_size(size):
    """The fit of their population A is 1.26 - 0.04 N (figure 2)."""
    assert speed_mps(in_the_open(size)) == pytest.approx(1.26 - 0.04 * size, abs=FASTER_MPS)


def test_those_who_are_no_group_are_faster():
    """Twin."""
    for size in (2, 3, 4, 5):
        assert speed_mps(in_the_open(size, together=False)) > 1.26 - 0.04 * size + FASTER_MPS


@pytest.mark.parametrize("size", [2, 3, 4, 5])
def test_they_walk_side_by_side(size):
    """As published for few people; a metre apart, where the attraction ends."""
    long_m, broad_m = np.ptp(in_the_open(size)[-1], axis=1).T
    assert np.median(long_m / broad_m) < 1 / 3
    assert np.quantile(long_m / broad_m, 0.95) < 1.0
    assert broad_m.mean() / (size - 1) == pytest.approx(1.0, abs=0.1)


def test_acceleration_in_a_group_by_hand():
    """Two 0.5 m apart go from each other by 1 m/s^2, and at 1.5 m to their centre by 3; the one
    ahead slows down by 4/s for each radian that the other is behind a right angle."""
    def change(places, company):
        people = crowd(People(count=2, path=HALL, width="0 m"))
        arrays = people.walkers
        arrays.places[:], arrays.velocities[:], arrays.wanted[:] = places, (1.0, 0.0), 1.0
        arrays.target[:], arrays.step[:], arrays.company[:] = 1, 1, company
        walked(people, DT_S)
        return (arrays.velocities - (1.0, 0.0)) / DT_S

    alone = [(0, 1), (1, 2)]
    for places, wanted in (
            (((0, 0), (0, 0.5)), ((0, -1), (0, 1))),
            (((0, 0), (0, 1.5)), ((0, 3), (0, -3))),
            (((0, 0), (-0.9 / math.sqrt(2), 0.9 / math.sqrt(2))), ((-4 * math.pi / 4, 0), (0, 0)))):
        forces = change(places, (0, 2)) - change(places, alone)
        assert forces == pytest.approx(np.array(wanted, float), abs=1e-6)


def test_sizes_are_zero_truncated_poisson():
    """Mean lambda / (1 - exp(-lambda)); of population B 70 % walked in groups."""
    company = crowd(People(count=400, path=FAR, width="10 m", groups=1.11),
                  size=("140 m", "12 m")).walkers.company
    sizes = np.unique(company, axis=0) @ (-1, 1)
    assert sizes.sum() == 400
    assert sizes.mean() == pytest.approx(1.11 / -math.expm1(-1.11), rel=0.1)
    assert sizes[sizes > 1].sum() / 400 == pytest.approx(0.7, abs=0.08)


def spread_m(together):
    """By what a group's farthest is more than (size - 1) / 2 m from its centre, at each second,
    among 60 people who meet in a corridor."""
    people = crowd(People(count=60, path=(("-18 m", "0 m"), ("18 m", "0 m")), width="6 m",
                          groups=1.11), size=("40 m", "8 m"))
    groups = [group for group in np.unique(people.walkers.company, axis=0) if group @ (-1, 1) > 1]
    if not together:
        people.walkers.company[:] = [(i, i + 1) for i in range(60)]
    places = walked(people, 40.0)[::60]
    return np.concatenate([np.linalg.norm(
        places[:, begin:end] - places[:, begin:end].mean(axis=1, keepdims=True), axis=2).max(axis=1)
        - (end - begin - 1) / 2 for begin, end in groups])


def test_groups_stay_together_in_a_crowd():
    assert np.quantile(spread_m(True), 0.95) < 0.3
    assert np.quantile(spread_m(False), 0.5) > 1.0  # twin
