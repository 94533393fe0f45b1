"""Queries of a map: areas, paths and rasters in metres."""

import numpy as np
import pytest
from drawn import costmap, drawn

from desim.robot.navigation.map_queries import MapQueries
from desim.scenario.schema.robot import ExplorationParams

# 4 m x 2 m in cells of 0.2 m: known on the left, three cells of a room's corner unknown, a wall.
ROOM = ["." * 12 + "#" + "?" * 7] * 4 + ["." * 9 + "???" + "#" + "?" * 7] + [
    "." * 12 + "#" + "?" * 7] * 5


def queries(*lines, resolution_m=0.2, smallest_m=0.8, view_m=8.0):
    made = costmap(drawn(*lines, resolution_m=resolution_m))
    return MapQueries(made, ExplorationParams(min_frontier=f"{smallest_m} m"), 0.4, view_m)


def test_a_gain_is_the_unknown_area_in_view():
    """Three cells of 0.2 m; what is behind the wall, or too far away, is not in view."""
    room = queries(*ROOM)
    assert room.gain_m2(1.1, 1.1) == pytest.approx(3 * 0.04)
    assert room.gain_m2(1.1, 1.1) == pytest.approx(3 * 0.04)  # each call counts anew
    assert queries(*ROOM, view_m=1.0).gain_m2(1.1, 1.1) == pytest.approx(2 * 0.04)
    assert queries(*ROOM, view_m=0.6).gain_m2(1.1, 1.1) == 0


@pytest.mark.parametrize("x_m, y_m, on_map", [
    (0.0, 0.0, True), (3.99, 1.99, True), (-0.01, 1.0, False), (4.01, 1.0, False),
    (1.0, -0.01, False), (1.0, 2.01, False)])
def test_the_map_ends_at_its_raster(x_m, y_m, on_map):
    assert queries(*ROOM).is_on_map(x_m, y_m) == on_map


def test_a_place_is_free_if_there_is_room_for_the_robot_near_it():
    room = queries(*ROOM)
    assert room.is_free(1.0, 1.0)
    assert not room.is_free(3.1, 1.7)  # behind the wall: free cells are more than 0.4 m away
    assert not room.is_free(-1.0, 1.0)


def test_a_raster_has_three_values_and_costs_are_a_copy():
    room = queries(*ROOM)
    occupancy = room.occupancy()
    assert occupancy.shape == (10, 20) and room.cells == 200
    assert [occupancy[5, column] for column in (8, 9, 12)] == [0, -1, 100]
    room.costs()[:] = 7
    costs = room.costs()
    assert costs.shape == (10, 20) and costs[0, 12] == 254 and costs[0, 0] < 253


def test_small_frontiers_count_where_there_are_no_others():
    """Three cells are 0.6 m, less than the 0.8 m that count, and not less than 0.6 m."""
    gap = ["." * 18 + "?"] + ["." * 19] * 8
    strip = queries(*gap, smallest_m=0.8)
    assert strip.smallest == 4
    small, = strip.frontiers((1.0, 0.9), None, np.zeros((0, 3), np.int64))
    assert small.cells < 4


def test_paths_that_do_not_exist_are_infinitely_long():
    lengths_m = queries(*ROOM).path_lengths_m((0.5, 1.0), [(1.5, 1.0), (3.5, 1.0), (0.5, 1.0)])
    assert lengths_m[0] == pytest.approx(1.0, abs=0.3)
    assert np.isinf(lengths_m[1]) and lengths_m[2] == 0
