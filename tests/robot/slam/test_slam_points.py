"""Returns of a scan: normals of surfaces that few beams graze, and teammates who are no walls."""

import numpy as np
import pytest

from desim.robot.slam.kernels.points import NX, NY, Beams, X, Y, points_of, thinned, without_bodies

BEAMS = Beams(-0.5 * np.pi, np.radians(1.0), 0.05, 80.0, 0.0, 0.0, 0.0)  # one a degree
ANGLES = BEAMS.angle_min_rad + BEAMS.increment_rad * np.arange(181)
WIDTH_M = 0.5


def of_wall(away_m):
    """Ranges to an endless wall ahead, x = away_m, up to 40 m."""
    ranges = away_m / np.maximum(np.cos(ANGLES), 1e-9)
    return np.where(ranges < 40.0, ranges, 90.0)


def with_disc(ranges, x_m, y_m, radius_m=0.5 * WIDTH_M):
    """Ranges with a round body in front."""
    along = x_m * np.cos(ANGLES) + y_m * np.sin(ANGLES)
    aside = x_m * np.sin(ANGLES) - y_m * np.cos(ANGLES)
    meets = (along > 0.0) & (np.abs(aside) < radius_m)
    depth = along - np.sqrt(np.maximum(radius_m ** 2 - aside ** 2, 0.0))
    return np.where(meets, np.minimum(depth, ranges), ranges)


def points(ranges):
    found = np.empty((len(ranges), 4))
    return found[:points_of(ranges, BEAMS, found, np.empty(len(ranges)))]


def without(ranges):
    kept = np.empty(len(ranges))
    without_bodies(ranges, BEAMS, WIDTH_M, kept)
    return np.where(np.isinf(kept), 90.0, kept)


@pytest.mark.parametrize("away_m", [1.0, 4.0, 10.0])
def test_a_wall_has_its_normal_also_where_beams_graze_it_far_apart(away_m):
    found = points(of_wall(away_m))
    normal = found[:, NX] != 0.0
    assert np.allclose(found[normal][:, [NX, NY]], (-1.0, 0.0), atol=1e-6)
    assert np.allclose(found[:, X], away_m)
    assert normal.mean() > 0.9


def test_the_line_from_a_body_to_the_wall_behind_it_is_no_surface():
    found = points(with_disc(of_wall(6.0), 3.0, 0.0))
    wall = found[:, X] > 5.9
    assert np.allclose(found[wall & (found[:, NX] != 0.0)][:, [NX, NY]], (-1.0, 0.0), atol=1e-6)


@pytest.mark.parametrize("place", [(1.0, 0.2), (3.0, -1.0), (5.0, 2.5)])
def test_a_body_in_front_of_a_wall_is_left_out_and_the_wall_is_not(place):
    wall = of_wall(6.0)
    seen = with_disc(wall, *place)
    assert (seen < wall).any()
    kept = without(seen)
    assert (kept == np.where(seen < wall, 90.0, wall)).all()


def test_a_body_that_another_one_hides_in_part_is_left_out():
    wall = of_wall(8.0)
    seen = with_disc(with_disc(wall, 2.0, 0.0), 4.0, 0.35)
    assert (without(seen) == np.where(seen < wall, 90.0, wall)).all()


def test_what_is_wider_than_a_body_stays():
    wall = of_wall(6.0)
    assert (without(wall) == wall).all()
    seen = with_disc(wall, 3.0, 0.0, radius_m=0.4)
    assert (without(seen) == seen).all()


SPARSE = Beams(-0.5 * np.pi, np.radians(1.5), 0.05, 8.0, 0.0, 0.0, 0.0)


def kept_on_both_walls(thin):
    """Mean distance in m, beyond the true one, of returns that ``thin`` keeps on the right and on
    the left wall of a corridor of 2.5 m; noise of 1 cm along beams."""
    draw, angles = np.random.default_rng(1), np.radians(1.5) * np.arange(-60, 61)
    true = 1.25 / np.maximum(np.abs(np.sin(angles)), 1e-9)
    sides = [], []
    for _ in range(400):
        ranges, found = true + draw.normal(0.0, 0.01, 121), np.empty((121, 4))
        count = points_of(ranges, SPARSE, found, np.empty(121))
        kept = thin(found, count)
        for side, found_y in zip(sides, (-kept[:, Y], kept[:, Y]), strict=True):
            side.extend(found_y[found_y > 0.0] - 1.25)
    return [np.mean(side) for side in sides]


def by_share(found, count):
    kept = np.empty_like(found)
    return kept[:thinned(found, count, SPARSE, 0.05, kept)]


def by_distance(found, count):
    kept = [0]
    for k in range(1, count):
        if np.hypot(*(found[k, :2] - found[kept[-1], :2])) >= 0.05:
            kept.append(k)
    return found[kept]


def test_noise_does_not_choose_the_returns_that_are_kept():
    assert np.abs(kept_on_both_walls(by_share)).max() < 2e-4  # four standard errors


def test_but_it_does_by_the_distance_from_the_return_before():
    right, left = kept_on_both_walls(by_distance)
    assert right > 2e-4 and left < -2e-4  # both walls move to the right
