"""``desim import``: a recording of ROS becomes a run that can be looked at."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from recorded import made, quiet
from typer.testing import CliRunner

import desim
from desim.api import recording_of
from desim.cli import app
from desim.errors import InputError
from desim.report.key_figures import key_figures
from desim.report.replay.bundle import bundle
from desim.results.run import Run
from desim.units import NS_PER_S

make_reader = pytest.importorskip("mcap.reader", reason="mcap is not installed").make_reader
rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="rosbags is not installed")
from desim.export.ros.message_types import (  # noqa: E402
    OCCUPANCY_GRID,
    ODOMETRY,
    POSE_STAMPED,
    TF_MESSAGE,
    RosTypes,
)
from desim.export.ros.recording_files import write_bag, write_mcap  # noqa: E402
from desim.imports.imported_run import import_recording  # noqa: E402

START_NS = 1_700_000_000 * NS_PER_S  # recordings of real robots count from 1970
PARTED = ("deployment=field", "stop.elapsed=12 s", "coordination.exchange.period=1 s",
          "network.media.wifi={model: disk, rules: [{rule: partition, from: 4 s, until: 8 s, "
          "groups: [[robot_0], [robot_1, robot_2]]}]}",
          "environment.doors=[{from: [0 m, 0 m], to: [0 m, 8 m], open: [[2 s, 4 s]]}]")


@pytest.fixture(scope="module")
def recording(repository, tmp_path_factory):
    return recording_of(made(repository, tmp_path_factory.mktemp("results"), *PARTED))


@pytest.fixture(scope="module")
def mcap(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "there and back.mcap"
    write_mcap(recording, path, quiet)
    return path


@pytest.fixture(scope="module")
def bag(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("bag") / "there and back.bag"
    write_bag(recording, path, quiet)
    return path


@pytest.fixture(scope="module", params=["mcap", "bag"])
def back(request, tmp_path_factory):
    path = request.getfixturevalue(request.param)
    return recording_of(import_recording(path, tmp_path_factory.mktemp("imported")).run)


def equal_poses(one, other) -> bool:
    """Whether two recordings have the same robots at the same places, to the last mm and mrad."""
    turn = one.poses.yaw_mrad.astype(int) - other.poses.yaw_mrad
    whole = 2000 * math.pi  # a turn is 6283.2 mrad, so that 3142 and -3141 are one heading
    return (one.robots == other.robots
            and np.array_equal(one.poses.times_ns, other.poses.times_ns)
            and np.array_equal(one.poses.xy_mm, other.poses.xy_mm)
            and bool((np.abs((turn + whole / 2) % whole - whole / 2) < 1).all()))


def test_poses_come_back_as_they_were(recording, back):
    assert equal_poses(recording, back)
    moved = back.poses.xy_mm.copy()
    back.poses.xy_mm[3, 1, 0] += 1
    assert not equal_poses(recording, back)
    back.poses.xy_mm[:] = moved


def test_links_come_back_as_they_were(recording, back):
    def changes(one):
        return sorted((link.time_ns, link.host, link.other, link.linked) for link in one.links)

    assert changes(recording) == changes(back) and len(changes(back)) > 6


def test_walls_and_doors_come_back_as_they_were(recording, back):
    assert sorted(recording.walls) == sorted(back.walls)


def test_plans_and_goals_come_back_as_they_were(recording, back):
    def plans(one):
        return sorted((plan.time_ns, plan.robot, plan.kind, plan.xy_mm.tolist())
                      for plan in one.plans if plan.kind in ("plan", "goal")
                      and (plan.kind == "plan" or len(plan.xy_mm)))  # the end of a goal is not told

    assert plans(recording) == plans(back) and len(plans(back)) > 4


def test_maps_come_back_with_what_was_known_at_the_end(recording, back):
    known = {growth.robot: growth for growth in back.growths}
    for growth in recording.growths:
        other = known[growth.robot]
        assert other.grid == growth.grid
        assert np.array_equal(other.known_since == 65535, growth.known_since == 65535)
        at = growth.known_since != 65535
        assert np.array_equal(other.occupied[at], growth.occupied[at])
        assert (other.known_since >= growth.known_since).all()  # seen at the next grid


def test_traffic_comes_back_second_by_second(recording, back):
    rows = back.messages.to_pylist()
    delivered = [row for row in recording.messages.to_pylist() if row["fate"] == "delivered"]
    assert sum(row["size_bytes"] for row in rows) == sum(row["size_bytes"] for row in delivered)
    assert back.run.metrics["messages_delivered"] == len(delivered)

    def loads(messages):
        sums = {}
        for row in messages:
            if row["fate"] == "delivered":
                key = max(row["end_ns"] - 1, 0) // NS_PER_S, row["source"], row["destination"]
                sums[key] = sums.get(key, 0) + row["size_bytes"]
        return sums

    assert loads(rows) == loads(delivered)
    last = {robot: back.run.robots["rx_bytes"][-3:][i] for i, robot in enumerate(back.robots)}
    assert last == {robot: sum(row["size_bytes"] for row in delivered
                               if row["destination"] == robot) for robot in back.robots}


def test_the_explored_share_comes_back(recording, back):
    assert back.run.samples["explored_union"].tolist() == \
        recording.run.samples["explored_union"].tolist()


def test_it_says_that_it_was_imported(back):
    manifest = back.run.manifest
    assert manifest["status"] == "imported" and manifest["source"].startswith("there and back.")
    assert manifest["name"] == "there_and_back"
    assert (manifest["digest"], manifest["seed"]) == (None, None)
    assert back.run.scenario.hosts == {}


def test_the_replay_page_takes_it(back):
    about, _ = bundle(back)
    assert about["status"] == "imported" and about["robots"] == list(back.robots)
    assert ("robots", "3") in about["facts"]


def test_it_can_be_exported_again(recording, back, tmp_path):
    write_bag(back, tmp_path / "again.bag", quiet)
    again = recording_of(import_recording(tmp_path / "again.bag", tmp_path).run)
    assert equal_poses(recording, again)


@pytest.mark.parametrize("command, text", [
    ("trace", "it was imported from there and back."),
    ("figure", "has no map/truth.yaml (its status is 'imported')"),
    ("graph", "it has no beliefs, and cannot be repeated")])
def test_what_it_cannot_do_gets_one_line(back, command, text):
    words = [command, str(back.run.path), *(("--message", "1") if command == "trace" else ())]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2 and text in done.stderr and done.stderr.count("\n") == 1


def test_it_is_not_run(back, tmp_path):
    path = back.run.path
    text = (f"{path}: it was imported from {back.run.manifest['source']}: it has no scenario to "
            "run, and cannot be repeated")
    file = path / "scenario.resolved.yaml"
    done = CliRunner().invoke(app, ["run", str(file), "--out", str(tmp_path)])
    assert (done.exit_code, done.stderr) == (2, f"{text}\n")
    with pytest.raises(InputError) as error:
        desim.run(file, out=tmp_path)
    assert str(error.value) == text


@pytest.mark.parametrize("more", [(), ("--medium", "lan")])
def test_it_has_no_packets(back, tmp_path, more):
    words = ["export", str(back.run.path), "--pcap", str(tmp_path / "x.pcap"), *more]
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, done.stderr) == (2, (
        f"{back.run.path}: it was imported from {back.run.manifest['source']}: it has no packets, "
        "and cannot be repeated\n"))


def test_no_lasers_are_made_up(recording, back, tmp_path):
    """Neither on the page nor in what is exported again."""
    assert bundle(back)[0]["lasers"] is None and bundle(recording)[0]["lasers"] is not None
    counts = [write_mcap(one, tmp_path / name, quiet) for one, name in (
        (back, "back.mcap"), (recording, "own.mcap"))]
    assert [any(topic.endswith("/scan") for topic in own) for own in counts] == [False, True]
    for name, has in (("back", False), ("own", True)):
        with (tmp_path / f"{name}.mcap").open("rb") as file:
            assert bool(list(make_reader(file).iter_attachments())) is has
        for ending in (".ros2.rviz", ".foxglove.json"):
            assert ("/scan" in (tmp_path / f"{name}{ending}").read_text()) is has


# ------------------------------------------------------------------ recordings of other people


class Bag:
    """A bag of ROS 1 that is written message by message."""

    def __init__(self, path: Path) -> None:
        self.types, self.path = RosTypes(1), path
        self._writer = rosbag1.Writer(path)
        self._writer.open()
        self._topics = {}

    def put(self, topic: str, kind: str, time_ns: int, message) -> None:
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(topic, kind,
                                                              typestore=self.types.store)
        self._writer.write(self._topics[topic], time_ns, self.types.data(kind, message))

    def pose(self, topic, time_ns, frame, x, y, yaw) -> None:
        types = self.types
        self.put(topic, POSE_STAMPED, time_ns, types.make(
            POSE_STAMPED, header=types.header(time_ns, frame), pose=types.pose(x, y, yaw)))

    def odometry(self, topic, time_ns, frame, x, y, yaw) -> None:
        types = self.types
        self.put(topic, ODOMETRY, time_ns, types.make(
            ODOMETRY, header=types.header(time_ns, frame), pose=types.make(
                "geometry_msgs/msg/PoseWithCovariance", pose=types.pose(x, y, yaw))))

    def transform(self, time_ns, parent, child, x, y, yaw) -> None:
        types = self.types
        moved = types.make("geometry_msgs/msg/Transform", translation=types.vector(x, y),
                           rotation=types.turned(yaw))
        self.put("/tf", TF_MESSAGE, time_ns, types.make(TF_MESSAGE, transforms=[types.make(
            "geometry_msgs/msg/TransformStamped", header=types.header(time_ns, parent),
            child_frame_id=child, transform=moved)]))

    def grid(self, topic, time_ns, x, y, cells) -> None:
        types = self.types
        info = types.make("nav_msgs/msg/MapMetaData", resolution=0.05, width=cells.shape[1],
                          height=cells.shape[0], origin=types.pose(x, y))
        self.put(topic, OCCUPANCY_GRID, time_ns, types.make(
            OCCUPANCY_GRID, header=types.header(time_ns, "map"), info=info,
            data=cells.astype(np.int8).ravel()))

    def imported(self, **how):
        self._writer.close()
        return recording_of(import_recording(self.path, self.path.parent, **how).run)


@pytest.fixture
def own(tmp_path):
    return Bag(tmp_path / "own.bag")


def test_robots_at_different_times_get_common_ones(own):
    """Motion capture: each robot has its own rate, and all names stand in the same place."""
    for k in range(51):
        own.pose("/vrpn/left/pose", START_NS + k * NS_PER_S // 50, "world", 0.02 * k, 0, 0)
    for k in range(31):
        own.pose("/vrpn/right/pose", START_NS + k * NS_PER_S // 30 + 5, "world", 0, 0.03 * k, 3)
    found = own.imported()
    assert found.robots == ("left", "right")
    times_ns = found.poses.times_ns
    assert times_ns.tolist() == [*range(0, NS_PER_S + 1, NS_PER_S // 10), NS_PER_S + 5]
    assert np.abs(found.poses.xy_mm[:, 0, 0] - times_ns / 1e6).max() <= 1
    assert np.abs(found.poses.xy_mm[:, 1, 1] - 0.9 * times_ns / 1e6).max() <= 1


def test_odometry_is_put_into_the_map(own):
    """The map's frame moves against odometry, as localization corrects it."""
    for k in range(5):
        own.transform(START_NS + k * NS_PER_S, "map", "odom", 10 + (k >= 2), 0, math.pi / 2)
        own.odometry("/odom", START_NS + k * NS_PER_S, "odom", k, 0, 0)
    found = own.imported()
    assert found.robots == ("robot",)
    assert found.poses.xy_mm[:, 0].tolist() == [
        [10_000, 0], [10_000, 1000], [11_000, 2000], [11_000, 3000], [11_000, 4000]]
    assert set(found.poses.yaw_mrad[:, 0].tolist()) == {1571}


