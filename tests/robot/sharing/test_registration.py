"""Relative poses from maps alone: found where maps overlap, refused where they do not or repeat."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from desim.ports import GridSpec, Pose2D
from desim.robot.sharing.map_resampling import resampled
from desim.robot.sharing.registration import TrinaryMap, judged, register, rotations
from desim.robot.transforms import motion_between

CELL_M = 0.2
SIDE = 150  # cells of a plan


def plan(seed):
    """Rooms whose walls stand anywhere: [SIDE, SIDE], 1 wall, -1 free."""
    state = -np.ones((SIDE, SIDE), np.int8)
    state[[0, -1]] = state[:, [0, -1]] = 1
    rng = np.random.default_rng(seed)
    for _ in range(9):
        at, low, length = rng.integers(8, SIDE - 8), rng.integers(0, 90), rng.integers(20, 60)
        (state if rng.integers(2) else state.T)[at, low:low + length] = 1
    return state


def seen_from(state, frame, columns=(0, SIDE)):
    """The chart of a robot whose frame is ``frame`` and that knows these columns of a plan."""
    known = np.zeros_like(state)
    known[:, slice(*columns)] = state[:, slice(*columns)]
    inverse = Pose2D(*motion_between(np.array(frame), np.zeros(3)).tolist())
    reach = 250
    grid = GridSpec(CELL_M, 2 * reach, 2 * reach, -reach * CELL_M, -reach * CELL_M)
    row, column, cells = resampled(grid, known, CELL_M, (0.0, 0.0), inverse)
    return TrinaryMap(grid.x_m + CELL_M * column, grid.y_m + CELL_M * row, CELL_M, cells)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 50), st.floats(-3.1, 3.1), st.floats(2, 28), st.floats(2, 28))
@example(0, math.pi / 2, 3.0, 3.0)
def test_the_frame_of_a_map_that_overlaps_by_half_is_found(seed, turn_rad, x_m, y_m):
    whole = plan(seed)
    one, two = np.array([5.0, 4.0, 0.3]), np.array([x_m, y_m, turn_rad])
    found = register(seen_from(whole, one, (0, 110)), seen_from(whole, two, (40, SIDE)))
    truth = motion_between(one, two)
    if found.rival <= 0.5:
        assert math.dist(found.best.frame[:2], truth[:2]) < 0.3
        assert abs(math.remainder(found.best.frame[2] - truth[2], math.tau)) < 0.01
        assert found.best.confidence > 0.95
    else:
        assert found.best.agree > 0  # the plan repeats itself


def test_most_of_these_plans_do_not_repeat_themselves():
    rivals = [register(seen_from(plan(seed), (5.0, 4.0, 0.3), (0, 110)),
                       seen_from(plan(seed), (20.0, 9.0, 2.0), (40, SIDE))).rival
              for seed in range(10)]
    assert np.count_nonzero(np.array(rivals) <= 0.6) >= 8


def test_maps_of_different_places_are_refused():
    for seed in range(8):
        found = register(seen_from(plan(seed), (5.0, 4.0, 0.3), (1, SIDE - 1)),
                         seen_from(plan(100 + seed), (9.0, 14.0, -1.0), (1, SIDE - 1)))
        assert found.best.confidence < 0.95 or found.rival > 0.6


def test_a_room_with_two_symmetries_has_a_rival_as_good_as_the_best():
    room = -np.ones((SIDE, SIDE), np.int8)
    room[[0, -1]] = room[:, [0, -1]] = 1
    found = register(seen_from(room, (5.0, 4.0, 0.3)), seen_from(room, (9.0, 14.0, -1.0)))
    assert found.best.confidence > 0.95 and found.rival > 0.95


def test_a_map_without_walls_is_not_laid_anywhere():
    empty = TrinaryMap(0.0, 0.0, CELL_M, -np.ones((30, 30), np.int8))
    assert register(empty, seen_from(plan(1), (1.0, 1.0, 0.0))) is None
    assert register(seen_from(plan(1), (1.0, 1.0, 0.0)), empty) is None


def test_agreement_counts_the_walls_of_both_maps_on_known_cells_only():
    state = np.zeros((5, 5), np.int8)
    state[1:4] = -1
    state[2, 1:4] = 1  # a wall of three cells, free cells around, unknown rims
    one = TrinaryMap(0.0, 0.0, 1.0, state)
    right = judged(one, one, np.zeros(3))
    assert (right.agree, right.differ, right.confidence) == (6, 0, 1.0)
    assert judged(one, one, np.array([0.0, 1.0, 0.0])).confidence == 1.0  # a cell is within reach
    assert judged(one, one, np.array([0.0, 3.0, 0.0])).agree == 0  # on the unknown rim
    free = TrinaryMap(0.0, 0.0, 1.0, np.full((5, 5), -1, np.int8))
    assert judged(free, one, np.zeros(3))[1:] == (0, 3)


def test_the_spectra_of_turned_walls_differ_by_the_turn():
    walls = np.column_stack((np.arange(0, 20, 0.2), np.zeros(100)))
    cos, sin = math.cos(0.5), math.sin(0.5)
    turned = walls @ np.array([[cos, sin], [-sin, cos]])
    turns = rotations(turned, walls, CELL_M)
    assert turns[0] == pytest.approx(0.5, abs=0.01)
    assert turns[1] == pytest.approx(0.5 + math.pi, abs=0.01)
