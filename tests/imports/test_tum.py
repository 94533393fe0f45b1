"""``desim import`` of TUM trajectories, a robot a file."""

import pytest
from typer.testing import CliRunner

from desim.api import recording_of
from desim.cli import app
from desim.errors import InputError
from desim.report.side_by_side import outcome
from desim.results.comparison import ComparedRuns

pytest.importorskip("rosbags", reason="rosbags is not installed")
from desim.imports.imported_run import import_recording  # noqa: E402

FIRST_S = 1305031102


def tum(path, rows):
    path.write_text("# ground truth\n# timestamp tx ty tz qx qy qz qw\n\n" + "".join(
        f"{time_s} {x} {y} {z} 0 0 {qz} {qw}\n" for time_s, x, y, z, qz, qw in rows))
    return path


def test_files_are_robots_of_one_clock(tmp_path):
    """Stamps are exact to the nanosecond, though floats of seconds since 1970 are not."""
    one = tum(tmp_path / "robot-a.txt", [(f"{FIRST_S}.{k}00000001", k, 0, 0, 0, 1)
                                         for k in range(5)])
    other = tum(tmp_path / "robot-b.tum", [(f"{FIRST_S}.{k}00000001", 0, k, 0, 1, 0)
                                           for k in range(5)])
    words = ["import", str(one), str(other), "--out", str(tmp_path / "out"), "--name", "lab"]
    done = CliRunner().invoke(app, words)
    assert done.stdout.splitlines()[:-1] == [
        "2 robots, 0.4 s, 5 poses each", "  robot_a: robot-a.txt", "  robot_b: robot-b.tum"]
    found = recording_of(import_recording(one, tmp_path, others=[other]).run)
    assert found.poses.times_ns.tolist() == [k * 100_000_000 for k in range(5)]
    assert found.poses.xy_mm[4].tolist() == [[4000, 0], [0, 4000]]
    assert [abs(yaw) for yaw in found.poses.yaw_mrad[0].tolist()] == [0, 3142]
    assert found.run.manifest["source"] == "robot-a.txt, robot-b.tum"


def test_two_trajectories_of_other_names_are_compared(tmp_path):
    runs = [import_recording(tum(tmp_path / name, [(0, 0, 0, 0, 0, 1)]), tmp_path).run
            for name in ("one.tum", "other.tum")]
    found = ComparedRuns(*runs)
    assert found.robots == ({"one"}, {"other"}) and found.parted is None
    assert outcome(found).endswith("; no robot has the same name in both")


def test_heights_that_are_left_out_are_said(tmp_path):
    path = tum(tmp_path / "drone.tum", [(0, 0, 0, 0, 0, 1), (1, 0, 5, 3.25, 0, 1)])
    assert import_recording(path, tmp_path).notes[-1] == (
        "drone.tum: heights are left out; they differ by up to 3.2 m")


def test_the_path_of_a_camera_is_doubted(tmp_path):
    path = tum(tmp_path / "eye.tum", [(0, 0, 0, 0, 0, 1), (1, 0.2, 0.01, 0.3, 0, 1)])
    assert import_recording(path, tmp_path).notes[-1] == (
        "eye.tum: z changes by 0.3 m and y by 0.01 m; x and y are taken, so if z points ahead, as "
        "in a camera's frame, turn the poses first")


@pytest.mark.parametrize("line, text", [
    ("1 0 0 0 0 0 0", ":5: has 7 values; wanted: timestamp tx ty tz qx qy qz qw"),
    ("1 0 0 0 0 0 0 0",
     ":5: the quaternion is 0 0 0 0; wanted: an orientation, 0 0 0 1 for none"),
    ("1 0 0 nan 0 0 0 1", ":5: a pose has 'nan' where a number is wanted"),
    ("1305031102000000000 0 0 0 0 0 0 1",
     ":5: the timestamp is 1.305031102e+18; wanted: seconds, 0 to 4000000000")])
def test_a_wrong_line_is_named(tmp_path, line, text):
    path = tum(tmp_path / "a.tum", [(0, 0, 0, 0, 0, 1)])
    path.write_text(f"{path.read_text()}{line}\n")
    with pytest.raises(InputError) as error:
        import_recording(path, tmp_path)
    assert str(error.value) == f"{path}{text}"


def test_files_of_one_name_and_of_two_formats_are_refused(tmp_path):
    one, other = (tum(tmp_path / name, [(0, 0, 0, 0, 0, 1)]) for name in ("a-b.tum", "a_b.tum"))
    with pytest.raises(InputError) as error:
        import_recording(one, tmp_path, others=[other])
    assert str(error.value) == (f"{other}: its robot would be a_b, as of a-b.tum; wanted: files of "
                                "different names")
    (tmp_path / "x.bag").write_text("#ROSBAG V2.0\n")
    with pytest.raises(InputError) as error:
        import_recording(one, tmp_path, others=[tmp_path / "x.bag"])
    assert str(error.value) == (f"{tmp_path / 'x.bag'}: is no TUM trajectory; several files are "
                                "allowed of those alone")
