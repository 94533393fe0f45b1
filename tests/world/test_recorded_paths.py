"""Recorded paths: how a CSV becomes the motion of robots."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import InputError
from desim.robot.coordination.strategies.follow import Follow
from desim.scenario.load import from_mapping
from desim.scenario.schema.environment import Shape
from desim.scenario.schema.fleet import BodyType
from desim.units import NS_PER_S
from desim.world import recorded_paths
from desim.world.fleet import RobotSpec, place_fleet
from desim.world.path_doubts import path_doubts
from desim.world.recorded_motion import RecordedMotion
from desim.world.recorded_paths import read_paths, wrapped
from desim.world.sources import load

HEAD = "time_s,robot,x_m,y_m,yaw_rad"


@pytest.fixture
def read(tmp_path):
    """Reads lines as the file of a robot, or of several."""
    def of(*lines, robots=("robot_0",), **params):
        path = tmp_path / "walk.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return read_paths(Follow.Params(file=str(path), **params), robots, 9 * NS_PER_S)
    return of


def at(path, time_s):
    """(x, y, yaw), the way that it has gone, and its velocity, at a time."""
    pose, way_m, velocity = RecordedMotion([path]).at(round(time_s * NS_PER_S))
    return tuple(pose[0].tolist()), float(way_m[0]), tuple(velocity[0].tolist())


def test_recorded_poses_are_met_exactly_and_between_them_it_goes_straight_on(read):
    path = read(HEAD, "0,robot_0,1.1,2.2,0.3", "2,robot_0,4.1,-1.8,0.3")["robot_0"]
    assert at(path, 0)[:2] == ((1.1, 2.2, 0.3), 0.0)
    assert at(path, 0.5)[0] == pytest.approx((1.85, 1.2, 0.3))
    assert at(path, 0.5)[1] == pytest.approx(1.25)
    assert at(path, 2) == at(path, 99) == ((4.1, -1.8, 0.3), pytest.approx(5.0), (0.0, 0.0, 0.0))
    forward, left, turn = at(path, 1)[2]
    assert math.hypot(forward, left) == pytest.approx(2.5) and turn == 0.0
    # against its heading: the way points to atan2(-4, 3)
    assert math.atan2(left, forward) == pytest.approx(math.atan2(-4, 3) - 0.3)


def test_it_turns_the_short_way_round(read):
    path = read(HEAD, "0,robot_0,0,0,3", "1,robot_0,0,0,-3", "2,robot_0,0,0,3")["robot_0"]
    gap = 2 * math.pi - 6
    assert at(path, 0.25)[0][2] == pytest.approx(3 + gap / 4)
    assert at(path, 0.75)[0][2] == pytest.approx(-3 - gap / 4)
    assert at(path, 0.5)[2][2] == pytest.approx(gap)
    assert at(path, 1.5)[2][2] == pytest.approx(-gap)


def test_without_the_short_way_it_turns_the_long_one(read, monkeypatch):
    """The twin."""
    monkeypatch.setattr(recorded_paths, "wrapped", lambda yaw_rad: yaw_rad)
    path = read(HEAD, "0,robot_0,0,0,3", "1,robot_0,0,0,-3")["robot_0"]
    assert at(path, 0.5)[0][2] == pytest.approx(0)


@given(st.lists(st.tuples(st.integers(1, 5000), st.integers(-3000, 3000), st.integers(-3000, 3000),
                          st.integers(-3141, 3141)), min_size=1, max_size=12), st.data())
def test_it_is_where_numpy_interpolates(tmp_path_factory, rows, data):
    """Against np.interp of the unwrapped heading; the poses of desim export, in ms, mm and mrad."""
    file = tmp_path_factory.mktemp("walk") / "poses.csv"
    times = np.cumsum([row[0] for row in rows]) * 1_000_000
    lines = [f'{t},"robot_0",{x},{y},{w}' for t, (_, x, y, w) in zip(times, rows, strict=True)]
    order = data.draw(st.permutations(lines))
    file.write_text('"time_ns","robot","x_mm","y_mm","yaw_mrad"\n' + "\n".join(order) + "\n")
    path = read_paths(Follow.Params(file=str(file), begin="0 s"), ["robot_0"], 0)["robot_0"]
    motion, values = RecordedMotion([path]), np.array(rows)[:, 1:] / 1000
    for time_ns in sorted(data.draw(st.lists(st.integers(0, int(times[-1]) + 10**9), max_size=9))):
        motion.go_on(time_ns)
        x, y, yaw = motion.at(time_ns)[0][0]
        assert (x, y) == pytest.approx([np.interp(time_ns, times, values[:, i]) for i in (0, 1)])
        wanted = np.interp(time_ns, times, np.unwrap(values[:, 2]))
        assert float(wrapped(yaw - wanted)) == pytest.approx(0, abs=1e-9)
    for time_ns, value in zip(times, values, strict=True):
        assert (RecordedMotion([path]).at(int(time_ns))[0][0] == value).all()


def test_the_run_begins_with_the_first_pose_or_where_begin_says(read):
    rows = HEAD, "1700000000,a,0,0,0", "1700000004,b,4,0,0", "1700000008,b,8,0,0"
    both = {"robots": ("robot_0", "robot_1"), "names": {"robot_0": "a", "robot_1": "b"}}
    first = read(*rows, **both)["robot_1"]
    assert [at(first, t)[0][0] for t in (0, 4, 6, 8)] == [4, 4, 6, 8]
    later = read(HEAD, "0,robot_0,0,0,0", "4,robot_0,4,0,0", begin="1 s")["robot_0"]
    assert at(later, 0)[:2] == ((1, 0, 0), 0) and at(later, 3)[:2] == ((4, 0, 0), 3)


def test_robots_start_where_their_recordings_begin(tmp_path):
    (tmp_path / "walk.csv").write_text(f"{HEAD}\n1,robot_0,3,4,0.5\n1,robot_1,-3,1,-2\n"
                                       "4,robot_0,5,4,0.5\n5,robot_1,-3,0,-2\n")
    fleet = place_fleet(from_mapping({"name": "a", "fleet": {"size": 2}, "coordination": {
        "strategy": "follow", "file": str(tmp_path / "walk.csv")}}).scenario)
    assert [robot[0:1] + robot[2:5] for robot in fleet] == [
        ("robot_0", 3.0, 4.0, 0.5), ("robot_1", -3.0, 1.0, -2.0)]


def test_without_headings_it_faces_ahead(read):
    path = read("time_s,robot,x_m,y_m", "0,robot_0,0,0", "1,robot_0,0,0", "2,robot_0,0,1",
                "3,robot_0,0,1", "4,robot_0,-1,1")["robot_0"]
    assert [at(path, t)[0][2] for t in (0, 1, 2, 3, 4)] == pytest.approx(
        [math.pi / 2] * 3 + [-math.pi] * 2)
    assert at(path, 1)[2] == pytest.approx((1, 0, 0))
    still = read("time_s,robot,x_m,y_m", "0,robot_0,3,4")["robot_0"]
    assert at(still, 5) == ((3, 4, 0), 0, (0, 0, 0))


def test_other_columns_and_units(read):
    path = read("frame,x_m,robot,yaw_deg,y_mm,time_s", "map,1,robot_0,90,500,0")["robot_0"]
    assert at(path, 0)[0] == (1.0, 0.5, pytest.approx(math.pi / 2))


def test_of_two_poses_at_a_time_the_later_line_counts(read):
    path = read(HEAD, "0,robot_0,0,0,0", "1,robot_0,5,5,0", "1,robot_0,1,1,0")["robot_0"]
    assert at(path, 1)[0] == (1, 1, 0) and path.lines.tolist() == [2, 4]


@pytest.mark.parametrize("lines, complaint", [
    ((HEAD,), ".file: FILE: has no poses"),
    (("",), ".file: FILE:1: there is no column of robot"),
    (("robot,x_m,y_m",), ".file: FILE:1: there is no column of time_ns or time_s; "
     "there are robot, x_m, y_m"),
    (("time_s,robot,x,y_m",), ".file: FILE:1: there is no column of x_mm or x_m; "
     "there are time_s, robot, x, y_m"),
    ((HEAD, "0,robot_0,1,2,north"),
     ".file: FILE:2: yaw_rad is 'north'; allowed: an angle"),
    ((HEAD, "0,robot_0,1,2,0", "1,robot_0,nan,2,0"),
     ".file: FILE:3: x_m is 'nan'; allowed: a place"),
    ((HEAD, "0,robot_0,1e7,2,0"), ".file: FILE:2: x_m is '1e7'; allowed: a place"),
    ((HEAD, "0,robot_0,1"), ".file: FILE:2: y_m is ''; allowed: a place"),
    ((HEAD, "-1,robot_0,1,2,0"),
     ".file: FILE:2: time_s is '-1'; allowed: a time, at least 0, at most 4e9 s"),
    ((HEAD, "0,,1,2,0"), ".file: FILE:2: robot is missing"),
    ((HEAD, "0,robot_0,1,2,0,7"),
     ".file: FILE:2: 6 cells; allowed: at most 5, one for each column"),
    ((HEAD, "0,tb3_0,1,2,0", "0,robot_9,1,2,0"),
     ".file: FILE: unknown robot 'robot_0' (did you mean 'robot_9'?); allowed: tb3_0, robot_9; "
     "names: {robot_0: NAME} says who robot_0 is there"),
])
def test_what_is_wrong_with_a_file(read, tmp_path, lines, complaint):
    with pytest.raises(InputError) as caught:
        read(*lines)
    assert str(caught.value).replace(str(tmp_path / "walk.csv"), "FILE") == complaint


def test_a_trajectory_of_another_format_is_named_with_the_way_here(read, tmp_path):
    with pytest.raises(InputError) as caught:
        read("0.0 1 2 0 0 0 0 1", "0.1 1 2 0 0 0 0 1")
    assert str(caught.value) == (
        f".file: {tmp_path / 'walk.csv'}: is a TUM trajectory; wanted: a CSV of poses, as desim "
        "export RUN --csv FOLDER writes of what desim import makes of it")


def test_a_file_that_is_not_there_and_a_robot_that_is_not(read, tmp_path):
    with pytest.raises(InputError) as caught:
        read_paths(Follow.Params(file=str(tmp_path / "no.csv")), ["robot_0"], 0)
    assert str(caught.value) == (f".file: {tmp_path / 'no.csv'}: cannot be read: No such file or "
                                 "directory")
    with pytest.raises(InputError, match=r"^\.names: unknown robot 'robot_1' \(did you mean "
                                         r"'robot_0'\?\); allowed: robot_0$"):
        read(HEAD, names={"robot_1": "a"})


def test_a_jump_is_said_with_the_line_where_it_ends(read):
    path = read(HEAD, "0,robot_0,0,0,0", "1,robot_0,1,0,0", "2,robot_0,9,0,0")["robot_0"]
    spec = RobotSpec("robot_0", BodyType(), 0.0, 0.0, 0.0, path=path)
    *_, jump = path_doubts([spec], load(Shape(size=("20 m", "20 m"))))
    assert jump.endswith("walk.csv:4: robot_0: a jump of 8.00 m within 1 s, the first of 1; "
                         "max_speed is 1.2 m/s")
