"""Sonars and bumpers in MCAP files and bags."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from recorded import made, quiet

from desim.api import recording_of
from desim.units import NS_PER_S

pytest.importorskip("rosbags", reason="rosbags is not installed")
pytest.importorskip("mcap", reason="mcap is not installed")
from test_recording_files import of, read_bag, read_mcap, stamp_ns  # noqa: E402

from desim.export.ros.recording_files import RVIZ_1, write_bag, write_mcap  # noqa: E402

MOUNTS = [(0.0, 0.136, 90.0), (0.0, -0.136, -90.0), (-0.1, 0.0, 180.0)]  # not ahead
SONAR = ("robot.sonar={max_range: 4.5 m, rate: 2 Hz, height: 0.31 m, transducers: "
         f"[{', '.join(f'[{x} m, {y} m, {yaw} deg]' for x, y, yaw in MOUNTS)}]}}")


@pytest.fixture(scope="module")
def recording(repository, tmp_path_factory):
    """The mapper runs into a low wall, which neither lasers nor sonar see; both are higher."""
    return recording_of(made(
        repository, tmp_path_factory.mktemp("results"), SONAR,
        "fleet.robots=[{type: mapper, count: 1}]", "fleet.start={poses: [{x: -8 m, y: -4 m}]}",
        "fleet.types.mapper.robot.lasers.low.height=0.6 m", "robot.bumper=true",
        "stop.elapsed=25 s", file="two_types.yaml"))


@pytest.fixture(scope="module", params=["mcap", "bag"])
def found(request, recording, tmp_path_factory):
    """The messages of a file, and what it is."""
    path = tmp_path_factory.mktemp("file") / f"run.{request.param}"
    write, read = {"mcap": (write_mcap, read_mcap), "bag": (write_bag, read_bag)}[request.param]
    counts = write(recording, path, quiet)
    return read(path), counts, path


def nearest_m(recording, time_ns, mount, height_m):
    """The distance of the nearest wall that is high enough, on five rays over 30 degrees."""
    x, y, yaw = recording.poses.at(time_ns)[0]
    ahead, left, turned = mount
    x0, y0 = (x + np.cos(yaw) * ahead - np.sin(yaw) * left,
              y + np.sin(yaw) * ahead + np.cos(yaw) * left)
    nearest = np.inf
    for angle in yaw + np.radians(turned) + np.radians(np.linspace(-15.0, 15.0, 5)):
        ux, uy = np.cos(angle), np.sin(angle)
        for wall in recording.walls:
            if wall.height_mm / 1000 <= height_m:
                continue
            ax, ay, bx, by = np.array(wall[2:6]) / 1000
            across = ux * (by - ay) - uy * (bx - ax)
            if across:
                along = ((ax - x0) * (by - ay) - (ay - y0) * (bx - ax)) / across
                share = ((ax - x0) * uy - (ay - y0) * ux) / across
                if along > 0 and -1e-9 <= share <= 1 + 1e-9:
                    nearest = min(nearest, along)
    return nearest


def test_each_transducer_reads_the_nearest_wall_in_its_cone(recording, found):
    readings = of(found, "/robot_0/sonar")
    assert found[1]["/robot_0/sonar"] == len(readings)
    times_ns = sorted({time_ns for time_ns, _ in readings})
    assert np.diff(times_ns).min() >= NS_PER_S // 2 and len(readings) == 3 * len(times_ns)
    assert len(times_ns) == pytest.approx(2 * 25, abs=2)
    seen = 0
    for time_ns, message in readings:
        number = int(message.header.frame_id.removeprefix("robot_0/sonar_"))
        assert stamp_ns(message) == time_ns and message.radiation_type == 0
        assert (message.min_range, message.max_range, message.field_of_view) == pytest.approx(
            (0.1, 4.5, np.radians(30)))
        expected = nearest_m(recording, time_ns, MOUNTS[number], 0.31)
        if expected < 4.49:
            assert message.range == pytest.approx(max(expected, 0.1), abs=0.01)
            seen += 1
        elif expected > 4.51:
            assert message.range == np.inf
    assert seen > 30
    # The twin: a sonar below the edge of the low wall would read others.
    assert any(nearest_m(recording, time_ns, mount, 0.2)
               < min(nearest_m(recording, time_ns, mount, 0.31), 4.5) - 0.1
               for time_ns in times_ns for mount in MOUNTS)


def test_each_transducer_has_its_frame(found):
    (_, first), *_ = of(found, "/tf_static")
    frames = {one.child_frame_id: one for one in first.transforms}
    for number, (x, y, yaw) in enumerate(MOUNTS):
        frame = frames[f"robot_0/sonar_{number}"]
        assert frame.header.frame_id == "robot_0/base_link"
        at, turned = frame.transform.translation, frame.transform.rotation
        assert (at.x, at.y) == pytest.approx((x, y))
        assert np.cos(2 * np.arctan2(turned.z, turned.w)) == pytest.approx(np.cos(np.radians(yaw)))


def test_the_bumper_is_pressed_where_a_contact_begins(recording, found):
    presses = of(found, "/robot_0/bumper")
    assert [time_ns for time_ns, _ in presses] == [
        event.time_ns for event in recording.events if event.kind == "collision"]
    assert presses
    assert {(one.bumper, one.state) for _, one in presses} == {(1, 1)}  # CENTER, PRESSED


def test_who_has_neither_has_no_topics(repository, tmp_path):
    counts = write_bag(recording_of(made(repository, tmp_path, "stop.elapsed=2 s")),
                       tmp_path / "plain.bag", quiet)
    assert not [topic for topic in counts if "sonar" in topic or "bumper" in topic]


def test_rviz_shows_the_ring(recording, tmp_path):
    write_bag(recording, tmp_path / "run.bag", quiet)
    shown = yaml.safe_load((tmp_path / "run.bag").with_suffix(RVIZ_1).read_text())
    [display] = [one for one in shown["Visualization Manager"]["Displays"]
                 if one["Class"] == "rviz/Range"]
    assert (display["Topic"], display["Buffer Length"]) == ("/robot_0/sonar", 3)


def test_the_types_are_those_of_kobuki(recording, tmp_path):
    """A bag names the package of ROS 1, an MCAP file that of ROS 2."""
    from mcap.reader import make_reader
    from rosbags.highlevel import AnyReader

    write_bag(recording, tmp_path / "run.bag", quiet)
    with AnyReader([tmp_path / "run.bag"]) as reader:
        types = {one.topic: one.msgtype for one in reader.connections}
    assert types["/robot_0/bumper"] == "kobuki_msgs/msg/BumperEvent"
    assert types["/robot_0/sonar"] == "sensor_msgs/msg/Range"
    write_mcap(recording, tmp_path / "run.mcap", quiet)
    with (tmp_path / "run.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert "kobuki_ros_interfaces/msg/BumperEvent" in {
        schema.name for schema in summary.schemas.values()}
