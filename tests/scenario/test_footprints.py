"""Footprints in scenarios: which are allowed, what follows from one, and what is said of others."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError
from desim.scenario.load import from_mapping, load
from desim.scenario.resolved import resolved
from desim.scenario.schema import footprint
from desim.scenario.schema.fleet import BodyType

HEAD = "name: x\nfleet: {types: {long: {footprint: "
BAR = "[[0.6 m, 0.2 m], [-0.6 m, 0.2 m], [-0.6 m, -0.2 m], [0.6 m, -0.2 m]]"

WRONG = {
    "too few corners": ("[[1 m, 0 m], [0 m, 1 m]]}}}", [
        "2:35: fleet.types.long.footprint: must be a list of at least 3, got a list of 2"]),
    "a corner of three": ("[[1 m, 0 m, 0 m], [0 m, 1 m], [-1 m, -1 m]]}}}", [
        "2:36: fleet.types.long.footprint.0: must be a list of at most 2, got a list of 3"]),
    "no unit": ("[[1, 0 m], [0 m, 1 m], [-1 m, -1 m]]}}}", [
        "2:37: fleet.types.long.footprint.0.0: 1 has no unit; allowed: m, km, cm, mm, e.g. "
        "'-38 m'"]),
    "a corner twice": ("[[1 m, 0 m], [0 m, 1 m], [0 m, 1 m], [-1 m, -1 m]]}}}", [
        "2:60: fleet.types.long.footprint.2: is the same as the corner before"]),
    "crossed": ("[[1 m, 1 m], [-1 m, -1 m], [1 m, -1 m], [-1 m, 1 m]]}}}", [
        "2:35: fleet.types.long.footprint: must not cross itself; the sides from corner 0 and from "
        "corner 2 do (counted from 0)"]),
    "wound twice": ("[[1 m, 0 m], [-0.81 m, 0.59 m], [0.31 m, -0.95 m], [0.31 m, 0.95 m], "
                    "[-0.81 m, -0.59 m]]}}}", [
        "2:35: fleet.types.long.footprint: must not cross itself; the sides from corner 0 and from "
        "corner 2 do (counted from 0)"]),
    "a dent": ("[[1 m, 1 m], [-1 m, 1 m], [-0.1 m, 0 m], [-1 m, -1 m], [1 m, -1 m]]}}}", [
        "2:61: fleet.types.long.footprint.2: is no corner of a convex polygon; allowed: convex "
        "ones"]),
    "a dent, clockwise": (
        "[[1 m, -1 m], [-1 m, -1 m], [-0.1 m, 0 m], [-1 m, 1 m], [1 m, 1 m]]}}}", [
            "2:63: fleet.types.long.footprint.2: is no corner of a convex polygon; allowed: convex "
            "ones"]),
    "a spike": ("[[-1 m, -1 m], [3 m, -1 m], [1 m, -1 m], [1 m, 1 m], [-1 m, 1 m]]}}}", [
        "2:35: fleet.types.long.footprint: must not cross itself; the sides from corner 0 and from "
        "corner 2 do (counted from 0)"]),
    "the middle outside": ("[[2 m, 0 m], [3 m, 0 m], [2 m, 1 m]]}}}", [
        "2:35: fleet.types.long.footprint: must have (0 m, 0 m) inside, the point around which the "
        "robot turns"]),
    "the middle on a side": ("[[0 m, -1 m], [1 m, 0 m], [0 m, 1 m]]}}}", [
        "2:35: fleet.types.long.footprint: must have (0 m, 0 m) inside, the point around which the "
        "robot turns"]),
    "another radius": (f"{BAR}, radius: 0.2 m}}}}}}", [
        "2:113: fleet.types.long.radius: must be that of the circle around the footprint, "
        "0.632456 m, or left out, got 0.2 m"]),
    "a laser beside the body": (f"{BAR}}}}}, robots: long}}\nrobot: {{laser: {{y: 0.3 m}}}}", [
        "3:16: robot.laser: is mounted 0.3 m from the middle of a long, outside of its footprint; "
        "allowed: on the body"]),
    "too wide for a door": (
        f"{BAR}}}}}, robots: long}}\n"
        "environment: {terrain: {office: {size: [20 m, 12 m], door: 0.3 m}}}", [
            "3:60: environment.terrain.office.door: 0.3 m is too narrow for long; allowed: at "
            "least its width of 0.4 m"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_where_it_stands(tmp_path, case):
    text, complaints = WRONG[case]
    file = tmp_path / "case.yaml"
    file.write_text(f"{HEAD}{text}\n")
    with pytest.raises(InputError) as caught:
        load(file)
    assert str(caught.value).splitlines() == [f"{file}:{line}" for line in complaints]


def scenario(corners, **more):
    return from_mapping({"name": "x", "fleet": {"robots": "long", "types": {
        "long": {"footprint": corners, **more}}}}).scenario


def body(corners, **more):
    return scenario(corners, **more).fleet.types["long"]


RECTANGLE = [["0.6 m", "0.2 m"], ["-0.6 m", "0.2 m"], ["-0.6 m", "-0.2 m"], ["0.6 m", "-0.2 m"]]


def test_a_rectangle_has_both_radii():
    long = body(RECTANGLE)
    assert (long.inscribed_radius_m, long.radius_m) == (0.2, math.hypot(0.6, 0.2))
    assert body(RECTANGLE, radius="0.632 m") == long, "a radius may be rounded to a millimetre"


def test_a_disc_has_one_radius_and_no_corners():
    disc = BodyType()
    assert (disc.inscribed_radius_m, disc.corners_m) == (0.26, ())


def test_either_way_around_is_the_same_polygon():
    clockwise = body([*reversed(RECTANGLE)])
    assert set(clockwise.corners_m) == set(body(RECTANGLE).corners_m)
    for corners in (clockwise.corners_m, body(RECTANGLE).corners_m):
        assert all(a[0] * b[1] - a[1] * b[0] > 0.0 for a, b in footprint.sides(corners))


def test_a_resolved_footprint_loads_again(tmp_path):
    complete = scenario(RECTANGLE)
    file = Path(tmp_path, "again.yaml")
    file.write_text(resolved(complete, tmp_path))
    assert resolved(load(file).scenario, tmp_path) == file.read_text()


def test_a_corner_on_a_straight_side_is_allowed():
    assert body([*RECTANGLE[:1], ["0 m", "0.2 m"], *RECTANGLE[1:]]).inscribed_radius_m == 0.2


@given(st.lists(st.floats(0.0, 2.0 * math.pi), min_size=3, max_size=12, unique=True),
       st.floats(0.1, 3.0), st.booleans())
def test_corners_on_a_circle_lie_between_the_radii(angles, radius_m, clockwise):
    """Any polygon that has its corners on a circle and the circle's middle inside."""
    angles = sorted(angles)
    gaps = [(b - a) % (2.0 * math.pi) for a, b in zip(angles, angles[1:] + angles[:1], strict=True)]
    corners = [(radius_m * math.cos(a), radius_m * math.sin(a)) for a in angles]
    wrong = list(footprint.complaints(corners[::-1] if clockwise else corners))
    if min(gaps) < 1e-3 or abs(max(gaps) - math.pi) < 1e-3:
        return  # rounding decides
    assert bool(wrong) == (max(gaps) > math.pi)
    if not wrong:
        inner_m, outer_m = footprint.radii_m(corners)
        assert outer_m == pytest.approx(radius_m)
        assert inner_m == pytest.approx(radius_m * math.cos(max(gaps) / 2.0))
        assert footprint.holds(corners, 0.99 * inner_m, 0.0)
        assert not footprint.holds(corners, 0.0, 1.01 * outer_m)
