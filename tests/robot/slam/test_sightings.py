"""Bodies in a scan: their places by geometry alone, and whom they belong to."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.ports import Pose2D
from desim.ports.localization import LaserGeometry
from desim.robot.slam import fleet_graph, sightings
from desim.robot.slam.fleet_graph import FleetGraph, Seen, loosened, on_motion, shown
from desim.robot.transforms import turned

LASER = LaserGeometry(math.radians(-95.0), math.radians(190.0 / 179), 26.0)
RADIUS = 0.26


def scan(x_m, y_m, laser=LASER):
    """Ranges of a disc before a wall 25 m away, by the circle's equation."""
    angles = laser.angle_min_rad + np.arange(180) * laser.increment_rad
    ahead, aside = (x_m * np.cos(angles) + y_m * np.sin(angles),
                    y_m * np.cos(angles) - x_m * np.sin(angles))
    depth = RADIUS ** 2 - aside ** 2
    hit = (depth >= 0.0) & (ahead > 0.0)
    return np.where(hit, ahead - np.sqrt(np.maximum(depth, 0.0)), 25.0)


@given(st.floats(0.8, 10.0), st.floats(-1.3, 1.3))
def test_a_body_is_found_where_it_is(away_m, bearing):
    x_m, y_m = away_m * math.cos(bearing), away_m * math.sin(bearing)
    found, = sightings.sightings(scan(x_m, y_m), LASER, 2.0 * RADIUS)
    off = np.array((found.x_m - x_m, found.y_m - y_m))
    along = abs(off @ (math.cos(bearing), math.sin(bearing)))
    assert along < max(0.25 * RADIUS, 3.0 * found.along_m)
    assert math.hypot(*off) < 3.0 * math.hypot(found.along_m, found.across_m)


def test_its_place_is_known_worse_aside_than_along_from_afar():
    found, = sightings.sightings(scan(8.0, 0.0), LASER, 2.0 * RADIUS)
    information = found.information
    assert information[0, 0] > information[1, 1] > 0.0 == information[2, 2]


def test_a_mounted_laser_sees_from_where_it_is():
    laser = LASER._replace(mount=Pose2D(0.2, 0.0, 0.0))
    found, = sightings.sightings(scan(4.0, 1.0), laser, 2.0 * RADIUS)
    assert (found.x_m, found.y_m) == pytest.approx((4.2, 1.0), abs=0.1)


def test_a_robot_that_is_alone_sees_nobody():
    assert sightings.sightings(scan(4.0, 1.0), LASER, 0.0) == []


def fleet(**places):
    """Robots that stand, each with nodes at 1 s and 3 s."""
    known = FleetGraph()
    for name, place in places.items():
        known.add(name, 10**9, np.array((*place, 0.0)), np.zeros((3, 3)), None)
        known.add(name, 3 * 10**9, np.zeros(3), np.eye(3), None)
    return known


def test_a_sighting_is_of_who_was_there_then():
    known = fleet(a=(0.0, 0.0), b=(4.3, 1.0), c=(8.0, 0.0))
    known.add("b", 5 * 10**9, np.array((9.0, 0.0, 0.0)), np.eye(3), None)  # it has left since
    body, = sightings.sightings(scan(4.0, 1.0), LASER, 2.0 * RADIUS)
    met = known.met("a", Seen(0, body), ("b", "c"))
    assert (met.source, met.theirs) == ("b", 0)
    assert met.share == 0.0


def test_a_body_that_another_one_hides_in_part_is_not_placed():
    near, far = scan(3.0, 0.0), scan(6.0, 0.4)
    found = sightings.sightings(np.minimum(near, far), LASER, 2.0 * RADIUS)
    assert [one.x_m for one in found] == pytest.approx([3.0], abs=0.05)
    assert len(sightings.sightings(np.minimum(near, scan(6.0, 2.0)), LASER, 2.0 * RADIUS)) == 2


@pytest.mark.parametrize("places", [
    {"b": (6.0, 1.0)}, {"b": (4.5, 1.0), "c": (3.6, 1.0)}, {}],
    ids=["nobody near", "two near", "nobody known"])
def test_a_sighting_that_is_not_clear_is_of_nobody(places):
    body, = sightings.sightings(scan(4.0, 1.0), LASER, 2.0 * RADIUS)
    assert fleet(a=(0.0, 0.0), **places).met("a", Seen(0, body), tuple(places)) is None


def test_the_nearest_would_be_taken_without_the_rule(monkeypatch):
    monkeypatch.setattr(fleet_graph, "_CLEAR", 0.0)
    with pytest.raises(AssertionError):
        test_a_sighting_that_is_not_clear_is_of_nobody({"b": (4.5, 1.0), "c": (3.6, 1.0)})


def test_a_scan_tells_nothing_along_a_bare_corridor():
    seen = shown(turned(np.diag((640.0, 1e5, 1e6)), 0.7))
    assert np.linalg.eigvalsh(seen) == pytest.approx((0.0, 1e5, 1e6), abs=1e-6)
    known = np.diag((1e4, 1e5, 1e6))
    assert shown(known) is known


def test_a_scan_that_shows_the_place_again_tells_nothing_of_the_step():
    """Two places on one map with equal variances v: the motion between them has 2 v. Of the first
    one nothing is known along x."""
    step = on_motion(np.diag((1e5, 1e5, 1e6)), np.diag((0.0, 1e5, 1e6)))
    assert step == pytest.approx(np.diag((0.0, 5e4, 5e5)), abs=1e-3)


def test_variances_add_up_and_what_is_unknown_stays_so():
    shown = loosened(np.diag((0.0, 4.0, 100.0)), np.diag((9.0, 0.75, 0.03)))
    assert shown == pytest.approx(np.diag((0.0, 1.0, 25.0)))
