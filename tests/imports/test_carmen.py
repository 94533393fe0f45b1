"""Logs of CARMEN and relations: whole small files, and the exact texts of errors."""

import gzip

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from desim.errors import InputError
from desim.imports.slam_logs.carmen import read_carmen
from desim.imports.slam_logs.relations import Relations, errors_of, read_relations

POSE = "1.5 2 0.5"
FLASER = f"FLASER 3 1.25 81.91 2.5 {POSE} {POSE} 10.25 robot 0.25"
ROBOTLASER = ("ROBOTLASER1 4 -0.785 1.57 0.785 30.0 0.01 0 3 1.25 81.91 2.5 2 7 8 1.7 2 0.5 "
              "1.5 2 0.5 0.1 0.2 0.3 0.3 0.3 10.25 robot 0.25")

RAWLASER = "RAWLASER1 0 -0.785 1.57 0.785 30 0.01 0 3 1 2 3 0 10.25 robot 0.25"


def written(tmp_path, text):
    path = tmp_path / "a.log"
    path.write_text(text)
    return path


def test_lines_of_the_old_kind(tmp_path):
    log = read_carmen(written(tmp_path, f"# by hand\nPARAM robot_front_laser_max 40 x 0\n\n"
                                        f"ODOM 1 2 3 0 0 0 10 robot 0\n{FLASER}\nSYNC x\n"))
    assert log.times_s.tolist() == [10.25]
    assert log.odometry.tolist() == [[1.5, 2.0, 0.5]]
    assert log.ranges.tolist() == [[1.25, 81.91, 2.5]]
    assert np.degrees(log.laser.angle_min_rad) == pytest.approx(-90.0)
    assert np.degrees(log.laser.increment_rad) == pytest.approx(90.0)
    assert log.laser.longest_m == pytest.approx(0.98 * 40.0)


@pytest.mark.parametrize("beams, first_deg, apart_deg", [
    (180, -90.0, 1.0), (181, -90.0, 1.0), (360, -90.0, 0.5), (361, -90.0, 0.5), (401, -50.0, 0.25),
    (91, -90.0, 2.0), (1, -90.0, 180.0)])
def test_the_angles_of_beams_that_no_line_gives(tmp_path, beams, first_deg, apart_deg):
    line = f"FLASER {beams} {'1.0 ' * beams}{POSE} {POSE} 10 robot 0"
    laser = read_carmen(written(tmp_path, line)).laser
    assert np.degrees(laser.angle_min_rad) == pytest.approx(first_deg)
    assert np.degrees(laser.increment_rad) == pytest.approx(apart_deg)


def test_lines_of_the_new_kind(tmp_path):
    log = read_carmen(written(tmp_path, f"{ROBOTLASER}\n{FLASER}\n"))  # the kind that comes first
    assert log.times_s.tolist() == [10.25]
    assert log.odometry[0].tolist() == pytest.approx([1.7, 2.0, 0.5])  # the laser's own pose
    assert (log.laser.angle_min_rad, log.laser.increment_rad) == (-0.785, 0.785)
    assert log.laser.longest_m == pytest.approx(0.98 * 30.0)


def test_scans_without_a_pose_are_placed_between_odometry(tmp_path):
    odometry = "ODOM 2 0 -3 0 0 0 10.5 robot 1\nODOM 1 4 3 0 0 0 10 robot 1\n"  # not in order
    late = RAWLASER.replace("10.25", "11")
    log = read_carmen(written(tmp_path, f"{RAWLASER}\n{late}\n{odometry}"))
    assert log.times_s.tolist() == [10.25] and log.ranges.tolist() == [[1.0, 2.0, 3.0]]
    assert log.odometry[0].tolist() == pytest.approx([1.5, 2.0, np.pi])  # through pi, not through 0
    assert (log.laser.angle_min_rad, log.laser.increment_rad) == (-0.785, 0.785)


def test_scans_with_a_pose_go_before_those_without(tmp_path):
    text = f"ODOM 0 0 0 0 0 0 10\nRAWLASER1 x\n{FLASER}\n{RAWLASER}"
    log = read_carmen(written(tmp_path, text))
    assert log.ranges.tolist() == [[1.25, 81.91, 2.5]]


@given(st.lists(st.lists(st.sampled_from(
    ["ODOM", "FLASER", "ROBOTLASER1", "RAWLASER1", "PARAM", "robot_front_laser_max", "0", "1", "3",
     "-2.5", "1e300", "-1e-300", "nan", "inf", "x", "9999999", "\x00", "\ud7ff"]),
    max_size=24), max_size=6))
