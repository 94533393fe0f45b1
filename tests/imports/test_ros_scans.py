"""``desim slam`` of recordings of ROS: the log is that of CARMEN's text of the same drive."""

import json
import math

import numpy as np
import pytest
from slam_logs import made_log, ring, way
from typer.testing import CliRunner

from desim.cli import app
from desim.errors import InputError

pytest.importorskip("rosbags", reason="rosbags is not installed")
from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: E402

from desim.export.ros.message_types import (  # noqa: E402
    LASER_SCAN,
    ODOMETRY,
    TF_MESSAGE,
    RosTypes,
)
from desim.imports.slam_logs.ros_scans import read_scans  # noqa: E402
from desim.robot.transforms import compose  # noqa: E402
from desim.units import NS_PER_S  # noqa: E402

WALL_NS = 1_700_000_000 * NS_PER_S
MOUNT = (0.2, 0.05, 0.1)
TYPES = RosTypes(2)
ON_ITS_BACK = TYPES.make("geometry_msgs/msg/Quaternion", x=1.0)


@pytest.fixture(scope="module")
def log():
    return made_log(ring(14.0, 10.0, 2.5), way([(1.2, 1.2), (6.8, 1.2)]))


def transform(stamp_ns, parent, child, pose, turned=None):
    moved = TYPES.make("geometry_msgs/msg/Transform", translation=TYPES.vector(*pose[:2]),
                       rotation=turned or TYPES.turned(pose[2]))
    return TYPES.make(TF_MESSAGE, transforms=[TYPES.make(
        "geometry_msgs/msg/TransformStamped", header=TYPES.header(stamp_ns, parent),
        child_frame_id=child, transform=moved)])


def recorded(folder, log, odometry=True, mount=MOUNT, turned=None, first=0, again=False):
    """A recording in which the robot's odometry is that of the log, with the laser at ``mount``
    (``again``: said beside each pose, too)."""
    with Writer(folder, version=8, storage_plugin=StoragePlugin.MCAP) as out:
        links = {}

        def put(topic, kind, time_ns, message):
            if topic not in links:
                links[topic] = out.add_connection(topic, kind, typestore=TYPES.store)
            out.write(links[topic], WALL_NS + time_ns, TYPES.data(kind, message))

        if mount is not None:
            put("/tf_static", TF_MESSAGE, 0, transform(0, "base_link", "laser", mount, turned))
        for k, (pose, ranges) in enumerate(zip(log.odometry, log.ranges, strict=True)):
            time_ns = round(log.times_s[k] * NS_PER_S)
            if odometry:
                put("/odom", ODOMETRY, time_ns, TYPES.make(
                    ODOMETRY, header=TYPES.header(time_ns, "odom"), pose=TYPES.make(
                        "geometry_msgs/msg/PoseWithCovariance", pose=TYPES.pose(*pose))))
            else:
                put("/tf", TF_MESSAGE, time_ns, transform(time_ns, "odom", "base_link", pose))
            if again:  # as by a publisher of static transforms in ROS 1
                put("/tf", TF_MESSAGE, time_ns, transform(time_ns + 30_000_000, "base_link",
                                                          "laser", mount))
            if k < first:
                continue
            ranges = np.where(ranges < log.laser.longest_m, ranges, math.inf).astype(np.float32)
            put("/scan", LASER_SCAN, time_ns, TYPES.make(
                LASER_SCAN, header=TYPES.header(time_ns, "laser"),
                angle_min=log.laser.angle_min_rad, angle_increment=log.laser.increment_rad,
                range_min=0.05, range_max=80.0, ranges=ranges, intensities=np.zeros(0, np.float32)))
    return folder


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("odometry", [True, False])
def test_poses_are_those_of_the_laser(tmp_path, log, odometry, again):
    found = read_scans(recorded(tmp_path / "lab", log, odometry, again=again), None)
    assert found.warnings == ()
    assert np.abs(found.odometry - compose(log.odometry, np.array(MOUNT))).max() < 1e-6
    met = log.ranges < log.laser.longest_m
    assert np.abs(found.ranges - log.ranges)[met].max() < 1e-5
    assert (found.ranges[~met] >= found.laser.longest_m).all()
    assert found.laser.angle_min_rad == pytest.approx(log.laser.angle_min_rad)


def test_a_laser_on_its_back_turns_the_other_way(tmp_path, log):
    found = read_scans(recorded(tmp_path / "lab", log, mount=(0, 0, 0), turned=ON_ITS_BACK))
    right = read_scans(recorded(tmp_path / "right", log, mount=(0, 0, 0)))
    assert np.array_equal(found.ranges, right.ranges[:, ::-1])
    last = right.laser.angle_min_rad + right.laser.increment_rad * (right.ranges.shape[1] - 1)
    assert found.laser.angle_min_rad == pytest.approx(-last)


def test_what_is_missing_is_said(tmp_path, log):
    path = recorded(tmp_path / "lab", log, mount=None)
    assert read_scans(path).warnings == (
        f"{path}: no transform from laser to base_link; the laser is taken to be in the middle of "
        "the robot",)
    path = recorded(tmp_path / "blind", log, first=10**9)
    with pytest.raises(InputError) as error:
        read_scans(path)
    assert str(error.value) == (f"{path}: no topic with laser scans; wanted: one topic with "
                                "LaserScan; it has none")
    path = recorded(tmp_path / "lost", log, odometry=False, mount=None)
    with pytest.raises(InputError) as error:
        read_scans(path)
    assert str(error.value) == (f"{path}: no odometry; wanted: a topic with Odometry, or "
                                "transforms from odom to laser, the frame of the laser")
    with pytest.raises(InputError) as error:
        read_scans(path, "/front")
    assert str(error.value) == (f"{path}: no topic /front with laser scans; wanted: one topic with "
                                "LaserScan, by --topic; it has /scan")


def test_the_command_maps_it(tmp_path, log):
    (file,) = recorded(tmp_path / "lab", log).glob("*.mcap")
    done = CliRunner().invoke(app, ["slam", str(file), "--localization", "scan_matching", "--json",
                                    "--to", str(tmp_path / "map.png")])
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert (facts["scans"], facts["beams"]) == (len(log.times_s), 181)
