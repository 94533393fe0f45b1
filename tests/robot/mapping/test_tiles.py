"""Evidence in tiles: exact sums, in any order; snapshots that stay; nothing leaks."""

import gc
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan
from desim.monitor.coverage import states
from desim.ports import GridSpec
from desim.robot.mapping.kernels.evidence import CLAMP_HIGH, CLAMP_LOW
from desim.robot.mapping.kernels.tiles import HIT, MISS
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import (
    FREE,
    OCCUPIED,
    TILE,
    LayerSnapshot,
    TilePool,
    cropped,
    fuse,
    raster,
    tiles_of,
)

SPEC = GridSpec(0.2, 70, 50, 0.0, 0.0)  # 3 x 2 tiles, the last ones cut
CENTRE = (7.0, 5.0, 0.0)


def in_use(pool: TilePool) -> int:
    """The number of tiles that some layer or snapshot points to."""
    return len(pool.arrays.data) - 1 - int(pool.arrays.free_count[0])


def scan(ranges, field_of_view_rad=math.pi, range_max_m=26.0):
    increment_rad = field_of_view_rad / (len(ranges) - 1)
    return LaserScan(0, np.asarray(ranges, np.float32), -0.5 * field_of_view_rad, increment_rad,
                     range_max_m)


poses = st.tuples(st.floats(0.5, 13.5), st.floats(0.5, 9.5), st.floats(-4.0, 4.0))
readings = st.tuples(poses, st.lists(st.floats(0.1, 26.0), min_size=2, max_size=6).map(scan))


def see(robot_map, reading, usable_m=25.0):
    pose, what = reading
    robot_map.integrate_scan(*pose, what, usable_m)


# ---- the sum ------------------------------------------------------------------------------------


@st.composite
def conversations(draw):
    """Updates of three robots: (source, version, snapshot), complete or changes only, each source
    ending with a complete one; then the order in which they arrive: any, with repetitions and with
    any but the last update of a source missing."""
    pool = TilePool(8)
    updates, last = [], []
    for source in ("robot_1", "robot_2", "robot_3"):
        teller, sent = RobotMap(SPEC, pool), None
        history = draw(st.lists(st.lists(readings, min_size=1, max_size=3), min_size=1, max_size=4))
        for version, seen in enumerate(history):
            for reading in seen:
                see(teller, reading)
            known = teller.own.snapshot()
            complete = sent is None or version == len(history) - 1 or draw(st.booleans())
            update = known if complete else known.only(teller.own.changed_since(sent))
            updates.append((source, version, update))
            sent = known
        last.append(updates[-1])
    some = draw(st.lists(st.sampled_from(updates), max_size=2 * len(updates)))
    return pool, updates, draw(st.permutations(some + last))


@given(conversations())
def test_any_order_with_duplicates_and_gaps_gives_the_same_sum(talk):
    pool, in_order, as_it_came = talk
    straight, crooked = RobotMap(SPEC, pool), RobotMap(SPEC, pool)
    for update in in_order:
        straight.receive([update])
    for update in as_it_came:
        crooked.receive([update])
    assert np.array_equal(straight.fused, crooked.fused)


@given(conversations(), st.lists(readings, max_size=5))
def test_the_incremental_sum_is_the_recomputed_one(talk, seen):
    pool, _, as_it_came = talk
    robot_map = RobotMap(SPEC, pool)
    for number, update in enumerate(as_it_came):
        robot_map.receive([update])
        if number < len(seen):
            see(robot_map, seen[number])
        assert np.array_equal(robot_map.fused, fuse(robot_map.layers()))


@given(conversations())
def test_a_repetition_changes_nothing_and_says_so(talk):
    pool, updates, _ = talk
    robot_map = RobotMap(SPEC, pool)
    heard = []
    robot_map.observers.append(lambda changed: heard.append(changed.tolist()))
    for update in updates:
        robot_map.receive([update])
    version, before = robot_map.version, len(heard)
    assert not any(robot_map.receive([update]) for update in updates)
    assert (robot_map.version, len(heard)) == (version, before)


@given(conversations())
def test_updates_at_once_give_the_same_sum_and_one_change(talk):
    pool, _, as_it_came = talk
    one_by_one, at_once, heard = RobotMap(SPEC, pool), RobotMap(SPEC, pool), []
    see(at_once, (CENTRE, scan([3.0, 3.0])))
    see(one_by_one, (CENTRE, scan([3.0, 3.0])))
    before, version = states(at_once.fused), at_once.version
    at_once.observers.append(lambda changed: heard.append(changed.tolist()))
    for update in as_it_came:
        one_by_one.receive([update])
    changed = at_once.receive(as_it_came)
    assert np.array_equal(at_once.fused, one_by_one.fused)
    differ = states(at_once.fused) != before
    rows = differ.reshape(len(differ), TILE, TILE).any(axis=2)
    assert np.array_equal(at_once.row_version > version, rows)
    assert heard == [np.flatnonzero(rows.any(axis=1)).tolist()] * changed
    assert at_once.version == version + changed == version + bool(rows.any())
    assert not at_once.receive(as_it_came)


