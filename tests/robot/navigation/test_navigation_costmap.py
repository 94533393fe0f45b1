"""The costmap: costmap_2d's costs, and incremental equals recomputed."""

import math
from decimal import Context, Decimal

import numpy as np
from drawn import Drawn, costmap, drawn
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from desim.middleware.contents import LaserScan
from desim.robot.mapping.tiles import FREE, OCCUPIED
from desim.robot.navigation.global_costmap import INSCRIBED, LETHAL, UNKNOWN, inflated_cost

FREE_OCCUPIED_UNKNOWN = np.array([FREE, OCCUPIED, 0], np.int16)


def by_distance(cells, resolution_m=0.2, radius_m=0.26, inflation_m=0.55):
    """The same costs from a distance transform over the whole map."""
    distance_m = distance_transform_edt(cells < OCCUPIED) * resolution_m
    if not (cells >= OCCUPIED).any():
        distance_m[:] = math.inf
    costs = np.zeros(cells.shape, np.uint8)
    for (row, column), d in np.ndenumerate(distance_m):
        if d <= inflation_m:
            costs[row, column] = inflated_cost(d, radius_m, 10.0)
    costs[cells >= OCCUPIED] = LETHAL
    costs[(cells > FREE) & (cells < OCCUPIED)] = UNKNOWN
    return costs


def test_costs_fall_off_as_in_costmap_2d():
    # int(252 exp(-10 (d - 0.26))) at 0.2 (inscribed), 0.4, 0.6 m (beyond 0.55 m nothing)
    robot_map = drawn("#....")
    assert costmap(robot_map).values[1, 1:-1].tolist() == [LETHAL, INSCRIBED, 62, 0, 0]


def test_costs_at_distances_are_the_published_ones():
    """costmap_2d's inflation: 253 up to the inscribed radius, int(252 exp(-k (d - inscribed)))
    beyond. The paper's footprint (inscribed radius 0.178 m) with the default scaling of 10, and
    the scaling 2.58 of turtlebot3's launch files with its radius 0.105 m: exact integers, worked
    out with 30 digits in ``decimal``."""
    def published(distance_m, inscribed_m, scaling):
        if Decimal(distance_m) <= Decimal(inscribed_m):
            return 253
        exponent = -Decimal(scaling) * (Decimal(distance_m) - Decimal(inscribed_m))
        return int(252 * exponent.exp(Context(prec=30)))

    table = {("0.178", "10"): [253, 202, 122, 74, 45, 27, 10, 6],
             ("0.105", "2.58"): [224, 197, 173, 152, 133, 117, 90, 79]}
    distances = ["0.15", "0.2", "0.25", "0.3", "0.35", "0.4", "0.5", "0.55"]
    for (inscribed_m, scaling), costs in table.items():
        assert [published(d, inscribed_m, scaling) for d in distances] == costs
        assert [inflated_cost(float(d), float(inscribed_m), float(scaling))
                for d in distances] == costs


def test_unknown_stays_unknown_and_the_rim_is_solid_without_inflating():
    made = costmap(drawn("..", "?."))
    assert made.values.tolist() == [[LETHAL] * 4, [LETHAL, UNKNOWN, 0, LETHAL],
                                    [LETHAL, 0, 0, LETHAL], [LETHAL] * 4]


