"""Logs that gmapping has corrected: the odometry that they hide, and the ends of loops."""

import subprocess
import sys

import corrected_log
import numpy as np
import pytest

from desim.imports.slam_logs.carmen import read_carmen
from desim.imports.slam_logs.relations import errors_of, read_relations
from desim.robot.transforms import compose, motion_between

STEP, CORRECTION = np.array((0.5, 0.0, 0.05)), np.array((0.02, -0.01, 0.01))


@pytest.fixture
def written(tmp_path):
    """A circle of 130 scans, with two readings of the odometer between each two, and gmapping's
    correction at each; the odometry and the corrected poses."""
    path, lines, pose, odometry, all_of = tmp_path / "circle-corrected.log", [], np.zeros(3), [
        np.zeros(3)], []
    for k in range(130):
        if k:
            odometry.append(compose(compose(odometry[-1], STEP), STEP))
            for _ in range(2):
                pose = compose(pose, STEP)
                lines.append("ODOM {} {} {} 0 0 0 -0.5 robot -0.5".format(*pose))
            pose = compose(pose, CORRECTION)
        place = "{} {} {}".format(*pose)
        lines += [f"FLASER 3 1.5 2.5 1.0 {place} {place} -0.5 robot -0.5",
                  f"ODOM {place} 0 0 0 -0.5 robot -0.5"]
        all_of.append(pose)
    path.write_text("\n".join(lines))
    return path, np.array(odometry), np.array(all_of)


def test_the_odometry_is_what_the_lines_between_scans_add_up_to(written):
    path, odometry, _ = written
    assert corrected_log.read(path)[1] == pytest.approx(odometry, abs=1e-9)


def test_but_not_where_a_correction_counts_as_motion(written, monkeypatch):
    monkeypatch.setattr(corrected_log, "motion_between",
                        lambda before, after: motion_between(before, after) + CORRECTION)
    with pytest.raises(AssertionError):
        test_the_odometry_is_what_the_lines_between_scans_add_up_to(written)


def test_what_it_writes_is_read_as_a_log_with_relations(written, tmp_path):
    path, odometry, corrected = written
    done = subprocess.run([sys.executable, corrected_log.__file__, path, "--to", tmp_path / "out"],
                          capture_output=True, text=True, check=True)
    log, true = read_carmen(tmp_path / "out.log"), read_relations(tmp_path / "out.relations")
    assert log.odometry == pytest.approx(odometry, abs=1e-5)
    errors = errors_of(log.times_s, corrected, true).translation_m
    assert len(errors) == len(corrected_log.loops(corrected)) > 10
    assert errors.max() < 1e-5
    assert done.stdout == f"130 scans, 132 m; {len(errors)} relations, loops: 115 to 118 m\n"