def test_transforms_alone_are_enough(own):
    for k in range(5):
        for robot in ("alpha", "beta"):
            own.transform(START_NS + k * NS_PER_S, "map", f"{robot}/base_link", k, 1, 0)
    found = own.imported()
    assert found.robots == ("alpha", "beta")
    assert found.poses.xy_mm[-1].tolist() == [[4000, 1000], [4000, 1000]]


def test_the_folder_of_a_ros_2_bag_is_read(tmp_path):
    """SQLite, as ros2 bag record writes it by default, and poses with covariances."""
    from rosbags.rosbag2 import Writer

    types, kind = RosTypes(2), "geometry_msgs/msg/PoseWithCovarianceStamped"
    with Writer(tmp_path / "lab", version=9) as writer:
        there = {name: writer.add_connection(f"/{name}/amcl_pose", kind, typestore=types.store)
                 for name in ("r_1", "r_2")}
        for k in range(3):
            for y, name in enumerate(there):
                message = types.make(kind, header=types.header(START_NS + k * NS_PER_S, "map"),
                                     pose=types.make("geometry_msgs/msg/PoseWithCovariance",
                                                     pose=types.pose(k, y, 0.5)))
                writer.write(there[name], START_NS + k * NS_PER_S, types.data(kind, message))
    found = recording_of(import_recording(tmp_path / "lab", tmp_path).run)
    assert found.robots == ("r_1", "r_2") and found.run.manifest["name"] == "lab"
    assert found.poses.xy_mm[:, 1].tolist() == [[0, 1000], [1000, 1000], [2000, 1000]]
    assert set(found.poses.yaw_mrad.ravel().tolist()) == {500}


