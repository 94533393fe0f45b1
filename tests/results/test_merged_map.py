"""The maps of all robots as one, on maps of a few cells."""

from __future__ import annotations

import numpy as np

from desim.monitor.map_growth import NEVER, MapGrowth
from desim.ports import GridSpec
from desim.results.merged_map import UNKNOWN_TO_ALL, known_at, merged
from desim.units import NS_PER_S

ROBOTS = ("robot_0", "robot_1")


def growth(robot, start_s, end_s, known_since, occupied) -> MapGrowth:
    cells = np.array([known_since], np.uint16)
    return MapGrowth(robot, start_s * NS_PER_S, end_s * NS_PER_S,
                     GridSpec(0.1, cells.shape[1], 1, 0.0, 0.0), cells,
                     np.array([occupied], bool))


# Robot 1 starts again after 2 s: its tenths count from there.
FIRST = growth("robot_0", 0, 9, [5, 30, NEVER, 10], [0, 0, 0, 1])
AGAIN = growth("robot_1", 2, 9, [0, 5, NEVER, NEVER - 1], [1, 1, 1, 0])


def test_who_knew_a_cell_first():
    whole = merged([FIRST, AGAIN], ROBOTS)
    assert whole.known_since.tolist() == [[5, 25, UNKNOWN_TO_ALL, 10]]
    assert whole.discoverer.tolist() == [[0, 1, 0, 0]]
    assert whole.occupied.tolist() == [[False, True, False, True]]


def test_of_two_at_once_it_is_the_first_one_given():
    same = growth("robot_1", 0, 9, [5, 30, NEVER, 10], [1, 1, 1, 0])
    for growths, robot in (((FIRST, same), 0), ((same, FIRST), 1)):
        whole = merged(growths, ROBOTS)
        known = whole.known_since < UNKNOWN_TO_ALL
        assert set(whole.discoverer[known].tolist()) == {robot}


def test_what_becomes_known_after_the_last_tenth_that_a_table_holds_is_not_lost():
    late = growth("robot_1", 7000, 9000, [3, NEVER], [0, 0])
    assert merged([late], ROBOTS).known_since.tolist() == [[70_003, UNKNOWN_TO_ALL]]


def test_what_all_know_at_an_instant():
    def at(time_s):
        return known_at([FIRST, AGAIN], round(time_s * NS_PER_S))

    assert at(0.4).tolist() == [[-1, -1, -1, -1]]
    assert at(1).tolist() == [[0, -1, -1, 100]]
    assert at(2).tolist() == [[100, -1, -1, 100]]  # one against one: an obstacle
    assert at(3).tolist() == [[100, 100, -1, 100]]
    assert at(9.5) is None and known_at([], 0) is None