@settings(max_examples=200, deadline=None,
          suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_is_a_log_or_one_clear_error(tmp_path, lines):
    path = tmp_path / "any.log"
    path.write_text("\n".join(" ".join(words) for words in lines), "utf-8")
    try:
        log = read_carmen(path)
    except InputError as error:
        assert str(error).startswith(f"{path}:")
    else:
        assert np.isfinite(log.odometry).all() and np.isfinite(log.ranges).all()


def test_a_compressed_log_is_the_same(tmp_path):
    packed = tmp_path / "a.log.gz"
    packed.write_bytes(gzip.compress(FLASER.encode()))
    plain = read_carmen(written(tmp_path, FLASER))
    assert read_carmen(packed).ranges.tolist() == plain.ranges.tolist()


def test_poses_that_somebody_has_corrected_are_no_mount(tmp_path):
    lines = [f"FLASER 1 2.0 {x} 0 0 {x * x} 1 0 {x} robot 0" for x in range(5)]
    log = read_carmen(written(tmp_path, "\n".join(lines)))
    assert log.odometry[:, 0].tolist() == [0.0, 1.0, 4.0, 9.0, 16.0]


WRONG = {
    "empty": ("", ": the log ends without a scan; wanted: a log of CARMEN with lines FLASER, "
              "ROBOTLASER1, or RAWLASER1 and ODOM"),
    "no scan": ("ODOM 1 2 3\n", ":1: the log ends without a scan; wanted: a log of CARMEN with "
                                "lines FLASER, ROBOTLASER1, or RAWLASER1 and ODOM"),
    "count": ("\nFLASER x 1 2\n", ":2: FLASER has 'x' as the number of ranges; allowed: 0 to "
                                  "100000"),
    "no count": ("FLASER", ":1: FLASER ends after 0 values; wanted: the number of ranges, the "
                           "values 1 to 1"),
    "short": ("FLASER 5 1 2\n", ":1: FLASER ends after 3 values; wanted: 5 ranges, the values 2 to "
                                "6"),
    "no pose": ("FLASER 2 1 2 3\n", ":1: FLASER ends after 4 values; wanted: two poses and a time, "
                                    "the values 4 to 10"),
    "range": (FLASER.replace("2.5", "2,5", 1), ":1: FLASER has '2,5' where a number is wanted"),
    "nan": (FLASER.replace("2.5", "nan", 1), ":1: FLASER has 'nan' where a number is wanted"),
    "pose": (FLASER.replace("0.5", "north"), ":1: FLASER has 'north' where a number is wanted"),
    "odometry": ("ODOM 1 x 3\n", ":1: ODOM has 'x' where a number is wanted"),
    "odometry ends": ("ODOM 1\n", ":1: ODOM ends after 1 values; wanted: x, y and theta, the "
                                  "values 1 to 3"),
    "two lasers": (f"{FLASER}\nFLASER 2 1 2 {POSE} {POSE} 11 robot 1\n",
                   ":2: FLASER has 2 ranges, the first scan 3; wanted: one laser"),
    "no angle": (ROBOTLASER.replace("1.57 0.785", "1.57 0"),
                 ":1: ROBOTLASER1 has angles 0 apart; wanted: rad, not 0"),
    "remissions": (ROBOTLASER.replace(" 2 7 8 ", " 99 7 8 "),
                   ":1: ROBOTLASER1 ends after 28 values; wanted: two poses and a time, the values "
                   "112 to 123"),
    "parameter": ("PARAM robot_front_laser_max far\n",
                  ":1: PARAM robot_front_laser_max has 'far' where a number is wanted"),
    "no odometry": (RAWLASER, ":1: the log ends, and no RAWLASER1 is within the time of lines "
                              "ODOM; wanted: scans with odometry"),
    "two raw lasers": (f"ODOM 0 0 0 0 0 0 9\nODOM 0 0 0 0 0 0 11\n{RAWLASER}\n"
                       f"{RAWLASER.replace(' 3 1 2 3 ', ' 2 1 2 ')}\n",
                       ":4: RAWLASER1 has 2 ranges, the first scan 3; wanted: one laser"),
    "no text": ("FLASER 1 \x1b \n", ":1: FLASER ends after 2 values; wanted: two poses and a time, "
                                    "the values 3 to 9"),
}


@pytest.mark.parametrize("name", WRONG)
def test_the_error_of_a_wrong_log(tmp_path, name):
    text, message = WRONG[name]
    path = written(tmp_path, text)
    with pytest.raises(InputError) as error:
        read_carmen(path)
    assert str(error.value) == f"{path}{message}"


def logged(*scans):
    """Scans of one beam, each at an x (m) and a time (s)."""
    return "".join(f"FLASER 1 2.0 {x} 0 0 {x} 0 0 {time_s} robot 0\n" for x, time_s in scans)


def test_the_warning_of_jumps_of_the_odometry_has_the_first_line_and_their_number(tmp_path):
    path = written(tmp_path, logged((0, 0), (0.9, 0.1), (3.9, 0.2), (4.0, 0.3), (54.0, 0.4)))
    log = read_carmen(path)
    assert log.warnings == (f"{path}:3: the odometry moves 3 m in 0.1 s, farther than a robot "
                            "drives; 2 such jumps in the log",)
    assert log.odometry[:, 0].tolist() == [0.0, 0.9, 3.9, 4.0, 54.0]  # they stay
    # the twin: a log with a gap, in which a robot may drive so far
    assert read_carmen(written(tmp_path, logged((0, 0), (3.0, 1.0), (53.0, 11.0)))).warnings == ()


def test_scans_stamped_earlier_than_one_before_are_left_out_with_a_warning(tmp_path):
    path = written(tmp_path, logged((0, 10), (0.1, 10.2), (0.2, 9), (0.3, 10.1), (0.4, 10.2)))
    log = read_carmen(path)
    assert log.warnings == (f"{path}:3: the time stamp is 1.2 s earlier than one before; 2 scans "
                            "with such stamps left out",)
    assert log.times_s.tolist() == [10.0, 10.2, 10.2]
    assert log.odometry[:, 0].tolist() == [0.0, 0.1, 0.4]


def test_the_error_of_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="No such file or directory"):
        read_carmen(tmp_path / "none.log")
    broken = tmp_path / "a.log.gz"
    broken.write_bytes(gzip.compress(FLASER.encode() * 1000)[:-20])
    with pytest.raises(InputError, match=r"a\.log\.gz:\d+: damaged: Compressed file "):
        read_carmen(broken)


