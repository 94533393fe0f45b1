"""The surroundings of media without a world: an open place that nobody can change."""

import numpy as np
import pytest

from desim.network.surroundings import Nowhere, Still


def test_nowhere_there_is_nothing_in_the_way_and_nobody_has_a_place():
    nowhere = Nowhere(3)
    walls = nowhere.obstacles
    assert len(walls.segments) == len(walls.material) == len(walls.thickness_m) == 0
    assert len(walls.height_m) == len(walls.materials) == 0
    assert walls.crossings(np.array([[0, 0, 9, 9]])).shape == (0, 2)
    assert np.isnan(nowhere.positions(5)).all() and nowhere.positions(0).shape == (3, 2)


@pytest.mark.parametrize("make", [lambda: Nowhere(2), lambda: Still(np.zeros((2, 2)))])
def test_nobody_can_move_hosts(make):
    with pytest.raises(ValueError, match="read-only"):
        make().positions(0)[0] = 1.0