def test_an_mcap_file_of_another_library_is_read(tmp_path):
    """Schemas and bytes of mcap-ros2-support, with fields of which desim knows nothing."""
    writer = pytest.importorskip("mcap_ros2.writer", reason="mcap-ros2-support is not installed")
    with (tmp_path / "other.mcap").open("wb") as file:
        other = writer.Writer(file)
        schema = other.register_msgdef(POSE_STAMPED, "\n".join([
            "std_msgs/Header header", "geometry_msgs/Pose pose", "=" * 80, "MSG: std_msgs/Header",
            "builtin_interfaces/Time stamp", "string frame_id", "=" * 80,
            "MSG: builtin_interfaces/Time", "int32 sec", "uint32 nanosec", "=" * 80,
            "MSG: geometry_msgs/Pose", "geometry_msgs/Point position",
            "geometry_msgs/Quaternion orientation", "=" * 80, "MSG: geometry_msgs/Point",
            "float64 x", "float64 y", "float64 z", "=" * 80, "MSG: geometry_msgs/Quaternion",
            "float64 x", "float64 y", "float64 z", "float64 w"]))
        note = other.register_msgdef("lab_msgs/msg/Note", "string text")
        for k in range(4):
            time_ns = START_NS + k * NS_PER_S
            other.write_message("/note", note, {"text": "ok"}, log_time=time_ns)
            other.write_message("/ugv/pose", schema, log_time=time_ns, message={
                "header": {"stamp": {"sec": time_ns // NS_PER_S, "nanosec": 0}, "frame_id": "map"},
                "pose": {"position": {"x": 1.0, "y": 2.0 * k, "z": 0.0},
                         "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}})
        other.finish()
    found = recording_of(import_recording(tmp_path / "other.mcap", tmp_path).run)
    assert found.robots == ("ugv",) and found.end_ns == 3 * NS_PER_S
    assert found.poses.xy_mm[:, 0].tolist() == [[1000, 2000 * k] for k in range(4)]


def test_turning_past_the_back_is_no_spin(own):
    """From 3.1 to -3.1 rad is a short way, where poses lie between those that were given."""
    own.pose("/a/pose", START_NS, "map", 0, 0, 3.1)
    own.pose("/a/pose", START_NS + NS_PER_S, "map", 0, 0, -3.1)
    own.pose("/b/pose", START_NS + NS_PER_S // 2, "map", 0, 0, 0)
    found = own.imported()
    assert (np.abs(found.poses.yaw_mrad[:, 0]) >= 3100).all()


def test_a_map_that_grows_stays_in_its_place(own):
    own.odometry("/odom", START_NS, "map", 0, 0, 0)
    own.grid("/map", START_NS, 0.0, 0.0, np.array([[0, 100]]))
    own.grid("/map", START_NS + NS_PER_S, -0.05, 0.0, np.array([[100, 0, 0], [-1, -1, 0]]))
    (growth,) = own.imported().growths
    assert growth.known_since.tolist() == [[10, 0, 0], [65535, 65535, 10]]
    assert growth.occupied.tolist() == [[True, False, False], [False, False, False]]
    assert (growth.grid.width, growth.grid.height) == (3, 2)
    assert growth.grid.x_m == pytest.approx(-0.05)


def test_topics_can_be_chosen(own):
    own.odometry("/r/odom", START_NS, "map", 1, 0, 0)
    own.odometry("/r/odom_filtered", START_NS, "map", 2, 0, 0)
    found = own.imported(topic="/*/odom_filtered")
    assert found.poses.xy_mm[0].tolist() == [[2000, 0]]


def test_a_clock_that_was_set_is_refused(own):
    own.odometry("/odom", 5 * NS_PER_S, "map", 0, 0, 0)
    own.odometry("/odom", START_NS, "map", 0, 0, 0)
    with pytest.raises(InputError) as error:
        own.imported()
    assert str(error.value) == (
        f"{own.path}: its stamps are 19676 days apart; at most 31: some may count from 0, and "
        "others from 1970; --topic takes some only")


def test_coordinates_of_the_whole_earth_are_refused(own):
    own.odometry("/odom", START_NS, "utm", 500_000, 5_400_000, 0)
    with pytest.raises(InputError) as error:
        own.imported()
    assert str(error.value) == (f"{own.path}: its robots are up to 5400000 m from the origin; at "
                                "most 2000000 m: poses in a local frame are wanted")


def test_a_recording_without_trajectories_lists_what_it_has(own):
    own.grid("/map", START_NS, 0.0, 0.0, np.zeros((1, 1)))
    with pytest.raises(InputError) as error:
        own.imported()
    assert str(error.value) == (
        f"{own.path}: no trajectories; wanted: topics with Odometry, PoseStamped, "
        "PoseWithCovarianceStamped or TFMessage; it has /map (nav_msgs/msg/OccupancyGrid)")


def test_the_page_has_no_figures_of_what_was_not_recorded(own, back):
    own.odometry("/odom", START_NS, "map", 0, 0, 0)
    own.odometry("/odom", START_NS + 3 * NS_PER_S, "map", 1, 0, 0)
    (about, _), (mapped, _) = bundle(own.imported()), bundle(back)
    assert [label for label, _ in about["facts"]] == ["imported from", "robots", "driven"]
    assert about["lasers"] is None
    assert [label for label, _ in mapped["facts"]][-1] == "messages"
    said = "it was imported: only what was recorded is shown, no laser scans and no beliefs"
    assert about["notes"] == [said]
    assert mapped["notes"][:2] == [said, (
        "maps grow in the recording's steps; ground that several robots' maps gain in one step has "
        "the first of these robots' colour in the merged map")]


def test_messages_that_were_not_logged_are_not_counted_as_none(own, recording):
    for second in range(4):
        own.odometry("/odom", START_NS + second * NS_PER_S, "map", second, 0, 0)
    run = own.imported().run
    assert run.metrics["messages_delivered"] is None and run.metrics["messages_dropped"] == {}
    done = CliRunner().invoke(app, ["compare", str(recording.run.path), str(run.path)])
    rows = {words[0]: words[1:] for words in map(str.split, done.output.splitlines()) if words}
    delivered = str(recording.run.metrics["messages_delivered"])
    assert done.exit_code == 0 and rows["messages_delivered"] == [delivered, "-"]
    listed = CliRunner().invoke(app, ["ls", str(run.path.parent.parent)])
    assert " ".join(listed.output.splitlines()[-1].split()).startswith(
        f"own {run.path.name} imported 20") and " 3.0 s - " in " ".join(listed.output.split())
    assert key_figures(run.metrics, run.manifest) == [
        ("imported from", "own.bag", ""), ("driven", "3 m", "")]
    assert "own: imported from own.bag" in run._repr_html_()


# ------------------------------------------------------------------------------ damaged files


@pytest.fixture(scope="module")
def long(repository, tmp_path_factory):
    """A recording of several chunks, and its MCAP file."""
    folder = tmp_path_factory.mktemp("long")
    recording = recording_of(made(repository, folder, "stop.elapsed=20 s",
                                  file="maze_8.yaml"))
    write_mcap(recording, folder / "long.mcap", quiet)
    return recording, folder / "long.mcap"


@pytest.mark.parametrize("share", [0.6, 0.97])
def test_an_mcap_file_that_was_cut_short_is_read_up_to_there(long, tmp_path, share):
    recording, mcap = long
    data = mcap.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[:int(share * len(data))])
    done = import_recording(tmp_path / "cut.mcap", tmp_path)
    found = recording_of(done.run)
    count = len(found.poses.times_ns) - 1  # the last one holds to the end
    assert count > 10
    assert np.array_equal(found.poses.xy_mm[:count, 0], recording.poses.xy_mm[:count, 0])
    assert done.notes[-1] == ("the file is damaged, and was read as far as it can be: EndOfFile")


def test_a_chunk_with_wrong_bytes_is_left_out(long, tmp_path):
    recording, mcap = long
    data = bytearray(mcap.read_bytes())
    with mcap.open("rb") as file:
        chunk = make_reader(file).get_summary().chunk_indexes[2]
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 1
    (tmp_path / "wrong.mcap").write_bytes(data)
    done = import_recording(tmp_path / "wrong.mcap", tmp_path)
    poses = recording_of(done.run).poses
    assert done.run.manifest["broken"] and poses.times_ns[-1] == recording.end_ns
    for k in (0, 20, -1):  # before and behind the hole
        assert np.array_equal(poses.xy_mm[k], recording.poses.xy_mm[k])


def test_nothing_is_written_through_links_that_lie_in_the_place(bag, tmp_path):
    done = import_recording(bag, tmp_path)
    folder, victim = done.run.path, tmp_path / "victim.txt"
    partial = folder.with_name(f"{folder.name}.partial")
    victim.write_text("precious")
    partial.mkdir()
    for place in (folder, partial):
        for name in ("summary.json", "poses.parquet"):
            (place / name).unlink(missing_ok=True)
            (place / name).symlink_to(victim)
    again = import_recording(bag, tmp_path).run
    assert victim.read_text() == "precious" and again.metrics == done.run.metrics
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError) as caught:
        import_recording(bag, tmp_path)
    assert str(caught.value) == (f"--out: {folder} cannot be written: is a symbolic link, which "
                                 "desim does not write through")


@pytest.mark.parametrize("content, text", [
    (b"", "is empty"),
    (b"hello", "is no recording; allowed: an MCAP file, a bag of ROS 1, the folder of a bag "
               "of ROS 2, a .db3 of it, or a TUM trajectory"),
    (b"\x89MCAP0\r\n", "damaged: "),
    (b"#ROSBAG V2.0\n", "damaged: ")])
def test_a_file_that_is_none_gets_one_line(tmp_path, content, text):
    path = tmp_path / "file.mcap"
    path.write_bytes(content)
    done = CliRunner().invoke(app, ["import", str(path), "--out", str(tmp_path / "results")])
    assert done.exit_code == 2 and done.stderr.startswith(f"{path}: {text}")
    assert done.stderr.count("\n") == 1 and not (tmp_path / "results").exists()


def test_a_bag_that_was_cut_short_gets_one_line(bag, tmp_path):
    data = bag.read_bytes()
    (tmp_path / "cut.bag").write_bytes(data[:len(data) // 2])
    with pytest.raises(InputError) as error:
        import_recording(tmp_path / "cut.bag", tmp_path)
    assert str(error.value).endswith("; rosbag reindex may mend it")
    assert "\n" not in str(error.value)


def test_a_bag_with_wrong_bytes_is_not_to_be_indexed_again(bag, tmp_path):
    data = bytearray(bag.read_bytes())
    with rosbag1.Reader(bag) as reader:
        chunk = min(reader.chunks.values(), key=lambda each: each.datapos)
    data[chunk.datapos + chunk.datasize // 2] ^= 0xFF
    (tmp_path / "wrong.bag").write_bytes(data)
    with pytest.raises(InputError) as error:
        import_recording(tmp_path / "wrong.bag", tmp_path)
    assert str(error.value).startswith(f"{tmp_path / 'wrong.bag'}: damaged: ")
    assert "reindex" not in str(error.value)


def test_a_folder_that_is_no_bag(tmp_path):
    with pytest.raises(InputError) as error:
        import_recording(tmp_path, tmp_path)
    assert str(error.value) == (
        f"{tmp_path}: is no folder of a bag of ROS 2: it has no metadata.yaml; allowed: an MCAP "
        "file, a bag of ROS 1, the folder of a bag of ROS 2, a .db3 of it, or a TUM trajectory")


@pytest.mark.parametrize("text, name", [
    ("ä", "a"), ("Büro 2", "Buro_2"), ("2024-05-01", "recording_2024_05_01"), ("日本", "recording"),
    ("_x_", "x"), ("lab.1", "lab_1")])
def test_a_run_is_called_like_its_file(own, text, name):
    own.odometry("/odom", START_NS, "map", 0, 0, 0)
    assert own.imported(name=text).run.manifest["name"] == name


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError) as error:
        import_recording(tmp_path / "no.bag", tmp_path)
    assert str(error.value) == f"{tmp_path / 'no.bag'}: No such file or directory"


def test_the_command_says_what_it_found(bag, tmp_path):
    words = ["import", str(bag), "--out", str(tmp_path), "--name", "lab"]
    first, again = (CliRunner().invoke(app, words) for _ in range(2))  # it is replaced
    assert first.exit_code == again.exit_code == 0 and first.stdout == again.stdout
    lines = first.stdout.splitlines()
    assert lines[:4] == ["3 robots, 12.0 s, 121 poses each", "  robot_0: /robot_0/odom",
                         "  robot_1: /robot_1/odom", "  robot_2: /robot_2/odom"]
    run = Run(lines[-1].removeprefix("results in "))
    assert run.path.parent == tmp_path / "lab"
    assert json.loads((run.path / "manifest.json").read_text())["source"] == bag.name
