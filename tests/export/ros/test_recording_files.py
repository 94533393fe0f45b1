"""MCAP files and bags: other readers find the recording in them, value by value."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
import yaml
from recorded import made, quiet
from typer.testing import CliRunner

from desim.api import recording_of
from desim.cli import app
from desim.results.merged_map import known_at
from desim.units import NS_PER_S

rosbags_reader = pytest.importorskip("rosbags.highlevel", reason="rosbags is not installed")
mcap_reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
from desim.export.ros.recording_files import write_bag, write_mcap  # noqa: E402

DOORS = ("environment.doors=[{from: [0 m, 0 m], to: [0 m, 8 m], open: [[2 s, 4 s]]}]",)


@pytest.fixture(scope="module")
def recording(repository, tmp_path_factory):
    return recording_of(made(repository, tmp_path_factory.mktemp("results"), "stop.elapsed=12 s",
                             "deployment=field", *DOORS))


@pytest.fixture(scope="module")
def mcap(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    return path, write_mcap(recording, path, quiet)


@pytest.fixture(scope="module")
def bag(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("bag") / "run.bag"
    return path, write_bag(recording, path, quiet)


def read_mcap(path):
    """Topic, time and message of all that an MCAP file has, by the decoder of mcap-ros2-support."""
    decoder = pytest.importorskip("mcap_ros2.decoder", reason="mcap-ros2-support is not installed")
    with path.open("rb") as file:
        reader = mcap_reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        return [(channel.topic, message.log_time, decoded)
                for _, channel, message, decoded in reader.iter_decoded_messages()]


def read_bag(path):
    """The same of a bag, by rosbags."""
    from rosbags.typesys import Stores, get_typestore

    with rosbags_reader.AnyReader([path],
                                  default_typestore=get_typestore(Stores.ROS1_NOETIC)) as reader:
        return [(connection.topic, time_ns, reader.deserialize(data, connection.msgtype))
                for connection, time_ns, data in reader.messages()]


@pytest.fixture(scope="module", params=["mcap", "bag"])
def found(request):
    """All messages of a file, as another library reads them, and the counts that were promised."""
    path, counts = request.getfixturevalue(request.param)
    return {"mcap": read_mcap, "bag": read_bag}[request.param](path), counts


def of(found, topic):
    return [(time_ns, message) for name, time_ns, message in found[0] if name == topic]


def stamp_ns(message) -> int:
    stamp = message.header.stamp
    return stamp.sec * NS_PER_S + stamp.nanosec


def test_counts_are_those_that_were_written(recording, found):
    messages, counts = found
    assert Counter(topic for topic, _, _ in messages) == counts
    instants = len(recording.poses.times_ns)
    for robot in recording.robots:
        assert counts[f"/{robot}/odom"] == counts["/tf"] == instants
        assert counts[f"/{robot}/plan"] == sum(
            plan.robot == robot and plan.kind == "plan" for plan in recording.plans)
    times_ns = [time_ns for _, time_ns, _ in messages]
    assert times_ns == sorted(times_ns) and times_ns[0] == 0
    assert times_ns[-1] == recording.end_ns


def poses_agree(recording, found, robot: int) -> bool:
    """Whether odometry and transforms are the recorded poses of a robot, to 1e-9 m and rad."""
    name, poses = recording.robots[robot], recording.poses
    rows = []
    for time_ns, message in of(found, f"/{name}/odom"):
        pose = message.pose.pose
        assert (message.header.frame_id, message.child_frame_id) == (f"{name}/odom",
                                                                     f"{name}/base_link")
        assert stamp_ns(message) == time_ns
        rows.append((time_ns, pose.position.x, pose.position.y,
                     2 * np.arctan2(pose.orientation.z, pose.orientation.w)))
    table = np.array(rows)
    apart = table[:, 3] - poses.yaw_mrad[:, robot] / 1000
    return bool((table[:, 0] == poses.times_ns).all()
                and np.allclose(table[:, 1:3] * 1000, poses.xy_mm[:, robot], atol=1e-6)
                and np.allclose((apart + np.pi) % (2 * np.pi) - np.pi, 0, atol=1e-9))


def test_poses_are_the_recorded_ones(recording, found):
    assert all(poses_agree(recording, found, robot) for robot in range(3))
    wrong = [message for _, message in of(found, "/robot_0/odom")][5]
    wrong.pose.pose.position.x += 0.001
    assert not poses_agree(recording, found, 0)
    wrong.pose.pose.position.x -= 0.001


def test_frames_lead_from_the_map_to_each_laser(recording, found):
    (_, first), *_ = of(found, "/tf_static")
    parents = {one.child_frame_id: one.header.frame_id for one in first.transforms}
    parents |= {one.child_frame_id: one.header.frame_id
                for one in of(found, "/tf")[0][1].transforms}
    for robot in recording.robots:
        way = [of(found, f"/{robot}/scan")[0][1].header.frame_id]
        while way[-1] in parents:
            way.append(parents[way[-1]])
        assert way == [f"{robot}/laser", f"{robot}/base_link", f"{robot}/odom", "map"]


def test_scans_meet_the_walls_that_stand(recording, found):
    """Each beam that meets something ends at a wall, a closed door or another robot."""
    scans = dict(of(found, "/robot_1/scan"))
    times_ns = recording.poses.times_ns.tolist()
    for time_ns in (times_ns[10], times_ns[30], times_ns[-1]):
        scan, poses = scans[time_ns], recording.poses.at(time_ns)
        x, y, yaw = poses[1]
        angles = yaw + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        ranges = np.array(scan.ranges)
        met = np.isfinite(ranges)
        ends = np.column_stack([x + ranges * np.cos(angles), y + ranges * np.sin(angles)])[met]
        walls = np.array([(wall.x1_mm, wall.y1_mm, wall.x2_mm, wall.y2_mm)
                          for wall in recording.walls
                          if wall.from_ns <= time_ns < wall.until_ns]) / 1000
        one, other = walls[:, :2], walls[:, 2:]
        along = other - one
        share = np.clip(((ends[:, None] - one) * along).sum(-1) / (along ** 2).sum(-1), 0, 1)
        off = np.hypot(*(ends[:, None] - one - share[..., None] * along).transpose(2, 0, 1)).min(1)
        bodies = np.hypot(*(ends[:, None] - poses[[0, 2], :2]).transpose(2, 0, 1)).min(1)
        assert met.sum() > 100
        assert ((off < 0.005) | (bodies < 0.5)).all()


def test_a_door_is_met_while_it_is_closed(recording, found):
    """The markers of the terrain: one wall less from 2 s to 4 s."""
    feet = {time_ns: sum(len(marker.points) for marker in message.markers
                         if marker.ns == "wood feet")
            for time_ns, message in of(found, "/terrain")}
    assert [feet[time_s * NS_PER_S] for time_s in (0, 2, 4)] == [2, 0, 2]


def test_maps_are_what_was_known_then(recording, found):
    for topic, own in (("/map", recording.growths), ("/robot_2/map", [
            growth for growth in recording.growths if growth.robot == "robot_2"])):
        grids = of(found, topic)
        known = []
        for time_ns, message in grids:
            expected = known_at(list(own), time_ns)
            cells = np.array(message.data).reshape(message.info.height, message.info.width)
            assert np.array_equal(cells, expected)
            known.append(int((cells >= 0).sum()))
        assert message.header.frame_id == "map" and known == sorted(known) and known[-1] > 5000
    grid = recording.growths[0].grid
    assert (message.info.origin.position.x, message.info.width) == (grid.x_m, grid.width)
    assert message.info.resolution == pytest.approx(grid.resolution_m)


def test_goals_and_plans_are_those_of_the_robots(recording, found):
    for kind, points in (("goal", lambda message: [message.pose]),
                         ("plan", lambda message: [pose.pose for pose in message.poses])):
        expected = [(plan.time_ns, plan.xy_mm.tolist()) for plan in recording.plans
                    if (plan.robot, plan.kind) == ("robot_0", kind)
                    and (kind == "plan" or len(plan.xy_mm))]
        assert [(time_ns, [[round(p.position.x * 1000), round(p.position.y * 1000)]
                           for p in points(message)])
                for time_ns, message in of(found, f"/robot_0/{kind}")] == expected
        assert expected


def message_names(found) -> set[str]:
    """The names of the first status of each message."""
    return {message.status[0].name for _, message in of(found, "/diagnostics")}


def test_the_log_of_links_has_every_message(recording, found):
    statuses = [{value.key: value.value for value in status.values}
                for _, message in of(found, "/diagnostics") for status in message.status
                if status.name.startswith("link: ")]
    fates = recording.messages["fate"].to_pylist()
    assert sum(int(values["messages"]) for values in statuses) == fates.count("delivered") > 10
    assert sum(int(values["dropped"]) for values in statuses) == fates.count("dropped")
    assert {values["host"] for values in statuses} >= set(recording.robots)
    sums = [{value.key: int(value.value) for value in message.status[0].values}
            for _, message in of(found, "/diagnostics")]
    assert sum(one["messages"] for one in sums) == fates.count("delivered")
    assert sums[-1]["links"] == 6 and message_names(found) == {"network"}


def test_what_stands_still_is_repeated(recording, found):
    for topic in ("/tf_static", "/robots", "/terrain"):
        times_ns = [time_ns for time_ns, _ in of(found, topic)]
        assert times_ns[0] == 0
        assert max(np.diff([*times_ns, recording.end_ns])) <= 5 * NS_PER_S


def test_latched_topics_are_offered_as_such(mcap, bag):
    latched = {"/tf_static", "/terrain", "/robots", "/map", "/robot_0/map", "/robot_1/map",
               "/robot_2/map"}
    with mcap[0].open("rb") as file:
        channels = mcap_reader.make_reader(file).get_summary().channels.values()
    offered = {channel.topic: yaml.safe_load(channel.metadata["offered_qos_profiles"])
               for channel in channels}
    assert {topic for topic, (one,) in offered.items() if one["durability"] == 1} == latched
    with rosbags_reader.AnyReader([bag[0]]) as reader:
        assert {one.topic for one in reader.connections if one.ext.latching} == latched


def test_an_mcap_file_names_run_and_scenario(recording, mcap):
    with mcap[0].open("rb") as file:
        reader = mcap_reader.make_reader(file)
        assert reader.get_header().profile == "ros2"
        (metadata,) = reader.iter_metadata()
        (attached,) = reader.iter_attachments()
    assert metadata.metadata["digest"] == recording.run.manifest["digest"]
    assert attached.data == recording.run.file("scenario.resolved.yaml").read_bytes()


def test_the_layout_shows_topics_that_there_are(mcap):
    path, counts = mcap
    layout = json.loads(path.with_suffix(".foxglove.json").read_text())
    panels = layout["configById"]
    assert set(panels["3D!desim"]["topics"]) <= set(counts)
    values = [one["value"] for panel in panels.values() for one in panel.get("paths", ())]
    assert values and {value.partition(".")[0] for value in values} <= set(counts)

    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node["first"]) + leaves(node["second"])

    assert sorted(leaves(layout["layout"])) == sorted(panels)


def test_rviz_shows_topics_that_there_are(mcap, bag):
    for (path, counts), ending in ((mcap, ".ros2.rviz"), (bag, ".rviz")):
        config = yaml.safe_load(path.with_suffix(ending).read_text())["Visualization Manager"]
        assert config["Global Options"]["Fixed Frame"] == "map"
        shown = set()
        for display in config["Displays"]:
            topic = display.get("Marker Topic", display.get("Topic"))
            shown.add(topic if ending == ".rviz" else topic["Value"])
        assert shown <= set(counts) and len(shown) == 4 + 3 * 3


def ros(*words: str) -> str:
    """The output of a command of ROS 1."""
    if shutil.which(words[0]) is None:
        pytest.skip(f"{words[0]} is not installed (Debian: python3-rosbag, python3-rostopic)")
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_rosbag_info_counts_the_same(bag):
    path, counts = bag
    text = ros("rosbag", "info", "--yaml", str(path))
    about = yaml.safe_load(text)
    assert {topic["topic"]: topic["messages"] for topic in about["topics"]} == counts


def test_rostopic_echo_prints_the_recorded_places(recording, bag):
    text = ros("rostopic", "echo", "-b", str(bag[0]), "-p", "/robot_0/odom")
    head, *rows = [line.split(",") for line in text.splitlines()]
    x, y, time = (head.index(name) for name in (
        "field.pose.pose.position.x", "field.pose.pose.position.y", "%time"))
    assert [int(row[time]) for row in rows] == recording.poses.times_ns.tolist()
    found = np.array([(float(row[x]), float(row[y])) for row in rows])
    assert np.allclose(found * 1000, recording.poses.xy_mm[:, 0], atol=1e-6)


def test_rosbag_reads_every_message(bag):
    """Each chunk and each type: rosbag decompress rewrites all of the bag."""
    path, counts = bag
    copy = shutil.copy(path, path.with_name("copy.bag"))
    ros("rosbag", "decompress", "-q", str(copy))
    assert Counter(topic for topic, _, _ in read_bag(path.with_name("copy.bag"))) == counts


def test_the_command_says_what_it_wrote(recording, tmp_path):
    done = CliRunner().invoke(app, ["export", str(recording.run.path), "--mcap",
                                    str(tmp_path / "a.mcap"), "--bag", str(tmp_path / "a.bag")])
    assert done.exit_code == 0, done.output
    mcap, foxglove, rviz2, bag, rviz1 = done.stdout.splitlines()
    assert mcap.startswith(f"{tmp_path / 'a.mcap'}: ") and mcap.endswith(" topics")
    assert bag.split(": ")[1] == mcap.split(": ")[1]
    assert foxglove == f"{tmp_path / 'a.foxglove.json'}: a layout to import into Foxglove"
    assert rviz2 == f"{tmp_path / 'a.ros2.rviz'}: rviz2 -d shows all topics with it"
    assert rviz1 == f"{tmp_path / 'a.rviz'}: rviz -d shows all topics with it"
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "a.bag", "a.foxglove.json", "a.mcap", "a.ros2.rviz", "a.rviz"]


@pytest.mark.parametrize("option, module", [("--mcap", "mcap"), ("--bag", "rosbags")])
def test_a_missing_extra_is_named(recording, tmp_path, monkeypatch, option, module):
    for name in [name for name in sys.modules
                 if name.partition(".")[0] == module or name.startswith("desim.export.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    done = CliRunner().invoke(app, ["export", str(recording.run.path), option,
                                    str(tmp_path / "file")])
    assert (done.exit_code, done.stderr) == (
        2, f"{option}: {module} is not installed; pip install 'desim[recordings]'\n")
