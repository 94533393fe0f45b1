"""The growth of maps: how coarse it is kept, so that a fleet's maps fit into memory."""

import pytest

from desim.monitor.map_growth import coarse, halvings
from desim.ports import GridSpec

LARGEST = GridSpec(0.05, 8192, 4096, -1.0, 2.0)  # 2^25 cells, as many as are kept of all robots


@pytest.mark.parametrize(("robots", "halved"), [
    (1, 0), (2, 1), (4, 1), (5, 2), (16, 2), (17, 3), (64, 3), (65, 4), (10**6, 5)])
def test_maps_are_halved_until_a_quarter_of_a_quarter_fits(robots, halved):
    assert halvings(LARGEST, robots) == halved


def test_coarse_cells_cover_the_map_and_begin_where_it_does():
    assert coarse(GridSpec(0.05, 17, 16, -1.0, 2.0), 2) == GridSpec(0.2, 5, 4, -1.0, 2.0)