def test_relations_and_their_errors(tmp_path):
    path = tmp_path / "a.relations"
    path.write_text("# t1 t2 x y z roll pitch yaw\n0 2 2 0 0 0 0 0.5\n\n1 2 1.0 1.0 0 0 0 0\n"
                    "0 99 0 0 0 0 0 0\n")
    true = read_relations(path)
    assert true.poses.tolist() == [[2.0, 0.0, 0.5], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
    poses = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    errors = errors_of(np.array([0.0, 2.0]), poses, true)
    assert errors.translation_m.tolist() == [0.0, 1.0]  # the third is outside of the log
    assert errors.rotation_deg.tolist() == pytest.approx([np.degrees(0.5), 0.0])
    assert errors.summary()["translation_m"] == {"mean": 0.5, "std": 0.5, "max": 1.0}


def test_a_turn_around_is_no_long_way():
    times, poses = np.array([0.0, 1.0]), np.array([[0.0, 0.0, 3.1], [0.0, 0.0, -3.1]])
    true = Relations(np.array([[0.0, 0.5], [0.0, 1.0]]), np.array([[0, 0, np.pi - 3.1], [0, 0, 0]]))
    found = errors_of(times, poses, true).rotation_deg
    assert found == pytest.approx([0.0, np.degrees(2 * np.pi - 6.2)], abs=1e-6)


@pytest.mark.parametrize("text, message", [
    ("1 2 3\n", ":1: has 3 values; wanted: t1 t2 x y z roll pitch yaw"),
    ("\n1 2 0 0 0 0 0 x\n", ":2: a relation has 'x' where a number is wanted"),
    ("", ": has no relation; wanted: lines of t1 t2 x y z roll pitch yaw")])
def test_the_error_of_wrong_relations(tmp_path, text, message):
    path = written(tmp_path, text)
    with pytest.raises(InputError) as error:
        read_relations(path)
    assert str(error.value) == f"{path}{message}"


def test_relations_of_another_log_are_refused():
    true = Relations(np.array([[50.0, 51.0]]), np.zeros((1, 3)))
    with pytest.raises(InputError) as error:
        errors_of(np.array([0.0, 2.0]), np.zeros((2, 3)), true)
    assert str(error.value) == "--relations: none is within the log, which is from 0 to 2 s"
