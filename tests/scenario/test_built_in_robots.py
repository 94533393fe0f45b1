"""The robots that need no declaration, and what a scenario may say beside them."""

import pytest

from desim.errors import InputError
from desim.scenario import yaml12
from desim.scenario.load import from_mapping
from desim.scenario.resolved import resolved
from desim.scenario.robot_types import types_by_name
from desim.scenario.schema.built_in_robots import BUILT_IN_TYPES


def scenario(text):
    return from_mapping(yaml12.parse(f"name: x\n{text}", "text")[0]).scenario


def only(text):
    """The one type of a scenario's robots, complete."""
    found = scenario(text)
    (kind,) = found.fleet.types.values()
    return kind


# From the manufacturers' data sheets: length, width, height in m; m/s; range in m, laser in Hz.
SHEETS = {
    "turtlebot3_burger": (0.138, 0.178, 0.192, 0.22, 3.5, 5.0),
    "turtlebot3_waffle": (0.281, 0.306, 0.141, 0.26, 3.5, 5.0),
    "turtlebot4": (0.342, 0.339, 0.351, 0.31, 12.0, 5.5),
    "husky": (0.990, 0.670, 0.390, 1.0, 20.0, 50.0),
    "jackal": (0.508, 0.430, 0.250, 2.0, 20.0, 50.0),
}


@pytest.mark.parametrize("name", SHEETS)
def test_built_in_robots_have_the_size_of_their_data_sheets(name):
    length_m, width_m, height_m, speed_mps, range_m, rate_hz = SHEETS[name]
    kind = only(f"fleet: {{robots: {name}}}")
    around = kind.footprint or [(-kind.radius_m, -kind.radius_m), (kind.radius_m, kind.radius_m)]
    sides_m = [max(axis) - min(axis) for axis in zip(*around, strict=True)]
    assert sides_m == pytest.approx([length_m, width_m], abs=0.004)
    assert (kind.height_m, kind.max_speed_mps) == (height_m, speed_mps)
    laser = kind.robot.laser
    assert (laser.max_range_m, float(laser.rate_hz)) == (range_m, rate_hz)
    assert 0.0 < laser.height_m < height_m + 0.2


def test_every_built_in_robot_is_a_whole_scenario():
    for name in BUILT_IN_TYPES:
        whole = scenario(f"fleet: {{robots: {name}}}")
        again = from_mapping(yaml12.parse(resolved(whole), "text")[0]).scenario
        assert resolved(again) == resolved(whole)


def test_full_circle_has_a_beam_straight_ahead_and_none_twice():
    laser = only("fleet: {robots: turtlebot3_burger}").robot.laser
    degrees = [57.29577951308232 * (laser.angle_min_rad + i * laser.increment_rad)
               for i in range(laser.beams)]
    assert degrees == pytest.approx(list(range(360)))


def test_what_a_scenario_says_of_all_robots_holds_for_a_built_in_one():
    laser = only("fleet: {robots: turtlebot3_burger}\n"
                 "robot: {laser: {rate: 10 Hz}, mapping: {usable_range: 3 m}}").robot.laser
    assert (float(laser.rate_hz), laser.max_range_m, laser.height_m) == (10.0, 3.5, 0.182)
    assert only("fleet: {robots: husky}\nrobot: {laser: lds01}").robot.laser.max_range_m == 3.5
    several = only("fleet: {robots: husky}\nrobot: {lasers: {low: lds01}}").robot
    assert (several.laser, list(several.lasers)) == (None, ["low"])


def test_type_with_the_name_of_a_built_in_one_says_what_is_different():
    slow = only("fleet: {robots: jackal, types: {jackal: {max_speed: 0.5 m/s, "
                "robot: {laser: {max_range: 8 m}}}}}")
    assert (slow.max_speed_mps, slow.height_m, slow.robot.laser.max_range_m) == (0.5, 0.25, 8.0)
    with pytest.raises(InputError) as error:
        scenario("fleet: {robots: jackal, types: {jackal: {radius: 1 m}}}")
    assert error.value.args == (
        "scenario: fleet.types.jackal.radius: must be that of the circle around the footprint, "
        "0.332778 m, or left out, got 1 m",)


def test_laser_with_a_name_takes_nothing_from_the_fleets():
    types = "fleet: {robots: a, types: {a: {robot: {laser: lms500}}}}\nrobot: {laser: {beams: 10}}"
    assert only(types).robot.laser.beams == 180


def test_scans_of_a_built_in_robot_are_checked_like_any_others():
    with pytest.raises(InputError) as error:
        scenario("fleet: {robots: husky}\nphysics: {rate: 30 Hz}")
    assert error.value.args == (
        "scenario: fleet.types.husky.robot.laser.rate: must be at most that of physics, 30 Hz, got "
        "50 Hz: scans see the pose of the last tick; allowed with pose: interpolated",)


def test_only_types_that_stand_in_the_scenario_are_filled_in():
    """Each load asks for them some twenty times, with clocks once more a robot."""
    found = types_by_name(from_mapping({
        "name": "s", "fleet": {"robots": "turtlebot3_burger"}, "robot": {"laser": {"beams": 20}}}
    ).scenario)
    filled = {name for name, built_in in BUILT_IN_TYPES.items() if found[name] is not built_in}
    assert filled == {"turtlebot3_burger"}
