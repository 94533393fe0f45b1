"""The exchange of maps: what is said, when, how large it is, and that everybody ends up alike."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sharing_fleet import SPEC, Explorer, Fleet, S, see

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.contents import occupancy_grid_bytes
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.ports import Pose2D
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import TilePool, tiles_of
from desim.robot.monitor_feed import MonitorFeed
from desim.robot.sharing.kinds.own_maps import OwnMaps
from desim.robot.sharing.map_message import MapFormat, MapUpdate
from desim.robot.sharing.rates import MERGING_HZ, REFRESH_PERIODS
from netmodels.rules.loss import Loss
from netmodels.rules.partition import Partition

CELLS = 70 * 50

poses = st.tuples(st.floats(0.5, 13.5), st.floats(0.5, 9.5), st.floats(-4.0, 4.0))


# ---- on the wire --------------------------------------------------------------------------------


ALL_TILES = np.arange(6)  # 3 x 2 of 32 x 32 cells


def of_a_grid(data, encoding):
    """(version, pose), tiles and their cells [k, 1024] of a nav_msgs/OccupancyGrid."""
    header = struct.Struct("<III I13s IIfII 7d I")
    _, seconds, ns, _, _, _, _, _, width, height, *pose, _, _, _, _, _ = header.unpack_from(data)
    body = zlib.decompress(data[header.size:]) if encoding == "zlib" else data[header.size:]
    cells = np.frombuffer(body, np.int8)
    assert not cells[height * width:].any()  # padding
    cells = cells[:height * width].reshape(height, width)
    return (seconds * S + ns, *pose), ALL_TILES, tiles_of(SPEC, cells)


def of_tiles(data, encoding):
    """The same of tiles with their numbers."""
    version, x_m, y_m, yaw_rad, count, complete = struct.unpack_from("<qdddHB", data)
    body = zlib.decompress(data[35:]) if encoding == "zlib" else data[35:]
    entries = np.frombuffer(body, [("number", "<u2"), ("cells", "i1", 1024)])
    assert len(entries) == count
    tiles, cells = entries["number"], entries["cells"]
    if complete:
        cells = np.zeros((6, 1024), np.int8)
        cells[tiles], tiles = entries["cells"], ALL_TILES
    return (version, x_m, y_m, yaw_rad), tiles, cells


@given(st.lists(poses, max_size=4), st.lists(poses, max_size=2), poses, st.integers(0, 10**13),
       st.sampled_from(["full", "changed_tiles"]), st.sampled_from(["raw", "zlib"]), st.booleans(),
       st.sampled_from([0, 1, 9000]))
def test_decoding_undoes_encoding_and_the_size_is_true(before, after, pose, version, content,
                                                       encoding, complete, padding):
    robot_map = RobotMap(SPEC, TilePool())
    for seen in before:
        see(robot_map, *seen)
    sent = robot_map.own.snapshot()
    for seen in after:
        see(robot_map, *seen)
    layer = robot_map.own.snapshot()
    if content == "changed_tiles" and not complete:
        layer = layer.only(robot_map.own.changed_since(sent))
    wire = MapFormat(SPEC, content, encoding, padding)
    update = MapUpdate("robot_1", version, Pose2D(*pose), layer, wire.size_bytes(layer))
    data = wire.encode(update)
    received, tiles, evidence = (of_a_grid if content == "full" else of_tiles)(data, encoding)
    assert len(data) == update.size_bytes
    assert received == (version, *pose)
    assert np.array_equal(tiles, layer.tiles)
    assert np.array_equal(evidence, layer.cells())


def test_sizes():
    robot_map = RobotMap(SPEC, TilePool())
    see(robot_map, 7.0, 5.0, 0.0)
    layer = robot_map.own.snapshot()
    filled = len(layer.filled())
    assert filled == 2
    assert occupancy_grid_bytes(CELLS) == 109 + CELLS
    assert MapFormat(SPEC, "full", "raw").size_bytes(layer) == 109 + CELLS
    assert MapFormat(SPEC, "changed_tiles", "raw").size_bytes(layer) == 35 + filled * (2 + 1024)
    assert MapFormat(SPEC, "changed_tiles", "zlib").size_bytes(layer) < 600
    assert MapFormat(SPEC, "full", "zlib").size_bytes(layer) < 600


# ---- robots that talk ---------------------------------------------------------------------------


def exchange(content="full", encoding="raw", via="unicast"):
    params = OwnMaps.Params(content=content, encoding=encoding, period="5 s", via=via)
    return lambda: OwnMaps(params)


BOTH = pytest.mark.parametrize("content", ["full", "changed_tiles"])


def test_a_robot_tells_the_others_what_is_new_and_then_falls_silent():
    fleet = Fleet(exchange(), [{1}, set(), set()]).run(29)
    instant = fleet.log[0][0]
    assert 1 <= instant <= 6  # its phase is random
    assert sorted(fleet.log) == [
        (instant, "robot_2", "map", "robot_2"), (instant, "robot_2", "peer", "robot_1"),
        (instant, "robot_3", "map", "robot_3"), (instant, "robot_3", "peer", "robot_1")]
    assert fleet.alike() == [True] * 3


def test_what_is_known_of_the_others_is_live():
    fleet = Fleet(exchange(), [{1}, {1, 22}, {5}]).run(19)
    announced = fleet.graph.host("robot_1").nodes[1].peers
    peers = dict(fleet.heard["robot_1"].peers)
    assert sorted(peers) == ["robot_2", "robot_3"]
    for peer in peers.values():  # it says where it was at that second
        assert 0.0 <= peer.heard_ns / S - peer.x_m < 1.0 + 1.0 / MERGING_HZ
    fleet.run(29)
    now = fleet.heard["robot_1"].peers
    assert now["robot_2"].heard_ns // S > 22 and now["robot_3"] == peers["robot_3"]
    assert announced.read().born_ns < 19 * S


def test_what_comes_between_two_mergings_is_merged_at_once():
    fleet, merged_ns = Fleet(exchange(), [set(), set(range(0, 60, 3)), set(range(60))]), []
    fleet.maps["robot_1"].observers.append(lambda _: merged_ns.append(fleet.kernel.now_ns))
    fleet.run(66)
    assert len(merged_ns) >= 12
    assert {(time_ns - merged_ns[0]) * MERGING_HZ % S for time_ns in merged_ns} == {0}


@BOTH
def test_it_says_everything_again_after_six_periods(content):
    fleet = Fleet(exchange(content), [{1}, set(), set()]).run(70)
    heard = [second for second, host, kind, _ in fleet.log if (host, kind) == ("robot_2", "peer")]
    assert np.diff(heard).tolist() == [5 * REFRESH_PERIODS] * (len(heard) - 1)
    assert len(heard) >= 2
    assert len([1 for _, host, kind, _ in fleet.log if (host, kind) == ("robot_2", "map")]) == 1


@BOTH
@pytest.mark.parametrize("encoding", ["raw", "zlib"])
def test_after_all_has_arrived_all_know_the_same(content, encoding):
    seconds = [set(range(0, 60, 3)), set(range(1, 60, 7)), {5, 6, 40}]
    fleet = Fleet(exchange(content, encoding), seconds).run(66)
    assert fleet.alike() == [True] * 3


def test_changed_tiles_say_less():
    seconds = [set(range(0, 60, 3)), set(range(1, 60, 7)), {5, 6, 40}]
    sizes = []
    for way in (("full", "raw"), ("full", "zlib"), ("changed_tiles", "raw"),
                ("changed_tiles", "zlib")):
        fleet = Fleet(exchange(*way), seconds).run(66)
        sizes.append(sum(fleet.graph.topic(f"/map_exchange/robot_{k}").counts.bytes
                         for k in (1, 2, 3)))
    assert sizes[3] < sizes[1] < sizes[0]
    assert sizes[3] < sizes[2]


@BOTH
def test_a_partition_heals(content):
    rule = Partition(Partition.Params(groups=[["robot_1"]], **{"from": "10 s", "until": "70 s"}))
    seconds = [set(range(0, 60, 3)), set(range(1, 60, 4)), {5, 25, 45}]
    fleet = Fleet(exchange(content), seconds, [rule]).run(69)
    assert fleet.alike() == [False] * 3
    # The stream's own retransmission may wait as long again; a complete update is due in 30 s.
    fleet.run(69 + 200)
    assert fleet.alike() == [True] * 3


@BOTH
def test_lost_broadcasts_are_made_good(content):
    seconds = [set(range(0, 60, 3)), set(range(1, 60, 7)), {5, 6, 40}]
    fleet = Fleet(exchange(content, via="broadcast"), seconds,
                  [Loss(Loss.Params(probability="10 %"))]).run(600)
    assert fleet.alike() == [True] * 3


@BOTH
def test_a_robot_that_starts_again_hears_old_maps(content):
    fleet = Fleet(exchange(content), [{1, 2, 8}, {1, 9}, set()]).run(40)
    fleet.graph.host("robot_3").stop()
    fleet.run(60)
    fleet.graph.host("robot_3").start()
    assert fleet.maps["robot_3"].version == 0
    fleet.run(60 + 5 * REFRESH_PERIODS + 5)
    assert fleet.alike() == [True] * 3


def test_what_a_restarted_robot_sees_replaces_what_it_saw_before():
    fleet = Fleet(exchange(), [{1, 2, 8, 60}, {1}, set()]).run(40)
    fleet.graph.host("robot_1").stop()
    fleet.run(50)
    fleet.graph.host("robot_1").start()
    fleet.run(100)
    assert fleet.alike() == [True] * 3


def test_nothing_is_said_where_nothing_is_shared():
    fleet = Fleet(lambda: None, [{1, 2}, {1}, set()]).run(100)
    assert fleet.log == []
    assert fleet.graph.messages == 0


# ---- for the monitor ----------------------------------------------------------------------------


class Station(Node):
    def __init__(self, host, log):
        super().__init__(host, "station")
        self._log = log

    def start(self):
        for topic in ("explored_map", "distance"):
            self.subscribe(f"/robot_1/{topic}", self._log.append)


def test_the_monitor_gets_map_and_distance_once_a_second():
    kernel, names, log = Kernel(), Names(), []
    graph = Graph(kernel, names, Trace(names), Streams(0), Direct(), ["robot_1"])
    robot_map = RobotMap(SPEC, TilePool())
    see(robot_map, 7.0, 5.0, 0.0)

    def walk(host):
        explorer = Explorer(host, robot_map, {2})
        return [explorer, MonitorFeed(host, robot_map, S), Station(host, log)]

    graph.host("robot_1").software = walk
    graph.start()
    kernel.run(4 * S - 1)
    maps = [message for message in log if message.topic.endswith("explored_map")]
    metres = [message.content.value for message in log if message.topic.endswith("distance")]
    assert [message.size_bytes for message in maps] == [occupancy_grid_bytes(CELLS)] * 4
    assert metres == [0.0, 1.0, 2.0, 3.0]  # the explorer says that it moves 1 m in a second
    grids = [message.content for message in maps]  # read late: as they were when published
    known = [np.count_nonzero(grid >= 0) for grid in grids]
    assert 0 < known[0] == known[1] < known[3]
    assert set(np.unique(grids[3]).tolist()) == {-1, 0, 100}
    column, row = SPEC.cell(7.0 + 1.0, 5.0 + 0.125)
    assert grids[0][row, column] == 0
