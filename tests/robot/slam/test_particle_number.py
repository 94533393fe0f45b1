"""Particles are few where they agree, thirty where they do not, or always as many as said."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2
from slam_logs import Laser, made_log, ring, way

from desim.engine.streams import Streams
from desim.robot.slam import particle_number
from desim.robot.slam.kernels.particles import occupied_bins
from desim.robot.slam.kinds import gmapping
from desim.robot.slam.particle_number import samples_for, wanted_particles
from desim.robot.slam.settings import SlamSettings

BIN_M, BIN_RAD = 0.5, math.radians(10.0)


def is_as_published():
    """Fox (2003): n = chi2(k - 1, 0.99) / (2 * 0.05), of which Wilson and Hilferty's is close."""
    return all(abs(samples_for(bins) * 0.1 / chi2.ppf(0.99, bins - 1) - 1.0) < 0.02
               for bins in range(2, 200))


def test_samples_are_those_of_the_chi_square_distribution():
    assert is_as_published() and samples_for(1) == 1


def test_but_not_with_another_quantile(monkeypatch):
    monkeypatch.setattr(particle_number, "_QUANTILE", 2.326 * 0.9)
    assert not is_as_published()


def bins_of(poses, centre):
    """The bins of poses around one of them, each as often as it is met."""
    found = []
    for x, y, yaw in poses:
        turn = math.remainder(yaw - poses[centre][2], 2.0 * math.pi)
        found.append((math.floor((x - poses[centre][0]) / BIN_M + 0.5),
                      math.floor((y - poses[centre][1]) / BIN_M + 0.5),
                      math.floor(turn / BIN_RAD + 0.5)))
    return found


@given(st.lists(st.tuples(*[st.floats(-1.5, 1.5)] * 2, st.floats(-9.0, 9.0)), min_size=1,
                max_size=30), st.integers(0, 29))
def test_bins_are_those_of_a_plain_count(poses, k):
    centre, array = k % len(poses), np.array(poses)
    count = occupied_bins(array, centre, BIN_M, BIN_RAD, np.empty(array.shape))
    assert count == len(set(bins_of(poses, centre)))


def test_particles_that_agree_are_few_and_others_are_all():
    close = np.random.default_rng(1).normal(0.0, 0.02, (30, 3)) + (0.25, -0.25, math.pi)
    close[::2, 2] -= 2.0 * math.pi  # the same heading
    assert wanted_particles(close, 7, 8, 30) == 8
    close[3, 0] += 0.3
    assert wanted_particles(close, 7, 8, 30) == 30
    assert wanted_particles(close, 7, 8, 1000) == samples_for(2) == 66


@cache
def numbers(least):
    """Particles after each scan, on a way around a block and on along its first side."""
    corners = [(1.25, 1.25), (58.75, 1.25), (58.75, 48.75), (1.25, 48.75), (1.25, 1.25),
               (30.0, 1.25)]
    log = made_log(ring(60.0, 50.0, seed=5), way(corners, step_m=0.5, turn_rad=0.25),
                   Laser(beams=121, longest_m=8.0), seed=1, drift=-0.02)
    slam = gmapping(SlamSettings(laser=log.laser, least_particles=least), Streams(1).key("slam"))
    for odometry, ranges in zip(log.odometry, log.ranges, strict=True):
        slam.update(odometry, ranges)
    assert len(slam.maps.arrays.visit_tiles) == len(slam.poses) > slam.best
    assert len(slam.path()) == len(slam.history)
    return [len(step.poses) for step in slam.history]


def few_before_the_loop_and_all_where_it_closes():
    numbers.cache_clear()
    found = numbers(8)
    closes = round(len(found) * 215 / 245)  # of the metres
    return found[:40] == [8] * 40 and found[closes - 20:closes] == [30] * 20


def test_all_particles_are_there_before_a_loop_closes():
    assert few_before_the_loop_and_all_where_it_closes()


def test_but_not_where_nothing_counts_as_apart(monkeypatch):
    monkeypatch.setattr(particle_number, "_BIN_M", 50.0)
    assert not few_before_the_loop_and_all_where_it_closes()


@pytest.mark.parametrize("least", [30, 1000])
def test_as_many_as_all_is_gmapping_s_fixed_number(least):
    assert set(numbers(least)) == {30}