@given(st.lists(readings, min_size=1, max_size=8))
def test_observers_hear_exactly_the_tiles_where_cells_became_something_else(seen):
    robot_map, log, expected = RobotMap(SPEC, TilePool()), [], []
    robot_map.observers.append(lambda changed: log.append((robot_map.version, sorted(changed))))
    for reading in seen:
        before = states(robot_map.fused)
        see(robot_map, reading)
        tiles = np.flatnonzero((states(robot_map.fused) != before).any(axis=1))
        if len(tiles):
            expected.append((len(expected) + 1, tiles.tolist()))
            assert (robot_map.tile_version[tiles] == robot_map.version).all()
    assert log == expected


def test_a_source_that_starts_again_replaces_what_it_said_before():
    pool = TilePool()
    first, second, listener = RobotMap(SPEC, pool), RobotMap(SPEC, pool), RobotMap(SPEC, pool)
    see(first, (CENTRE, scan([3.0, 3.0])))
    see(second, ((2.0, 2.0, 1.0), scan([1.0, 1.0])))
    listener.receive([("robot_1", 5_000_000_000, first.own.snapshot())])
    listener.receive([("robot_1", 90_000_000_000, second.own.snapshot())])
    assert np.array_equal(listener.fused, second.fused)


def test_robots_that_took_in_the_same_updates_share_what_they_received():
    """One that missed an update has its own, until a complete one makes them equal again."""
    pool = TilePool()
    teller, first, second, third = (RobotMap(SPEC, pool) for _ in range(4))

    def said(version, to, complete):
        before = teller.own.snapshot()
        see(teller, ((2.0 + 9.0 * (version % 2), 2.0, 0.5 * version), scan([1.0, 1.5, 1.0])))
        known = teller.own.snapshot()
        update = known if complete else known.only(teller.own.changed_since(before))
        for listener in to:
            listener.receive([("teller", version, update)])

    said(0, (first, second, third), complete=True)
    said(1, (first, second), complete=False)
    said(2, (first, second, third), complete=False)
    of = [one.received["teller"] for one in (first, second, third)]
    assert of[0] is of[1] and of[0] is not of[2]
    assert of[0].sent.tolist() != of[2].sent.tolist()
    said(3, (first, second, third), complete=True)
    assert first.received["teller"] is second.received["teller"] is third.received["teller"]
    assert np.array_equal(first.fused, third.fused)


# ---- cells --------------------------------------------------------------------------------------


def test_cells_are_clamped_and_known_after_one_observation():
    robot_map = RobotMap(SPEC, TilePool())
    wall, free = SPEC.cell(7.0 + 3.1, 5.1), SPEC.cell(7.0 + 1.0, 5.1)

    def cell(column_row):
        return int(raster(SPEC, robot_map.fused)[column_row[1], column_row[0]])

    ahead = ((7.0, 5.1, 0.0), scan([3.1, 3.1], 1e-6))
    see(robot_map, ahead)
    assert (cell(wall), cell(free)) == (HIT, MISS)
    assert cell(wall) >= OCCUPIED and cell(free) <= FREE
    for _ in range(20):
        see(robot_map, ahead)
    assert (cell(wall), cell(free)) == (CLAMP_HIGH, CLAMP_LOW)
    version = robot_map.version
    see(robot_map, ahead)
    assert robot_map.version == version


def test_where_a_body_was_and_is_gone_nothing_is_unknown_again():
    """A robot that passes leaves no frontier: thirty of them would come back to look."""
    robot_map = RobotMap(SPEC, TilePool())
    column, row = SPEC.cell(7.0 + 2.1, 5.1)
    known = []
    for reach in (2.1, 2.1, 9.0, 9.0, 9.0, 9.0, 9.0):
        see(robot_map, ((7.0, 5.1, 0.0), scan([reach, reach], 1e-6)))
        value = int(raster(SPEC, robot_map.fused)[row, column])
        known.append("free" if value <= FREE else "occupied" if value >= OCCUPIED else "unknown")
    # 17, 34, 26, 18, 10, 2, -6: the more probable state
    assert known == ["occupied"] * 6 + ["free"]


@given(st.integers(1, 100), st.integers(1, 100), st.data())
def test_raster_and_tiles_are_inverse(width, height, data):
    spec = GridSpec(0.2, width, height, 0.0, 0.0)
    seed = data.draw(st.integers(0, 2**32 - 1))
    cells = np.random.default_rng(seed).integers(-40, 71, (height, width)).astype(np.int8)
    assert np.array_equal(raster(spec, tiles_of(spec, cells)), cells)


@given(st.lists(readings, min_size=1, max_size=5), st.lists(readings, min_size=1, max_size=5))
def test_a_map_that_is_drawn_anew_is_the_one_that_was_drawn_at_once(seen, better):
    pool = TilePool(8)
    robot_map, again, other = (RobotMap(SPEC, pool) for _ in range(3))
    see(other, better[0])
    for one in (robot_map, again):
        one.receive([("robot_9", 1, other.own.snapshot())])
    for reading in seen:
        see(robot_map, reading)
    robot_map.redraw_own([(np.array(pose), what) for pose, what in better], 25.0)
    for reading in better:
        see(again, reading)
    assert np.array_equal(robot_map.own.snapshot().cells(), again.own.snapshot().cells())
    assert np.array_equal(robot_map.fused, again.fused)


