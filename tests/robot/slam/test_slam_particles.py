"""Particles: who goes on, what the weights say, and that nothing but the seed decides."""

from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from slam_logs import made_log, ring, way

from desim.engine.streams import Streams
from desim.robot.slam.kernels.particles import ancestors, normalize
from desim.robot.slam.kinds import gmapping
from desim.robot.slam.settings import SlamSettings

weights = st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=40)


@given(weights, st.integers(1, 40), st.integers(0, 2**32))
def test_each_particle_has_its_share_of_descendants(values, wanted, counter):
    logs = np.array(values)
    shares = np.empty(len(logs))
    effective = normalize(logs, shares)
    assert shares.sum() == pytest.approx(1.0) and 1.0 - 1e-9 <= effective <= len(logs) + 1e-9
    chosen = np.empty(wanted, np.int64)
    ancestors(shares, np.uint64(7), np.uint64(counter), np.empty(len(logs), np.int64), chosen)
    copies = np.bincount(chosen, minlength=len(logs))
    assert (np.abs(copies - shares * wanted) < 1.0 + 1e-6).all()  # systematic resampling
    kept = np.flatnonzero(copies[:wanted])
    assert (chosen[kept] == kept).all()  # who survives stays in its place, if it is there still


@cache
def log():
    poses = way([(1.2, 1.2), (12.8, 1.2), (12.8, 8.8)])
    return made_log(ring(14.0, 10.0, 2.5), poses)


def played(seed, particles=6):
    made = log()
    slam = gmapping(SlamSettings(particles=particles, laser=made.laser),
                    Streams(seed).key("slam"))
    for odometry, ranges in zip(made.odometry, made.ranges, strict=True):
        slam.update(odometry, ranges)
    return slam


def fingerprint(slam):
    visits, hits, _ = slam.maps.counts(slam.best)
    return slam.poses.tobytes() + slam.path().tobytes() + visits.tobytes() + hits.tobytes()


def test_the_same_seed_gives_the_same_bits_and_another_does_not():
    first, again, other = played(1), played(1), played(2)
    assert fingerprint(first) == fingerprint(again) != fingerprint(other)


def test_the_number_of_threads_changes_no_bit():
    alone = fingerprint(played(1))
    with ThreadPoolExecutor(2) as threads:
        assert all(fingerprint(slam) == alone for slam in threads.map(played, (1, 1)))


def test_more_particles_do_not_move_the_numbers_of_the_first():
    few, many = played(1, particles=1), played(1, particles=2)
    # Until the first resampling, which no single particle has: the second scan's draws.
    assert few.history[1].poses[0].tolist() == pytest.approx(many.history[1].poses[0].tolist(),
                                                             abs=0.05)