@st.composite
def changing_maps(draw):
    """A map over several tiles and some rectangles that change in it, one after another."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = draw(st.sampled_from([(40, 70), (33, 32), (5, 65)]))
    share = draw(st.sampled_from([0.01, 0.1, 0.5]))
    maps = [rng.choice(FREE_OCCUPIED_UNKNOWN, shape, p=[0.9 - share, share, 0.1])]
    for _ in range(draw(st.integers(1, 4))):
        cells = maps[-1].copy()
        row, column = rng.integers(shape[0]), rng.integers(shape[1])
        part = cells[row:row + rng.integers(1, 8), column:column + rng.integers(1, 8)]
        part[:] = rng.choice(FREE_OCCUPIED_UNKNOWN, part.shape)
        maps.append(cells)
    return maps


@given(changing_maps())
def test_incremental_is_recomputed_and_both_follow_the_distance(maps):
    robot_map = Drawn(maps[0])
    made = costmap(robot_map)
    for cells in maps:
        robot_map.know(cells)
        made.update()
        assert np.array_equal(made.values, costmap(Drawn(cells)).values)
        assert np.array_equal(made.values[1:-1, 1:-1], by_distance(cells))


@given(changing_maps(), st.integers(0, 40))
def test_changed_near_knows_the_tiles_that_changed(maps, reach):
    robot_map = Drawn(maps[0])
    made = costmap(robot_map)
    robot_map.know(maps[-1])
    height, width = maps[0].shape
    for row, column in np.argwhere(maps[0] != maps[-1])[:20]:
        assert made.changed_near((int(row) + 1) * made.across + int(column) + 1, reach, made.seen)
    made.update()
    assert not any(made.changed_near(made.cell(x, y), reach, made.seen)
                   for x in np.arange(0, width * 0.2) for y in np.arange(0, height * 0.2))


def test_cells_and_points():
    made = costmap(drawn("...", "...", resolution_m=0.5))
    assert made.centre(made.cell(0.6, 0.9)) == (0.75, 0.75)
    assert made.centre(made.cell(-3.0, 99.0)) == (0.25, 0.75)  # outside: the nearest inside


def test_the_nearest_free_cell_is_not_within_the_robots_radius_of_a_wall():
    made = costmap(drawn("#.....", "#.....", "#....."))
    near = made.free_near(0.1, 0.3, 1.0)
    assert made.centre(near) == (0.5, 0.30000000000000004)
    assert made.free_near(0.1, 0.3, 0.3) == -1


def seen(at, yaw, *hits):
    """A scan of 181 beams over 180 degrees from a pose: (angle in whole degrees, range in m)."""
    ranges = np.full(181, 26.0, np.float32)
    for angle, r in hits:
        ranges[90 + angle] = r
    return [(LaserScan(0, ranges, -math.pi / 2, math.pi / 180, 26.0), (*at, yaw))]


def test_what_the_robot_sees_clears_and_marks():
    """From (4.1, 4.1) m, facing up. Ghosts are at 1 m ahead, 1 m behind and under the robot; there
    is something 2 m ahead and 2.6 m to the right, of which the map knows nothing."""
    cells = np.full((41, 41), FREE, np.int16)
    for column, row in ((20, 25), (20, 15), (20, 20), (21, 20)):
        cells[row, column] = OCCUPIED
    robot_map = Drawn(cells)
    made = costmap(robot_map)
    made.see(seen((4.1, 4.1), math.pi / 2, (0, 2.0), (-90, 2.6)))
    expected = np.full((41, 41), FREE, np.int16)
    expected[15, 20] = expected[30, 20] = OCCUPIED  # out of view; within 2.5 m
    assert np.array_equal(made.values[1:-1, 1:-1], by_distance(expected))
    cells[30, 0] = OCCUPIED  # in the tile of all of these: a row that changes is the map's again
    robot_map.know(cells)
    made.update()
    assert made.values[31, 21] == 0 and made.values[16, 21] == LETHAL


@given(changing_maps(), st.floats(0.0, 13.0), st.floats(0.0, 8.0), st.floats(-3.0, 3.0),
       st.lists(st.tuples(st.integers(-90, 90), st.floats(0.05, 5.0)), max_size=20))
def test_after_a_scan_the_costs_follow_the_distance_as_before(maps, x, y, yaw, hits):
    robot_map = Drawn(maps[0])
    made = costmap(robot_map)
    made.see(seen((x, y), yaw, *hits))
    inside = made.values[1:-1, 1:-1]
    classes = np.select([inside == LETHAL, inside == UNKNOWN], [OCCUPIED, 0], FREE)
    assert np.array_equal(inside, by_distance(classes))
    robot_map.know(np.full_like(maps[0], FREE))
    made.update()
    robot_map.know(maps[-1])
    made.update()
    assert np.array_equal(made.values, costmap(Drawn(maps[-1])).values)