@settings(max_examples=15)
@given(st.lists(readings, min_size=1, max_size=5), st.lists(readings, min_size=1, max_size=5))
def test_a_layer_drawn_elsewhere_takes_the_place_of_the_own_one_and_is_not_written_to(seen, later):
    pool = TilePool(8)
    there, here, other = (RobotMap(SPEC, pool) for _ in range(3))
    see(other, later[0])
    here.receive([("robot_9", 1, other.own.snapshot())])
    for readings_ in (seen, later):
        for reading in readings_:
            see(there, reading)
        whole, before = there.own.snapshot(), states(here.fused)
        assert here.replace_own(whole) == (states(fuse((
            whole, other.own.snapshot()))) != before).any()
        assert not here.replace_own(whole)
        assert np.array_equal(here.fused, fuse(here.layers()))
    cells = whole.cells()
    see(here, seen[0])
    see(there, later[0])
    assert np.array_equal(whole.cells(), cells)
    del there, here, other, whole
    gc.collect()
    assert in_use(pool) == 0


# ---- sharing ------------------------------------------------------------------------------------


@given(st.lists(readings, min_size=2, max_size=8))
def test_a_snapshot_stays_as_it_was(seen):
    robot_map = RobotMap(SPEC, TilePool())
    taken: list[tuple[LayerSnapshot, np.ndarray]] = []
    for reading in seen:
        see(robot_map, reading)
        taken.append((robot_map.own.snapshot(), robot_map.own.snapshot().cells()))
    for snapshot, cells in taken:
        assert np.array_equal(snapshot.cells(), cells)


@given(st.lists(readings, min_size=2, max_size=8))
def test_tiles_that_did_not_change_are_shared(seen):
    robot_map = RobotMap(SPEC, TilePool())
    for reading in seen:
        before = robot_map.own.snapshot()
        see(robot_map, reading)
        after = robot_map.own.snapshot()
        changed = robot_map.own.changed_since(before)
        differ = np.flatnonzero((before.cells() != after.cells()).any(axis=1))
        assert changed.tolist() == differ.tolist()


def test_no_tile_leaks_and_none_is_freed_twice():
    pool = TilePool(4)
    rng = np.random.default_rng(1)
    maps = [RobotMap(SPEC, pool) for _ in range(4)]
    held = []
    for turn in range(60):
        teller = maps[turn % 4]
        pose = (rng.uniform(1, 13), rng.uniform(1, 9), rng.uniform(-3, 3))
        see(teller, (pose, scan(rng.uniform(0.1, 26.0, 8))))
        held.append(teller.own.snapshot())
        for number, listener in enumerate(maps):
            if number != turn % 4:
                listener.receive([(f"robot_{turn % 4}", turn, held[-1].only(held[-1].filled()))])
        if turn % 3 == 0:
            held.pop(turn % len(held))
    layers = [one.own for one in maps]
    received = [one for robot_map in maps for one in robot_map.received.values()]
    changes = [change for update in held for change in (update.changes or {}).values()]
    ends = [end for change in changes for end in (change.before, change.after)]
    snapshots = {id(s): s for s in (*held, *received, *ends, *(one._latest for one in layers))
                 if s is not None}
    points = np.concatenate([one.indices for one in (*layers, *snapshots.values())])
    _, refs, free, free_count = pool.arrays
    assert np.array_equal(np.bincount(points[points > 0], minlength=len(refs)), refs)
    assert sorted(free[:free_count[0]]) == [t for t in range(1, len(refs)) if refs[t] == 0]
    del maps, layers, snapshots, held, teller, listener, received, changes, ends
    gc.collect()
    assert in_use(pool) == 0
    assert not pool.arrays.refs.any()


@pytest.mark.parametrize("capacity", [1, 3, 64])
def test_the_pool_grows_and_nobody_notices(capacity):
    large, small = RobotMap(SPEC, TilePool(1024)), RobotMap(SPEC, TilePool(capacity))
    rng = np.random.default_rng(2)
    kept = []
    for _ in range(30):
        reading = ((rng.uniform(1, 13), rng.uniform(1, 9), 0.0), scan(rng.uniform(0.1, 26.0, 8)))
        for robot_map in (large, small):
            see(robot_map, reading)
            kept.append(robot_map.own.snapshot())
    assert np.array_equal(large.fused, small.fused)
    assert len(small.pool.arrays.data) >= in_use(small.pool) > 30
    assert not small.pool.arrays.data[0].any()


def test_cells_are_cropped_to_those_that_are_not_zero():
    cells = np.zeros((5, 7), np.int8)
    row, column, box = cropped(cells)
    assert (row, column, box.tolist()) == (0, 0, [[0]])
    cells[1, 2], cells[3, 4] = 9, -1
    row, column, box = cropped(cells)
    assert (row, column, box.tolist()) == (1, 2, [[9, 0, 0], [0, 0, 0], [0, 0, -1]])
