"""The cells that a scan clears and marks, against exact geometry; and the scans taken in."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.contents import LaserScan, Lazy, Pose
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.ports import GridSpec
from desim.robot.mapping.kernels import evidence
from desim.robot.mapping.kernels.tiles import HIT, MISS
from desim.robot.mapping.node import Mapping
from desim.robot.mapping.robot_map import RobotMap, _Scans
from desim.robot.mapping.tiles import FREE, OCCUPIED, TilePool, cell_numbers, raster
from desim.robot.stamped_poses import between
from desim.scenario.schema import robot as parameters

MS = 1_000_000
SPEC = GridSpec(0.2, 72, 62, -0.1, -0.1)  # whole multiples of 0.2 m are centres of cells


# ---- lines through cells ------------------------------------------------------------------------


def cells_on_line(spec, x, y, angle, length):
    """Columns and rows, in order, by the kernel; all in units of cells."""
    sheet = evidence.Sheet(cell_numbers(spec), np.zeros(4096 * 8, np.uint8),
                           np.empty(1024, np.int8))
    evidence.walk(x, y, math.cos(angle), math.sin(angle), length, spec.width, spec.height, 1, sheet)
    tile, place = np.divmod(np.flatnonzero(sheet.marks), 1024)
    tiles_x = -(-spec.width // 32)
    columns, rows = tile % tiles_x * 32 + place % 32, tile // tiles_x * 32 + place // 32
    # Each step of a line goes on in x or in y.
    order = np.argsort(np.copysign(columns, math.cos(angle)) + np.copysign(rows, math.sin(angle)))
    return list(zip(columns[order].tolist(), rows[order].tolist(), strict=True))


def chord(column, row, x, y, angle, length, grow):
    """Length of the line inside the cell, grown by ``grow`` on all sides (Liang, Barsky 1984)."""
    begin, end = 0.0, length
    for at, low, along in ((x, column, math.cos(angle)), (y, row, math.sin(angle))):
        sides = ((low - grow - at), (low + 1 + grow - at))
        if along == 0.0:
            if not sides[0] <= 0.0 <= sides[1]:
                return -1.0
        else:
            first, second = sorted(side / along for side in sides)
            begin, end = max(begin, first), min(end, second)
    return end - begin


@given(st.floats(0.0, 71.9), st.floats(0.0, 61.9), st.floats(-7.0, 7.0), st.floats(0.0, 130.0))
def test_a_line_goes_through_the_cells_that_geometry_says(x, y, angle, length):
    walked = cells_on_line(SPEC, x, y, angle, length)
    inside = {(column, row) for column in range(SPEC.width) for row in range(SPEC.height)
              if chord(column, row, x, y, angle, length, -1e-5) > 0.0}
    assert inside <= set(walked)
    for column, row in walked:
        assert chord(column, row, x, y, angle, length, 1e-5) >= 0.0
    for one, next_ in zip(walked, walked[1:], strict=False):
        assert abs(one[0] - next_[0]) + abs(one[1] - next_[1]) == 1


@pytest.mark.parametrize("angle", [k * math.pi / 4 for k in range(8)])
def test_a_line_through_corners_skips_no_cell(angle):
    walked = cells_on_line(SPEC, 30.5, 30.5, angle, 20.0)
    assert walked[0] == (30, 30)
    for one, next_ in zip(walked, walked[1:], strict=False):
        assert abs(one[0] - next_[0]) + abs(one[1] - next_[1]) == 1
    reach = round(20.0 * max(abs(math.cos(angle)), abs(math.sin(angle))) - 1e-9)
    for k in range(reach):
        assert (30 + round(math.copysign(k, math.cos(angle)) if abs(math.cos(angle)) > 0.1 else 0),
                30 + round(math.copysign(k, math.sin(angle)) if abs(math.sin(angle)) > 0.1 else 0)
                ) in walked


# ---- evidence ----------------------------------------------------------------------------------


def plain_change(old, marks, hit, spared, low=evidence.CLAMP_LOW):
    """The change of evidence ``old`` by a scan with this stamp of hits."""
    new = old.astype(int)
    new[marks == hit] += HIT
    new[(marks == (hit + 1) % 256) & (old < spared)] += MISS
    return np.clip(new, low, evidence.CLAMP_HIGH) - old


@given(st.integers(0, 2**32 - 1), st.integers(0, 126).map(lambda half: 2 * half),
       st.sampled_from((OCCUPIED, evidence.CLAMP_HIGH + 1)), st.sampled_from((0, 1)))
def test_a_tile_changes_by_hits_and_misses_up_to_the_clamps(seed, hit, spared, tile):
    rng = np.random.default_rng(seed)
    old = rng.integers(evidence.CLAMP_LOW, evidence.CLAMP_HIGH + 1, 1024).astype(np.int8)
    marks = rng.choice(np.array([hit, hit + 1, hit + 3, 0, 255], np.uint8), 2048)
    found, seen = np.empty(1024, np.int8), marks[1024 * tile:][:1024]
    assert evidence.weigh(marks, hit, spared, tile, old, found)
    assert np.array_equal(found, plain_change(old, seen, hit, spared))
    assert not np.array_equal(found, plain_change(old, seen, hit, spared, -128))  # the twin
    assert not evidence.weigh(np.full(2048, hit + 2, np.uint8), hit, spared, tile, old, found)


# ---- a toy world of thin walls ------------------------------------------------------------------

FIELD_OF_VIEW_RAD = math.radians(190)
WALLS = np.array([(0.0, 0.0, 14.0, 0.0), (14.0, 0.0, 14.0, 12.0), (14.0, 12.0, 0.0, 12.0),
                  (0.0, 12.0, 0.0, 0.0), (6.0, 0.0, 6.0, 8.0), (6.0, 8.0, 10.0, 8.0)])


def scan_from(x_m, y_m, yaw_rad, walls=WALLS, beams=180):
    """The exact scan from a pose."""
    increment_rad = FIELD_OF_VIEW_RAD / (beams - 1)
    angle = yaw_rad - 0.5 * FIELD_OF_VIEW_RAD + np.arange(beams) * increment_rad
    along_x, along_y = np.cos(angle)[:, None], np.sin(angle)[:, None]
    from_x, from_y = walls[:, 0] - x_m, walls[:, 1] - y_m
    wall_x, wall_y = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = along_x * wall_y - along_y * wall_x
        distance = (from_x * wall_y - from_y * wall_x) / across
        place = (from_x * along_y - from_y * along_x) / across
    hit = (across != 0.0) & (place >= 0.0) & (place <= 1.0) & (distance > 0.0)
    ranges = np.where(hit, distance, np.inf).min(axis=1)
    return LaserScan(0, np.minimum(ranges, 26.0).astype(np.float32), -0.5 * FIELD_OF_VIEW_RAD,
                     increment_rad, 26.0)


def truth(walls=WALLS, spec=SPEC):
    """bool [height, width]: the cells that hold a piece of a wall."""
    solid = np.zeros((spec.height, spec.width), bool)
    for x1, y1, x2, y2 in walls:
        for part in np.linspace(0.0, 1.0, 1000):
            column, row = spec.cell(x1 + part * (x2 - x1), y1 + part * (y2 - y1))
            solid[row, column] = True
    return solid


def seen_from(poses, walls=WALLS, spec=SPEC, usable_m=25.0):
    robot_map = RobotMap(spec, TilePool())
    for pose in poses:
        robot_map.integrate_scan(*pose, scan_from(*pose, walls), usable_m)
    return raster(spec, robot_map.fused)


def wander(count, seed=3):
    """Poses along the corridors of the toy world."""
    rng = np.random.default_rng(seed)
    corners = np.array([(3.0, 2.0), (3.0, 10.0), (12.0, 10.0), (12.0, 4.0), (8.0, 4.0)])
    legs = np.linspace(0.0, len(corners) - 1.001, count)
    start = legs.astype(int)
    places = corners[start] + (legs - start)[:, None] * (corners[start + 1] - corners[start])
    return [(float(x), float(y), float(rng.uniform(-3.1, 3.1)))
            for x, y in places + rng.uniform(-0.9, 0.9, places.shape)]


def test_the_map_of_a_toy_world_is_its_truth():
    known, solid = seen_from(wander(120)), truth()
    wrong = ((known <= FREE) & solid) | ((known >= OCCUPIED) & ~solid)
    assert np.count_nonzero(wrong) == 0
    inside = np.zeros_like(solid)
    inside[1:60, 1:70] = True
    assert np.count_nonzero((known > FREE) & ~solid & inside) == 0
    assert np.count_nonzero((known < OCCUPIED) & solid) <= 3


def test_no_scan_leaves_a_trace_in_later_ones():
    """All maps of one size share a sheet of stamps, which come round again after 127 scans."""
    one, other = (RobotMap(SPEC, TilePool()) for _ in range(2))
    for pose in wander(140):
        scan = scan_from(*pose)
        one.integrate_scan(*pose, scan, 25.0)
        other._scans = _Scans(SPEC)  # a sheet without stamps
        other.integrate_scan(*pose, scan, 25.0)
        assert np.array_equal(one.fused, other.fused)


def test_nothing_outside_of_the_walls_is_ever_known():
    known = seen_from(wander(40))
    assert not known[61:].any()
    assert not known[:, 71:].any()


@pytest.mark.parametrize("half_m", [20.0, 40.0])  # its end in sight, and beyond the laser's range
@pytest.mark.parametrize("offset_m", [0.3, 0.5, 1.0, 4.0])
def test_beams_that_graze_a_wall_do_not_erase_it(offset_m, half_m):
    walls = np.array([(-half_m, 0.0, half_m, 0.0)])
    spec = GridSpec(0.2, round(10 * half_m) + 1, 61, -half_m - 0.1, -6.1)
    for side in (1, -1):
        poses = [(0.37 * k - 4.0, side * offset_m, -side * 0.05 * k) for k in range(20)]
        known, solid = seen_from(poses, walls, spec), truth(walls, spec)
        assert np.count_nonzero((known <= FREE) & solid) == 0
        assert np.count_nonzero((known >= OCCUPIED) & solid) > 60
        behind = known[:30] if side > 0 else known[31:]
        assert not behind.any()


@given(st.floats(0.2, 1.3))
def test_no_beam_leaks_through_a_diagonal_wall(slope):
    """Wall cells touch at corners only; behind them nothing may become known."""
    walls = np.array([(0.0, 0.0, 9.0, 9.0 * slope)])
    poses = [(3.0 + 0.4 * k, 0.2, 1.2 + 0.1 * k) for k in range(8)]
    known, solid = seen_from(poses, walls), truth(walls)
    column = np.arange(SPEC.width)[None, :]
    row = np.arange(SPEC.height)[:, None]
    behind = (row - 1 > (column + 1) * slope + 1) & (column < 44) & (column > 1) & ~solid
    hidden = behind & (row < 9.0 * slope / 0.2 - 1)
    lit = [(c, r) for r, c in np.argwhere(hidden & (known != 0))
           if all(_crosses(pose, (c, r), walls[0]) for pose in poses)]
    assert lit == []


def _crosses(pose, cell, wall):
    """Whether the wall is between a pose and the whole of a cell."""
    x, y = cell[0] * 0.2, cell[1] * 0.2
    sides = []
    for corner_x, corner_y in ((x - 0.1, y - 0.1), (x + 0.1, y - 0.1), (x - 0.1, y + 0.1),
                               (x + 0.1, y + 0.1)):
        from_x, from_y = pose[0] - wall[0], pose[1] - wall[1]
        along_x, along_y = corner_x - pose[0], corner_y - pose[1]
        wall_x, wall_y = wall[2] - wall[0], wall[3] - wall[1]
        across = along_x * wall_y - along_y * wall_x
        if across == 0.0:
            return False
        part = -(from_x * wall_y - from_y * wall_x) / across
        place = (along_x * from_y - along_y * from_x) / across
        sides.append(0.0 < part < 1.0 and 0.0 < place < 1.0)
    return all(sides)


def test_a_long_beam_clears_up_to_the_usable_range_and_marks_nothing():
    spec = GridSpec(0.2, 200, 20, 0.0, 0.0)
    for range_m, usable_m, free_cells, wall in ((26.0, 25.0, 125, None), (24.0, 25.0, 120, 120),
                                                (25.5, 25.0, 125, None), (26.0, 30.0, 130, None)):
        robot_map = RobotMap(spec, TilePool())
        beam = LaserScan(0, np.full(2, range_m - 0.05, np.float32) if range_m < 26.0
                         else np.full(2, 26.0, np.float32), 0.0, 0.0, 26.0)
        robot_map.integrate_scan(0.1, 2.1, 0.0, beam, usable_m)
        known = raster(spec, robot_map.fused)[10]
        assert np.flatnonzero(known >= OCCUPIED).tolist() == ([] if wall is None else [wall])
        assert abs(np.count_nonzero(known <= FREE) - free_cells) <= 1


# ---- the node -----------------------------------------------------------------------------------


class Notebook(RobotMap):
    """A map that writes down what it is told to integrate: x in m, yaw, stamp in ms."""

    def __init__(self):
        super().__init__(SPEC, TilePool())
        self.log = []

    def integrate_scan(self, x_m, y_m, yaw_rad, scan, usable_range_m):
        self.log.append((round(x_m, 6), round(yaw_rad, 6), scan.stamp_ns // MS))
        self.version += 1


class Sensors(Node):
    """Publishes scans and poses of a robot that moves as ``where(time_ns)`` says."""

    def __init__(self, host, where, scan_hz, pose_hz, scan_first, computed):
        super().__init__(host, "sensors")
        self._where, self._computed = where, computed
        self._rates = [(scan_hz, self._scan), (pose_hz, self._pose)][::1 if scan_first else -1]

    def start(self):
        self.advertise("scan")
        self.advertise("pose")
        for rate_hz, tick in self._rates:
            self.timer(rate_hz, tick, start="zero")

    def _scan(self, _):
        stamp_ns = self.now_ns

        def compute():
            self._computed.append(stamp_ns)
            return LaserScan(stamp_ns, np.ones(2, np.float32), 0.0, 0.1, 26.0)

        self.publish("scan", Lazy(100, compute))

    def _pose(self, _):
        self.publish("pose", Pose(self.now_ns, *self._where(self.now_ns)))


class Listener(Node):
    def __init__(self, host, log):
        super().__init__(host, "listener")
        self._log = log

    def start(self):
        self.subscribe("map", lambda message: self._log.append(self.now_ns // MS))


def drive(where, until_ms, scan_hz=25, pose_hz=10, scan_first=True, **mapping):
    """(what was integrated, when ``map`` came, stamps of the scans that were computed)"""
    kernel, names = Kernel(), Names()
    graph = Graph(kernel, names, Trace(names), Streams(0), Direct(), ["robot_1"])
    robot_map, maps, computed = Notebook(), [], []
    graph.host("robot_1").software = lambda host: [
        Mapping(host, parameters.MappingParams(**mapping), robot_map),
        Sensors(host, where, scan_hz, pose_hz, scan_first, computed), Listener(host, maps)]
    graph.start()
    kernel.run(until_ms * MS)
    return robot_map.log, maps, [stamp_ns // MS for stamp_ns in computed]


def forward(time_ns):
    """1.2 m/s for two seconds, then it stands."""
    return (1.2 * min(time_ns / 1e9, 2.0), 0.0, 0.0)


@pytest.mark.parametrize("scan_first", [True, False])
def test_scans_are_taken_after_a_metre_and_once_at_rest(scan_first):
    log, maps, computed = drive(forward, 4000, scan_first=scan_first)
    assert log == [(0.0, 0.0, 0), (1.2, 0.0, 1000), (2.4, 0.0, 2000)]
    assert maps == computed == [0, 1000, 2000]


def test_the_last_scan_is_taken_when_it_has_come_to_rest():
    log, _, _ = drive(lambda t: (1.2 * min(t / 1e9, 1.3), 0.0, 0.0), 4000)
    assert log == [(0.0, 0.0, 0), (1.2, 0.0, 1000), (1.56, 0.0, 1400)]


def test_a_turn_counts_across_the_half_turn():
    log, _, _ = drive(lambda t: (0.0, 0.0, math.remainder(3.0 + 1.0 * t / 1e9, math.tau)), 1300)
    assert [(yaw, scan_ms) for _, yaw, scan_ms in log] == [
        (3.0, 0), (round(3.6 - math.tau, 6), 600), (round(4.2 - math.tau, 6), 1200)]


def test_a_robot_that_stands_looks_again_where_that_is_asked_for():
    log, _, _ = drive(lambda t: (1.0, 2.0, 3.0), 3000, temporal_update="900 ms")
    assert [scan_ms for _, _, scan_ms in log] == [0, 1000, 2000, 3000]


def test_a_robot_that_stands_computes_one_scan():
    log, maps, computed = drive(lambda t: (1.0, 2.0, 3.0), 3000)
    assert len(log) == len(maps) == len(computed) == 1


def test_rates_without_common_stamps_are_interpolated():
    log, _, _ = drive(lambda t: (1.2 * t / 1e9, 0.0, 0.0), 3000, scan_hz=13, pose_hz=7)
    assert len(log) >= 3
    for x_m, _, scan_ms in log:
        assert x_m == pytest.approx(1.2 * scan_ms / 1e3, abs=1.3e-3)  # the stamp is cut to 1 ms


def test_between_two_poses_the_shorter_way_round():
    before, after = Pose(0, 0.0, 1.0, 3.1), Pose(100, 1.0, 1.0, -3.1)
    half = between(before, after, 50)
    assert (half.x_m, half.y_m) == (0.5, 1.0)
    assert abs(math.remainder(half.yaw_rad - math.pi, math.tau)) < 1e-9


def test_a_laser_clears_nothing_that_a_lower_one_sees():
    """A low wall at 5 m; afterwards the high laser looks over it, from afar and often."""
    def wall(is_lowest):
        robot_map = RobotMap(SPEC, TilePool())
        low = LaserScan(0, np.full(3, 5.0, np.float32), -0.01, 0.01, 26.0)
        for _ in range(3):
            robot_map.integrate_scan(0.0, 0.0, 0.0, low, 25.0)
        high = LaserScan(0, np.full(3, 26.0, np.float32), -0.01, 0.01, 26.0, is_lowest=is_lowest)
        for _ in range(20):
            robot_map.integrate_scan(0.0, 0.0, 0.0, high, 25.0)
        column, row = SPEC.cell(5.1, 0.0)
        return [int(robot_map.fused[row // 32 * robot_map.tiles_x + c // 32,
                                    row % 32 * 32 + c % 32]) for c in (column, column + 3)]

    wall_cell, beyond = wall(False)
    assert wall_cell > 0 > beyond
    assert max(wall(True)) < 0  # the twin
