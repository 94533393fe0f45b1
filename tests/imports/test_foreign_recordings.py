"""Ten recordings as other people's tools write them: a robot that drives 2 m in 20 s."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from desim.api import recording_of
from desim.errors import InputError

pytest.importorskip("rosbags", reason="rosbags is not installed")
from rosbags.rosbag1 import Writer as Writer1  # noqa: E402
from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: E402

from desim.export.ros.message_types import (  # noqa: E402
    OCCUPANCY_GRID,
    ODOMETRY,
    POSE_STAMPED,
    TF_MESSAGE,
    RosTypes,
)
from desim.imports.imported_run import import_recording  # noqa: E402
from desim.units import NS_PER_S  # noqa: E402

WALL_NS = 1_700_000_000 * NS_PER_S  # when it was recorded
SIMULATED_NS = 900 * NS_PER_S
EARLIER_NS = WALL_NS - 280 * NS_PER_S
STEP_NS = NS_PER_S // 10
TIMES_NS = range(0, 20 * NS_PER_S, STEP_NS)
TYPES = RosTypes(2)


def pose(stamp_ns, x, frame="map"):
    return POSE_STAMPED, TYPES.make(POSE_STAMPED, header=TYPES.header(stamp_ns, frame),
                                    pose=TYPES.pose(x, 0, 0))


def odometry(stamp_ns, x):
    return ODOMETRY, TYPES.make(ODOMETRY, header=TYPES.header(stamp_ns, "odom"), pose=TYPES.make(
        "geometry_msgs/msg/PoseWithCovariance", pose=TYPES.pose(x, 0, 0)))


def transform(stamp_ns, parent, child, x=0.0):
    moved = TYPES.make("geometry_msgs/msg/Transform", translation=TYPES.vector(x, 0),
                       rotation=TYPES.turned(0))
    return TF_MESSAGE, TYPES.make(TF_MESSAGE, transforms=[TYPES.make(
        "geometry_msgs/msg/TransformStamped", header=TYPES.header(stamp_ns, parent),
        child_frame_id=child, transform=moved)])


def grid(stamp_ns):
    info = TYPES.make("nav_msgs/msg/MapMetaData", resolution=0.05, width=1, height=1,
                      origin=TYPES.pose(0, 0, 0))
    return OCCUPANCY_GRID, TYPES.make(OCCUPANCY_GRID, header=TYPES.header(stamp_ns, "map"),
                                      info=info, data=np.zeros(1, np.int8))


def driven(topic, make, clock_ns=WALL_NS):
    """A message each tenth of a second, whose stamps are those of a clock."""
    return [(topic, WALL_NS + t, *make(clock_ns + t, t / 10**10)) for t in TIMES_NS]


def moved(parent, child, clock_ns=WALL_NS):
    return driven("/tf", lambda stamp_ns, x: transform(stamp_ns, parent, child, x), clock_ns)


def fixed(stamp_ns, parent, child, topic="/tf_static"):
    return topic, WALL_NS, *transform(stamp_ns, parent, child)


RECORDINGS = {
    "simulated time in stamps, static transforms without any": (
        [fixed(0, "base_link", "laser"), *driven("/pose", pose, SIMULATED_NS)], ["robot"]),
    "a static transform from before the recording": (
        [fixed(EARLIER_NS, "base_link", "laser"), *driven("/pose", pose)], ["robot"]),
    "base_link fixed on base_footprint": (
        [fixed(WALL_NS, "base_footprint", "base_link"), *moved("odom", "base_footprint")],
        ["robot"]),
    "topics without a slash": (
        driven("truth", pose) + driven("slam-a", pose) + driven("slam-b", pose),
        ["slam_a", "slam_b", "truth"]),
    "base_footprint fixed under base_link, stamped as if it moved": (
        moved("odom", "base_link") + driven(
            "/tf", lambda stamp_ns, x: transform(stamp_ns, "base_link", "base_footprint")),
        ["robot"]),
    "base_link fixed on a body that moves": (
        [fixed(0, "chassis", "base_link"), *moved("odom", "chassis", SIMULATED_NS)], ["robot"]),
    "a latched map from before the recording": (
        [("/map", WALL_NS, *grid(EARLIER_NS)), *driven("/odom", odometry)], ["robot"]),
    "a node that stamps wall time beside a simulator": (
        [("/slam/pose", WALL_NS, *pose(WALL_NS, 0.0)), *driven("/odom", odometry, SIMULATED_NS)],
        ["robot"]),
    "topics that differ in signs alone": (
        driven("/a-b/pose", pose) + driven("/a_b/truth", pose), ["a_b_pose", "a_b_truth"]),
    "two fleets' topics of one first part": (
        driven("/x/pose", pose) + driven("/x/pose/raw", pose), ["x_pose", "x_pose_raw"]),
}


def written(folder: Path, rows, storage=StoragePlugin.SQLITE3) -> Path:
    with Writer(folder, version=8, storage_plugin=storage) as out:
        links = {}
        for topic, record_ns, kind, message in rows:
            if topic not in links:
                links[topic] = out.add_connection(topic, kind, typestore=TYPES.store)
            out.write(links[topic], record_ns, TYPES.data(kind, message))
    return folder


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
@pytest.mark.parametrize("what", RECORDINGS)
def test_it_has_its_robots_for_its_time(tmp_path, what, storage):
    rows, robots = RECORDINGS[what]
    found = recording_of(import_recording(
        written(tmp_path / "lab", rows, storage), tmp_path / "out").run)
    assert (list(found.robots), found.end_ns) == (robots, TIMES_NS[-1])
    assert found.poses.times_ns.tolist() == list(TIMES_NS)
    for robot in range(len(robots)):
        assert found.poses.xy_mm[:, robot].tolist() == [[10 * k, 0] for k in range(len(TIMES_NS))]


def test_what_has_no_stamp_of_the_clock_is_dated_by_its_record(tmp_path):
    """The simulator runs at half the speed of wall time."""
    rows = [("/odom", WALL_NS + 2 * t, *odometry(SIMULATED_NS + t, t / 10**10)) for t in TIMES_NS]
    late_ns = WALL_NS + 20 * NS_PER_S
    rows += [("/goal", late_ns, *pose(0, 1.0)), ("/goal", late_ns, *pose(late_ns, 2.0))]
    done = import_recording(written(tmp_path / "lab", rows), tmp_path / "out")
    assert [plan.time_ns for plan in recording_of(done.run).plans] == [10 * NS_PER_S] * 2
    assert done.notes[-1] == "1 stamps are of another clock: dated by when they were recorded"


@pytest.mark.parametrize("ending", ["db3", "mcap", "recording"])
@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_file_of_a_folder_is_read_whatever_it_is_called(tmp_path, storage, ending):
    folder = written(tmp_path / "lab", driven("/pose", pose), storage)
    (file,) = [one for one in folder.iterdir() if one.name != "metadata.yaml"]
    alone = tmp_path / f"lab #1? 100%.{ending}"
    shutil.copy(file, alone)
    found = import_recording(alone, tmp_path / "out")
    assert found.notes[:2] == ["1 robot, 19.9 s, 200 poses each", "  robot: /pose"]


def test_a_bag_of_ros_1_is_read_whatever_it_is_called(tmp_path):
    types, path = RosTypes(1), tmp_path / "lab.orig.active"
    with Writer1(path) as out:
        topic = out.add_connection("/pose", POSE_STAMPED, typestore=types.store)
        for t in TIMES_NS:
            message = types.make(POSE_STAMPED, header=types.header(WALL_NS + t, "map"),
                                 pose=types.pose(0, 0, 0))
            out.write(topic, WALL_NS + t, types.data(POSE_STAMPED, message))
    assert import_recording(path, tmp_path).notes[0] == "1 robot, 19.9 s, 200 poses each"


def test_two_robots_of_one_name_are_refused(tmp_path):
    path = written(tmp_path / "lab", driven("/a-b", pose) + driven("/a_b", pose))
    with pytest.raises(InputError) as error:
        import_recording(path, tmp_path)
    assert str(error.value) == (f"{path}: /a-b and /a_b would both be the robot a_b; --topic takes "
                                "one of them")
    assert import_recording(path, tmp_path, topic="/a-b").notes[1] == "  robot: /a-b"


def test_transforms_without_a_robot_are_named(tmp_path):
    path = written(tmp_path / "lab", [fixed(0, "map", "base_link"), *moved("odom", "camera")])
    with pytest.raises(InputError) as error:
        import_recording(path, tmp_path)
    assert str(error.value) == (
        f"{path}: no trajectories; wanted: topics with Odometry, PoseStamped, "
        "PoseWithCovarianceStamped or TFMessage; it has /tf_static (tf2_msgs/msg/TFMessage), /tf "
        "(tf2_msgs/msg/TFMessage); its transforms are of base_link, camera; a robot's frame is "
        "base_link, base_footprint or base, and moves")


@pytest.mark.parametrize("text, known", [
    ("FLASER 1 2.0 0 0 0 0 0 0 0 x 0\n", "a log of CARMEN, which desim slam reads"),
    ("<svg/>", "an SVG drawing, which desim map reads")])
def test_a_file_of_another_command_is_named(tmp_path, text, known):
    path = tmp_path / "lab.bag"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        import_recording(path, tmp_path)
    assert str(error.value) == (
        f"{path}: is no recording; it looks like {known}; allowed: an MCAP file, a bag of "
        "ROS 1, the folder of a bag of ROS 2, a .db3 of it, or a TUM trajectory")


def test_a_table_of_poses_needs_no_import(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_text("time_s,robot,x_m,y_m\n0,robot_0,1,2\n")
    with pytest.raises(InputError) as error:
        import_recording(path, tmp_path)
    assert str(error.value).startswith(
        f"{path}: is no recording; robots follow a CSV of poses without an import "
        "(coordination.strategy: follow); allowed: ")
